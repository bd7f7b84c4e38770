"""Many copies of a USD point instancer: whole commands, their time and peak memory.

Time on two cores: about two minutes.

python benchmarks/copies.py [--spheres 200000] [--trees 2000]

200 000 spheres, and 2 000 copies of a tree of 5 000 triangles, each rendered once with the defaults for a display of
512 x 512 pixels (``results/copies.json``).

Targets: 60 s each; 1 GB for the spheres, 3 GB for the trees.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from harness import save
from huge_commands import LIPPMANN, run

SPHERES_GB, TREES_GB, SECONDS = 1.0, 3.0, 60.0
TRIANGLES = 5_000
HEAD = '#usda 1.0\n(\n    upAxis = "Y"\n    metersPerUnit = 1\n)\n'


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--spheres", type=int, default=200_000)
    parser.add_argument("--trees", type=int, default=2_000)
    options = parser.parse_args()
    cases = {
        "spheres": (options.spheres, _sphere(), SPHERES_GB),
        "trees": (options.trees, _tree(np.random.default_rng(1)), TREES_GB),
    }
    results = {}
    with tempfile.TemporaryDirectory() as name:
        for case, (copies, prototype, gigabytes) in cases.items():
            stage = Path(name) / f"{case}.usda"
            stage.write_text(HEAD + _instancer(copies, prototype))
            picture = str(stage.with_suffix(".png"))
            found = run([*LIPPMANN, "render", str(stage), "--display", "seed-lenticular", "-o", picture, "--quiet"])
            results[case] = {"copies": copies, **found, "target_seconds": SECONDS, "target_gigabytes": gigabytes}
            print(case, results[case], file=sys.stderr)
    save("copies", results)


def _instancer(copies: int, prototype: str) -> str:
    """A flat forest: copies on a square grid, two units apart."""
    side = int(np.ceil(np.sqrt(copies)))
    places = np.arange(copies)
    x, z = 2.0 * (places % side), 2.0 * (places // side)
    positions = np.stack([x, np.sin(x) * np.sin(z), z], axis=1)
    return (
        f'def PointInstancer "many"\n{{\n    int[] protoIndices = [{", ".join("0" * copies)}]\n'
        f"    point3f[] positions = [{_tuples(positions)}]\n    rel prototypes = </many/one>\n{prototype}}}\n"
    )


def _sphere() -> str:
    return (
        '    def Sphere "one"\n    {\n        double radius = 0.8\n'
        "        color3f[] primvars:displayColor = [(0.8, 0.3, 0.1)]\n    }\n"
    )


def _tree(rng: np.random.Generator) -> str:
    """Leaves, each a triangle, about a ball."""
    centers = rng.normal(size=(TRIANGLES, 1, 3))
    centers /= np.linalg.norm(centers, axis=2, keepdims=True)
    corners = (0.8 * centers + 0.1 * rng.normal(size=(TRIANGLES, 3, 3))).reshape(-1, 3)
    counts = ", ".join("3" * TRIANGLES)
    indices = ", ".join(str(number) for number in range(3 * TRIANGLES))
    return (
        f'    def Mesh "one"\n    {{\n        point3f[] points = [{_tuples(corners)}]\n'
        f"        int[] faceVertexCounts = [{counts}]\n        int[] faceVertexIndices = [{indices}]\n"
        '        uniform token subdivisionScheme = "none"\n'
        "        color3f[] primvars:displayColor = [(0.2, 0.5, 0.1)]\n    }\n"
    )


def _tuples(rows: NDArray[np.float64]) -> str:
    return ", ".join(f"({x:.4g}, {y:.4g}, {z:.4g})" for x, y, z in rows.tolist())


if __name__ == "__main__":
    main()
