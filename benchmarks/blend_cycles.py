"""Blender files against Cycles: how far a camera's picture of each scene of the tests is from Cycles' own.

Time on two cores: an estimated 5 minutes.

python benchmarks/blend_cycles.py --python PYTHON [SCENE ...]

``PYTHON`` is an interpreter with the package ``bpy``. For each scene: the ratio of the pictures' means by channel, and
the share of pixels whose sRGB codes differ by more than 0.1. Cycles renders 64 samples a pixel, Lippmann too, without
denoising, with a box filter and the same depth of paths.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import lippmann
from harness import save
from lippmann.codecs.exr import read_exr, read_exr_header
from lippmann.color.transfer import encode_srgb
from lippmann.scene.readers.blend.find_blender import VARIABLE

TESTS = Path(__file__).parent.parent / "tests" / "scene" / "readers" / "blend"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", help="all by default")
    parser.add_argument("--python", required=True, help="an interpreter with bpy")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, "blender")
        program.write_text(f'#!/bin/sh\nexec "{options.python}" -P "{TESTS / "blender_by_bpy.py"}" "$@"\n')
        program.chmod(0o755)
        os.environ[VARIABLE] = str(program)
        command = [options.python, "-P", str(TESTS / "make_cycles_pictures.py"), "--", folder, *options.scenes]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        told = subprocess.run([str(program), "--version"], check=True, capture_output=True, text=True).stdout
        rows = [_compare(path) for path in sorted(Path(folder).glob("*.exr"))]
    version = re.search(r"Blender ([0-9.]+)", told)
    assert version is not None
    save("blend_cycles", {"blender": version[1], "rows": rows})


def _compare(path: Path) -> dict[str, Any]:
    channels = read_exr(path, read_exr_header(path))
    cycles = np.stack([channels[color] for color in "RGB"], axis=-1)
    options = {"spp": 64, "depth": 9, "pixel_filter": "box", "tone_map": "none", "denoise": "none", "exposure": 0}
    scene = lippmann.load_scene(path.with_suffix(".blend"))
    seen = lippmann.preview(scene, size=(cycles.shape[1], cycles.shape[0]), camera="Camera", **options).pixels
    ratio = seen.mean(axis=(0, 1)) / cycles.mean(axis=(0, 1))
    codes = [encode_srgb(np.clip(picture, 0.0, 1.0)) for picture in (seen, cycles)]
    return {
        "scene": path.stem,
        "means": [round(float(value), 4) for value in ratio],
        "off": round(float((np.abs(codes[0] - codes[1]).max(axis=-1) > 0.1).mean()), 4),
        "notes": list(scene.description.notes),
    }


if __name__ == "__main__":
    main()
