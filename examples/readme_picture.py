"""The picture at the top of the README: a model on a Looking Glass Portrait from three eyes, and its native pixels.

python examples/readme_picture.py MODEL.gltf docs/images/porcelain.png

The README shows the porcelain teapot of Poly Haven (CC0).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import lippmann
from lippmann.image.write import write_plain_picture

#: Rows and columns of what is shown: of an eye's picture, of the native pixels, and of those that are enlarged.
SEEN, NATIVE, ENLARGED = np.s_[78:518, 8:448], np.s_[390:830, 240:1136], np.s_[520:630, 300:410]
#: Millimetres from the middle of the panel to the eyes at its viewing distance.
EYES = (-130.0, 0.0, 130.0)
ENLARGEMENT, GAP = 4, 16


def main(model: Path, path: Path) -> None:
    scene = lippmann.load_scene(model, background=(0.03, 0.035, 0.045))
    image = lippmann.render(scene, "looking-glass-portrait", placement={"turn": (40, 20)}, spp=6, seed=1)
    write_plain_picture(composed(image), path)


def composed(image: lippmann.IntegralImage) -> np.ndarray:
    """What three eyes see in a row, above native pixels one to one, and some of them enlarged."""
    distance = image.display.viewing_distance
    seen = [image.replay((x, 0.0, distance), size=(456, 608), filter="linear")[SEEN] for x in EYES]
    large = image.pixels[ENLARGED].repeat(ENLARGEMENT, axis=0).repeat(ENLARGEMENT, axis=1)
    return below(beside(*seen), beside(image.pixels[NATIVE], large))


def beside(*pictures: np.ndarray) -> np.ndarray:
    gap = np.ones((pictures[0].shape[0], GAP, 3), dtype=np.float32)
    return np.hstack([part for picture in pictures for part in (gap, picture)][1:])


def below(*pictures: np.ndarray) -> np.ndarray:
    return np.transpose(beside(*(np.transpose(picture, (1, 0, 2)) for picture in pictures)), (1, 0, 2))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
