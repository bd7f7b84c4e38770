"""The gears as a print behind 60 lenses an inch: native pixels, and what an eye sees of them; print_seen.png."""

import sys
from pathlib import Path

import numpy as np

import lippmann
from lippmann.image.write import write_plain_picture


def main(path: Path, size: str = "60x45mm") -> None:
    display = lippmann.load_display(f"print:lpi=60,ppi=600,size={size},viewing-distance=400mm,thickness=0.66mm")
    image = lippmann.render("gears", display, spp=1)
    seen = image.replay((0.0, 0.0, 400.0), size=(480, 360), filter="linear")
    row, column = image.pixels.shape[0] // 2, image.pixels.shape[1] // 2
    native = image.pixels[row : row + 60, column : column + 80].repeat(6, axis=0).repeat(6, axis=1)
    write_plain_picture(np.hstack([native, seen]), path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
