"""The teapot on a small slanted display, as three eyes in front of it see it; three_eyes.png."""

import sys
from pathlib import Path

import numpy as np

import lippmann
from lippmann.image.write import write_plain_picture

DISPLAY = "monitor:size=720x540,dpi=150,pitch=8.4,slope=6,center=0"


def main(path: Path, spp: int = 4) -> None:
    image = lippmann.render("teapot", DISPLAY, placement={"pop_out": 0.3}, spp=spp)
    eyes = [image.replay((x, 0.0, 500.0), size=(432, 324), filter="linear")[12:-12, 16:-16] for x in (-90.0, 0.0, 90.0)]
    write_plain_picture(np.hstack(eyes), path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
