"""Blender files: how long Blender takes to export a scene of many instances, and Lippmann to read it.

Time on two cores: an estimated 2 minutes.

LIPPMANN_BLENDER=/path/to/blender python benchmarks/blender.py
python benchmarks/blender.py --counts 60 600 --runs 5

The scene is ``examples/blender_scene.py``: a subdivided head, a glass ball, and so many pearls that share one mesh.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

from harness import save, summary
from lippmann.scene.readers.blend.find_blender import find_blender
from lippmann.scene.readers.blend.reader import complete, export_file, read_world
from lippmann.scene.readers.gltf import read_gltf

SCENE = Path(__file__).parent.parent / "examples" / "blender_scene.py"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--counts", type=int, nargs="+", default=[60, 600])
    parser.add_argument("--runs", type=int, default=5)
    options = parser.parse_args()
    blender = find_blender("the benchmark")
    if blender is None:
        parser.error("a program of Blender's is needed: name it by LIPPMANN_BLENDER")
    told = subprocess.run([blender, "--version"], check=True, capture_output=True, text=True).stdout
    version = re.search(r"Blender ([0-9.]+)", told)
    assert version is not None
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for count in options.counts:
            path = Path(folder) / f"{count}.blend"
            command = [blender, "--background", "--factory-startup", "--disable-autoexec", "--python-exit-code", "1"]
            words = ["--python", str(SCENE), "--", str(path), str(count)]
            subprocess.run([*command, *words], check=True, stdout=subprocess.DEVNULL)
            rows.append(_measure(path, options.runs))
            print(rows[-1])
    save("blender", {"blender": version[1], "runs": options.runs, "rows": rows})


def _measure(path: Path, runs: int) -> dict[str, Any]:
    exports, reads = [], []
    for _ in range(runs + 1):
        begin = time.perf_counter()
        with export_file(path, None) as files:
            middle = time.perf_counter()
            description = complete(read_gltf(files.scene), files, path.stem, read_world(files))
            size = files.scene.stat().st_size
            end = time.perf_counter()
        exports.append(middle - begin)
        reads.append(end - middle)
    return {
        "instances": sum(len(places) for places in description.placements.values()),
        "meshes": len(description.meshes),
        "triangles": sum(
            len(description.meshes[mesh].faces) * len(places) for mesh, places in description.placements.items()
        ),
        "blend_bytes": path.stat().st_size,
        "glb_bytes": size,
        "export_seconds": summary(exports[1:]),
        "read_seconds": summary(reads[1:]),
    }


if __name__ == "__main__":
    main()
