"""Makes the picture at the top of the README: the bundled teapot's native pixels beside what an eye sees of them.

python examples/readme_picture.py docs/images/teapot.png
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import lippmann
from lippmann.image.write import write_plain_picture


def main(path: Path) -> None:
    image = lippmann.render("teapot", "seed-lenticular", spp=256, seed=1)
    seen = image.replay((0.0, 0.0, 600.0), size=(512, 512), filter="linear")
    write_plain_picture(np.hstack([image.pixels, np.ones((512, 8, 3), dtype=np.float32), seen]), path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
