"""A field of three metaballs as a glowing volume; volume.png."""

import sys
import tempfile
from pathlib import Path

import numpy as np

import lippmann
from lippmann.image.write import write_plain_picture

DISPLAY = lippmann.Display(
    name="array",
    panel=lippmann.Panel(width=960, height=960, pixel_pitch=0.08),
    lens_array=lippmann.LensArray(layout="square", pitch=0.4),
    gap=1.2,
    viewing_distance=450.0,
)

BALLS = ((-0.45, -0.1, 0.0, 0.34), (0.4, 0.25, 0.2, 0.3), (0.15, -0.4, -0.3, 0.26))


def field(side: int) -> np.ndarray:
    """Densities ``(z, y, x)`` in [0, 1]."""
    z, y, x = np.mgrid[-1 : 1 : side * 1j, -1 : 1 : side * 1j, -1 : 1 : side * 1j]
    total = sum(radius**4 / ((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2 + 1e-3) ** 2 for a, b, c, radius in BALLS)
    return np.clip(total / 6, 0, 1).astype(np.float32)


def main(path: Path, side: int = 128) -> None:
    with tempfile.TemporaryDirectory() as folder:
        np.save(Path(folder, "field.npy"), field(side))
        scene = lippmann.load_scene(Path(folder, "field.npy"), transfer_function="fire", window=(0.1, 1.0))
        image = lippmann.render(scene, DISPLAY, placement={"turn": (30, 20)})
    seen = image.replay(size=(496, 496), filter="linear")
    write_plain_picture(seen[8:-8, 8:-8], path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
