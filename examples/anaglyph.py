"""The small mirror balls for red-cyan glasses; anaglyph.png."""

import sys
from pathlib import Path

import lippmann
from lippmann.image.write import write_plain_picture

DISPLAY = lippmann.Display(
    name="array",
    panel=lippmann.Panel(width=1280, height=960, pixel_pitch=0.08),
    lens_array=lippmann.LensArray(layout="square", pitch=0.4),
    gap=1.2,
    viewing_distance=450.0,
)


def main(path: Path, spp: int = 4) -> None:
    image = lippmann.render("small-balls", DISPLAY, placement={"place": "fit", "turn": (20, 25)}, spp=spp)
    seen = lippmann.replay_stereo(image, stereo="anaglyph", size=(640, 480), filter="linear")
    write_plain_picture(seen[8:-8, 8:-8], path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
