"""A camera with a wide aperture focuses behind, in and in front of the lens plane of one picture; focal_stack.png."""

import sys
from pathlib import Path

import numpy as np

import lippmann
from lippmann.image.write import write_plain_picture

DISPLAY = lippmann.Display(
    name="array",
    panel=lippmann.Panel(width=900, height=900, pixel_pitch=0.12),
    lens_array=lippmann.LensArray(layout="square", pitch=0.9),
    gap=3.0,
    aperture_distance=40.0,
)


def main(path: Path, spp: int = 4) -> None:
    image = lippmann.render("small-balls", DISPLAY, placement={"pop_out": 0.5, "turn": (15, 30)}, spp=spp)
    planes = [image.refocus(plane, size=(300, 300)) for plane in (-12.0, 0.0, 12.0)]
    write_plain_picture(np.hstack(planes), path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
