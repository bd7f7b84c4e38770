"""A volume before a large panel: how long it takes to read and to trace it, and in how much memory.

Time on two cores: an estimated half hour.

python benchmarks/volumes.py                          # 512 x 512 x 300 voxels, looking-glass-portrait's panel
python benchmarks/volumes.py --size 128 128 100 --display seed-lenticular

The volume is a synthetic CT of a head: skin, skull with orbits, brain, jaw, and noise of 15 Hounsfield units. Each
transfer function runs in a process of its own. Writes results/volumes.json.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter

from harness import save

PRESETS = ("ct-bone", "ct-soft")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, nargs=3, default=[512, 512, 300], help="voxels across, deep and high")
    parser.add_argument("--display", default="looking-glass-portrait")
    parser.add_argument("--memory", type=float, default=4.0, help="GiB that a picture may use")
    parser.add_argument("--inside", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.inside:
        print(json.dumps(measure(Path(options.inside[0]), options.inside[1], options.display, options.memory)))
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "head.npz"
        np.savez(path, head=head(*options.size).transpose(1, 0, 2)[:, ::-1], spacing=[0.4, 0.6, 0.4])
        rows = []
        for preset in PRESETS:
            command = [sys.executable, __file__, "--display", options.display, "--memory", str(options.memory)]
            done = subprocess.run([*command, "--inside", path, preset], check=True, capture_output=True, text=True)
            rows.append(json.loads(done.stdout.splitlines()[-1]))
            print(rows[-1], file=sys.stderr)
    save("volumes", {"size": options.size, "display": options.display, "memory": options.memory, "rows": rows})


def head(width: int, depth: int, height: int) -> np.ndarray[Any, np.dtype[np.int16]]:
    """Hounsfield units ``(height, depth, width)`` of a head that looks toward the first row."""
    z, y, x = np.ogrid[-1 : 1 : height * 1j, -1 : 1 : depth * 1j, -1 : 1 : width * 1j]
    values = np.full((height, depth, width), -1000.0, np.float32)

    def ball(center: tuple[float, float, float], radii: tuple[float, float, float]) -> Any:
        (cx, cy, cz), (rx, ry, rz) = center, radii
        return ((x - cx) / rx) ** 2 + ((y - cy) / ry) ** 2 + ((z - cz) / rz) ** 2 < 1

    values[ball((0, 0, 0), (0.75, 0.9, 0.92)) | ball((0, -0.92, -0.15), (0.1, 0.16, 0.18))] = 40
    values[ball((0, 0.03, 0.05), (0.66, 0.8, 0.8))] = 900
    values[ball((0, 0.03, 0.05), (0.6, 0.74, 0.74))] = 35
    for side in (-0.26, 0.26):
        values[ball((side, -0.72, 0.05), (0.16, 0.3, 0.14))] = 30
        values[ball((side * 0.8, 0.1, 0.1), (0.09, 0.3, 0.18))] = 8
    values[ball((0, -0.85, -0.22), (0.09, 0.2, 0.12))] = -900
    jaw = ball((0, -0.3, -0.68), (0.5, 0.5, 0.13)) & ~ball((0, -0.15, -0.68), (0.4, 0.48, 0.3))
    values[jaw] = 1100
    values = gaussian_filter(values, 0.8)
    values += 15 * np.random.default_rng(0).standard_normal(values.shape, dtype=np.float32)
    return np.round(values).astype(np.int16)


def measure(path: Path, preset: str, display: str, memory: float) -> dict[str, Any]:
    import lippmann
    from lippmann.runtime.engine import start

    start()
    small = np.zeros((4, 4, 4), np.int16)
    np.save(path.parent / "small.npy", small)
    lippmann.render(path.parent / "small.npy", "seed-lenticular")  # compiles
    began, processor = time.perf_counter(), time.process_time()
    scene = lippmann.load_scene(path, transfer_function=preset)
    read = time.perf_counter() - began
    image = lippmann.render(scene, display, memory=int(memory * 2**30))
    rays = image.provenance.rays["primary"]
    return {
        "transfer_function": preset,
        "voxels": int(scene.description.volume.grid.size),
        "voxel_bytes": int(scene.description.volume.grid.nbytes),
        "panel": [int(side) for side in image.pixels.shape[1::-1]],
        "rays": int(rays),
        "seconds_read": round(read, 2),
        "seconds": round(time.perf_counter() - began, 1),
        "processor_seconds": round(time.process_time() - processor, 1),
        "peak_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
    }


if __name__ == "__main__":
    main()
