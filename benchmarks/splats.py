"""Gaussian splats before a large panel: how long it takes to read and to trace them, and in how much memory.

Time on two cores: about 10 minutes.

python benchmarks/splats.py                        # 100 000 and a million splats
python benchmarks/splats.py --counts 10000 --display seed-lenticular

The splats are sampled from a bundled scene, three of a hundred adrift (``examples/splats_from_scene.py``), with
harmonics of degree 3; each count is rendered by a process of its own. Seconds are the processor's, of all threads
together: on a machine of one's own two cores take half of them.
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

from harness import save

sys.path.insert(0, str(Path(__file__).parent.parent / "examples"))

SCENE, DISPLAY = "room", "looking-glass-portrait"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--counts", type=int, nargs="+", default=[100_000, 1_000_000])
    parser.add_argument("--display", default=DISPLAY)
    parser.add_argument("--memory", type=int, default=24, help="GiB that a render may take")
    parser.add_argument("--make", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--render", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.make is not None:
        _make(options.make, options.render)
    elif options.render is not None:
        print(json.dumps(_render(options.render, options.display, options.memory << 30)))
    else:
        _measure(options)


def _measure(options: argparse.Namespace) -> None:
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for count in options.counts:
            path = Path(folder) / f"{count}.ply"
            common = [sys.executable, __file__, "--render", str(path), "--display", options.display]
            subprocess.run([*common, "--make", str(count)], check=True)
            found = subprocess.run(
                [*common, "--memory", str(options.memory)], check=True, capture_output=True, text=True
            )
            rows.append(json.loads(found.stdout.splitlines()[-1]))
            print(rows[-1], file=sys.stderr, flush=True)
    save("splats", {"scene": SCENE, "display": options.display, "memory": options.memory, "rows": rows})


def _make(count: int, path: Path) -> None:
    from splats_from_scene import scan, write_ply

    splats = scan(SCENE, count, degree=1, floaters=0.03, views=3)
    harmonics = np.zeros((count, 16, 3), np.float32)
    harmonics[:, :4] = splats.harmonics
    harmonics[:, 4:] = 0.02 * np.random.default_rng(0).normal(size=(count, 12, 3))
    splats = type(splats)(splats.centers, splats.scales, splats.rotations, splats.opacities, harmonics)
    write_ply(splats, path)


def _render(path: Path, display: str, memory: int) -> dict[str, Any]:
    import lippmann
    from lippmann.device.splats.table import make_table

    # Kernels are compiled once and kept: a small picture before the clock runs.
    small = lippmann.load_scene(path)
    few = small.description.splats.select(np.arange(0, small.description.splats.count, 50))
    lippmann.render(type(small.description)("few", splats=few), "seed-lenticular")
    start = time.process_time()
    scene = lippmann.load_scene(path)
    loaded = time.process_time()
    table = make_table(scene.description.splats, memory)
    built = time.process_time()
    image = lippmann.render(scene, display, memory=memory)
    end = time.process_time()
    height, width = image.pixels.shape[:2]
    return {
        "splats": scene.description.splats.count,
        "nodes": len(table.bvh.size),
        "file_bytes": path.stat().st_size,
        "pixels": [width, height],
        "rays": image.provenance.rays["primary"],
        "load_seconds": loaded - start,
        "build_seconds": built - loaded,
        "render_seconds": end - built,
        "peak_bytes": 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
    }


if __name__ == "__main__":
    main()
