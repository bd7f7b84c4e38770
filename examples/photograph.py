"""A photograph with a depth map, made here, as an eye sees it from the left and from the right; photograph.png."""

import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

import lippmann
from lippmann.image.write import write_plain_picture


def photograph() -> tuple[np.ndarray, np.ndarray]:
    """A ball before a chequered wall: sRGB codes, and the distance of each pixel."""
    y, x = np.mgrid[-1:1:480j, -1.333:1.333:640j]
    wall = (np.floor(5 * x) + np.floor(5 * y)) % 2
    codes = np.stack([120 + 60 * wall, 130 + 50 * wall, 140 + 40 * wall], axis=-1)
    depth = np.full(x.shape, 3.0, np.float32)
    inside = x**2 + y**2 < 0.36
    bulge = np.sqrt(np.clip(0.36 - x**2 - y**2, 0, None))
    depth[inside] = 1.6 - 0.5 * bulge[inside]
    codes[inside] = (np.array([220, 90, 40]) * (0.4 + bulge[inside, None])).clip(0, 255)
    return codes.astype(np.uint8), depth


def main(path: Path, width: int = 800) -> None:
    codes, depth = photograph()
    display = f"monitor:size={width}x{width * 3 // 4},dpi=200,pitch=5.6,slope=6,center=0"
    with tempfile.TemporaryDirectory() as folder:
        Image.fromarray(codes).save(Path(folder, "photo.png"))
        np.save(Path(folder, "depth.npy"), depth)
        scene = lippmann.load_scene(Path(folder, "photo.png"), depth_map=Path(folder, "depth.npy"))
        image = lippmann.render(scene, display)
    eyes = [image.replay((x, 0.0, 500.0), size=(432, 324), filter="linear")[12:-12, 16:-16] for x in (-40.0, 40.0)]
    write_plain_picture(np.hstack(eyes), path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
