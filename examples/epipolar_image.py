"""The middle view of a light field, and below it the epipolar-plane image of its middle row; epipolar_image.png."""

import sys
from pathlib import Path

import numpy as np

import lippmann
from lippmann.image.write import write_plain_picture

#: Pixels behind each lens, in both directions: so many views there are.
VIEWS = 13
DISPLAY = lippmann.Display(
    name="light-field",
    panel=lippmann.Panel(width=240 * VIEWS, height=160 * VIEWS, pixel_pitch=0.02),
    lens_array=lippmann.LensArray(layout="square", pitch=0.02 * VIEWS),
    gap=1.0,
    aperture_distance=10.0,
)


def main(path: Path, lenses: tuple[int, int] = (240, 160), spp: int = 1) -> None:
    display = DISPLAY.resized(lenses[0] * VIEWS, lenses[1] * VIEWS)
    image = lippmann.render("small-balls", display, placement={"turn": (15, 20)}, spp=spp)
    views = image.views()[VIEWS // 2]
    epipolar = views[:, lenses[1] // 2].repeat(2, axis=0)
    gap = np.ones((4, lenses[0], 3), dtype=np.float32)
    write_plain_picture(np.vstack([views[VIEWS // 2], gap, epipolar]).repeat(2, axis=0).repeat(2, axis=1), path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
