"""Small balls behind hexagonal lenses: micro-images as they lie on the panel and enlarged; micro_images.png."""

import sys
from pathlib import Path

import numpy as np

import lippmann
from lippmann.image.write import write_plain_picture

DISPLAY = lippmann.Display(
    name="hexagons",
    panel=lippmann.Panel(width=960, height=640, pixel_pitch=0.1),
    lens_array=lippmann.LensArray(layout="hexagonal", pitch=1.2),
    gap=3.0,
    viewing_distance=400.0,
    aperture_distance=40.0,
)


def main(path: Path, spp: int = 2) -> None:
    image = lippmann.render("small-balls", DISPLAY, placement={"pop_out": 0.4, "turn": (15, 30)}, spp=spp)
    native = image.pixels[40:360, 320:640]
    large = image.pixels[180:260, 460:540].repeat(4, axis=0).repeat(4, axis=1)
    seen = image.replay((0.0, 0.0, 400.0), size=(480, 320), filter="linear")[:, 80:400]
    write_plain_picture(np.hstack([native, large, seen]), path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
