"""A file of real size of each kind that no other script measures: how long it takes to read and to show, and memory.

Time on two cores: about 10 minutes.

- a molecule of 99 999 atoms (``.pdb``);
- a USD stage of 600 instances of six meshes of 20 000 triangles each, with materials (``.usdc``, and packed as
  ``.usdz``);
- a surface of a million triangles with a field in colours (``.vtp``);
- a photograph of 12 megapixels with a depth map of a quarter of its sides (``.jpg`` and ``.png``).

Each is read and rendered by a process of its own, whose kernels were compiled before: the picture that the shortest
command makes for the display, reading included. Files are made by the script, from formulas.

python benchmarks/formats.py [--only usd] [--display seed-lenticular]
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from harness import save, saved


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="files with this in their names")
    parser.add_argument("--display", default="seed-lenticular")
    parser.add_argument("--inside", nargs=2, help=argparse.SUPPRESS)
    parser.add_argument("--pictures", type=Path, help="a folder to keep the pictures in, to look at")
    options = parser.parse_args()
    if options.inside:
        print(json.dumps(measure(Path(options.inside[0]), options.display, Path(options.inside[1]))))
        return
    rows: dict[str, Any] = saved("formats").get("rows", {})
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        pictures = options.pictures or folder
        for file, make in FILES.items():
            if options.only not in file:
                continue
            path = folder / file
            make(path)
            command = [sys.executable, __file__, "--display", options.display]
            command += ["--inside", str(path), str(pictures / f"{file}.png")]
            # Once to compile the kernels, which a first picture of its kind takes; once to measure.
            for _ in range(2):
                done = subprocess.run(command, check=True, capture_output=True, text=True)
            rows[file] = {"bytes": path.stat().st_size} | json.loads(done.stdout.splitlines()[-1])
            print(file, rows[file], file=sys.stderr, flush=True)
    save("formats", {"display": options.display, "rows": {file: rows[file] for file in FILES if file in rows}})


def measure(path: Path, display: str, picture: Path) -> dict[str, Any]:
    import lippmann

    began, processor = time.perf_counter(), time.process_time()
    depth = path.with_name(f"{path.stem}-depth.png")
    scene = lippmann.load_scene(path, depth_map=depth if depth.exists() else None)
    read = time.perf_counter() - began
    image = lippmann.render(scene, display)
    seconds = time.perf_counter() - began
    processor = time.process_time() - processor
    image.save(picture)
    places = scene.description.placements
    return {
        "read_s": round(read, 2),
        "seconds": round(seconds, 1),
        "processor_s": round(processor, 1),
        "peak_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        "instances": sum(len(each) for each in places.values()),
        "triangles": sum(len(scene.description.meshes[mesh].faces) * len(each) for mesh, each in places.items()),
    }


# ---- Files ----------------------------------------------------------------------------------------------------------


def molecule(path: Path) -> None:
    """Atoms of five elements in a ball of chains: a bond's length apart along them, farther across; shaken."""
    rng = np.random.default_rng(3)
    side = np.arange(-32, 33)
    lattice = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    nearest = np.argsort(np.linalg.norm(lattice, axis=1), kind="stable")[:99_999]
    places = (1.5, 2.4, 2.4) * lattice[nearest] + rng.normal(0, 0.1, (len(nearest), 3))
    elements = rng.choice(["C", "N", "O", "S", "H"], len(places), p=[0.5, 0.12, 0.15, 0.03, 0.2])
    lines = [
        f"HETATM{number + 1:5d} {element:<3s}  LIG A{number // 40 % 9999 + 1:4d}    "
        f"{x:8.3f}{y:8.3f}{z:8.3f}  1.00  0.00          {element:>2s}"
        for number, (element, (x, y, z)) in enumerate(zip(elements, places, strict=True))
    ]
    path.write_text("\n".join([*lines, "END", ""]))


def stage(path: Path) -> None:
    """Turned pieces on a board of 20 by 30 fields, six kinds, instances of one prototype each."""
    from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

    made = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(made, UsdGeom.Tokens.y)
    UsdGeom.Xform.Define(made, "/board")
    made.SetDefaultPrim(made.GetPrimAtPath("/board"))
    for kind in range(6):
        color = tuple(float(0.15 + 0.7 * ((kind * step) % 5) / 4) for step in (1, 2, 3))
        material = UsdShade.Material.Define(made, f"/board/looks/look{kind}")
        shader = UsdShade.Shader.Define(made, f"/board/looks/look{kind}/surface")
        shader.CreateIdAttr("UsdPreviewSurface")
        shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*color))
        shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(0.1 + 0.15 * kind)
        material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        prototype = made.CreateClassPrim(f"/piece{kind}")
        mesh = UsdGeom.Mesh.Define(made, f"/piece{kind}/mesh")
        points, faces = _turned(kind)
        mesh.CreatePointsAttr(points.astype(np.float32))
        mesh.CreateFaceVertexCountsAttr(np.full(len(faces), 4, np.int32))
        mesh.CreateFaceVertexIndicesAttr(faces.ravel().astype(np.int32))
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
        for number in range(kind, 600, 6):
            piece = UsdGeom.Xform.Define(made, f"/board/piece{number}")
            piece.GetPrim().GetReferences().AddInternalReference(prototype.GetPath())
            piece.GetPrim().SetInstanceable(True)
            piece.AddTranslateOp().Set(Gf.Vec3d(number % 20, 0, number // 20))
    made.GetRootLayer().Save()


def _turned(kind: int) -> tuple[np.ndarray, np.ndarray]:
    """A profile turned about y: points ``(n, 3)``, and quads ``(10 000, 4)``, which are 20 000 triangles."""
    rows, sides = 101, 100
    height = np.linspace(0, 1, rows)
    radius = 0.12 + 0.28 * (1 - height) ** 2 + 0.06 * np.sin((4 + 3 * kind) * height) ** 2
    radius[-1] = 0.0
    angle = np.arange(sides) * (2 * np.pi / sides)
    points = np.stack(
        [
            np.outer(radius, np.cos(angle)),
            np.repeat(height[:, None] * (1 + 0.2 * kind), sides, axis=1),
            np.outer(radius, np.sin(angle)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    row, side = np.meshgrid(np.arange(rows - 1), np.arange(sides), indexing="ij")
    here, ahead = row * sides + side, row * sides + (side + 1) % sides
    return points, np.stack([here, here + sides, ahead + sides, ahead], axis=-1).reshape(-1, 4)


def package(path: Path) -> None:
    """The same stage as one file."""
    from pxr import UsdUtils

    loose = path.with_name("loose.usdc")
    stage(loose)
    UsdUtils.CreateNewUsdzPackage(str(loose), str(path))


def surface(path: Path) -> None:
    """A sphere with waves, a million triangles, coloured by height."""
    import pyvista

    sphere = pyvista.Sphere(theta_resolution=1000, phi_resolution=502)
    points = np.asarray(sphere.points)
    waves = np.sin(12 * points[:, 0] / 0.5) * np.sin(10 * points[:, 1] / 0.5) * np.sin(9 * points[:, 2] / 0.5)
    sphere.points = points * (1 + 0.1 * waves[:, None])
    sphere.point_data["height"] = waves.astype(np.float32)
    sphere.set_active_scalars("height")
    sphere.save(path)


def photograph(path: Path) -> None:
    """4000 x 3000 pixels of balls before a striped wall, and its depth."""
    from PIL import Image

    height, width = 3000, 4000
    y, x = np.mgrid[0:height, 0:width].astype(np.float32) / width
    depth = np.full((height, width), 3.0, np.float32)
    color = np.stack([0.5 + 0.3 * np.sin(60 * x), 0.5 + 0.3 * np.sin(60 * y), 0.6 + 0 * x], axis=-1)
    rng = np.random.default_rng(2)
    for _ in range(24):
        cx, cy, radius, away = rng.uniform(0, 1), rng.uniform(0, 0.75), rng.uniform(0.03, 0.1), rng.uniform(1, 2.5)
        within = radius**2 - (x - cx) ** 2 - (y - cy) ** 2
        bulge = np.sqrt(np.maximum(within, 0))
        seen = (within > 0) & (away - bulge < depth)
        depth[seen] = (away - bulge)[seen]
        color[seen] = (rng.uniform(0.2, 0.9, 3) * (0.3 + 0.7 * bulge[..., None] / radius))[seen]
    Image.fromarray((255 * color.clip(0, 1)).astype(np.uint8)).save(path, quality=92)
    millimeters = (1000 * depth[::4, ::4]).astype(np.uint16)
    Image.fromarray(millimeters).save(path.with_name(f"{path.stem}-depth.png"))


FILES: dict[str, Callable[[Path], None]] = {
    "molecule.pdb": molecule,
    "stage.usdc": stage,
    "stage.usdz": package,
    "surface.vtp": surface,
    "photograph.jpg": photograph,
}


if __name__ == "__main__":
    main()
