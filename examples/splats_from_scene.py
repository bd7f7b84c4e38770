"""Makes Gaussian splats of a bundled scene, written as trainers do, for want of a scan that is free to share.

python examples/splats_from_scene.py tree scan.ply --count 200000

Splats lie flat on the surfaces, as many on each as its area asks for. What they show is path-traced light, from twelve
directions above the surface, to which spherical harmonics are fitted. ``--floaters`` makes a share of them faint and
puts them far off.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import lippmann
from lippmann.color.transfer import encode_srgb
from lippmann.rendering.request.plan import resolve
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import open_session
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.values.splats import Splats, real_harmonics

Numbers = NDArray[np.float64]

#: Directions in which each splat is looked at, on a Fibonacci lattice about its normal, and rays in each.
_VIEWS, _SAMPLES = 12, 2
#: Standard deviations of splats, over the distance between them: along the surface, and across it.
_ALONG, _ACROSS = 0.8, 0.08
_POINTS_AT_A_TIME = 1 << 18


def sample_surfaces(description: SceneDescription, count: int, random: np.random.Generator) -> tuple[Numbers, Numbers]:
    """``count`` points on all surfaces, even by area, and their unit normals: ``(count, 3)`` each."""
    corners = []
    for mesh, places in description.placements.items():
        own = description.meshes[mesh]
        for place in places:
            world = own.positions @ place[:3, :3].T + place[:3, 3]
            corners.append(world[own.faces])
    triangles = np.concatenate(corners).astype(np.float64)
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(across, axis=1)
    chosen = random.choice(len(triangles), count, p=areas / areas.sum())
    u, v = random.uniform(size=(2, count, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = triangles[chosen].transpose(1, 0, 2)
    return a + u * (b - a) + v * (c - a), across[chosen] / areas[chosen, None]


def seen_colors(name: str, points: Numbers, directions: Numbers, reach: float, seed: int) -> Numbers:
    """sRGB codes ``(n, 3)`` of what eyes in ``directions`` (n, 3) from the points see of them."""
    scene = lippmann.load_scene(name)
    request = resolve(
        RenderRequest(integrator="path", method="full", denoise="none", spp=_SAMPLES), scene, form="preview"
    )
    session = open_session(scene, request, (64, 64))
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.sobol import SampleStream
    from lippmann.rendering.transport.ray_source import CameraRays

    source = CameraRays(scene.camera(), 64, 64)
    integrator = session.integrator(source, np.eye(4))
    colors = np.empty((len(points), 3))
    for start in range(0, len(points), _POINTS_AT_A_TIME):
        own = slice(start, start + _POINTS_AT_A_TIME)
        origin = (points[own] + reach * directions[own]).astype(np.float32)
        lanes = np.repeat(np.arange(len(origin)), _SAMPLES)
        ray = mi.Ray3f(mi.Point3f(origin[lanes].T), mi.Vector3f(-directions[own].astype(np.float32)[lanes].T))
        number, sample = mi.UInt32((lanes + start).astype(np.uint32)), mi.UInt32(np.arange(len(lanes)) % _SAMPLES)
        stream = SampleStream.of_pixels(number, sample, mi.UInt32(seed))
        radiance, _ = integrator.sample(ray, stream, mi.Bool(True))
        dr.eval(radiance)
        linear = np.array(radiance).T.reshape(-1, _SAMPLES, 3).mean(axis=1)
        colors[own] = encode_srgb(np.nan_to_num(linear))
    return colors


def fitted_harmonics(
    name: str, points: Numbers, frames: Numbers, lattice: Numbers, degree: int, reach: float, seed: int
) -> Numbers:
    """Coefficients ``(n, k, 3)`` fitted to what is seen of points from directions of ``lattice`` in their frames."""
    size = (degree + 1) ** 2
    left, right = np.zeros((len(points), size, size)), np.zeros((len(points), size, 3))
    for view, direction in enumerate(lattice):
        toward = frames @ direction
        codes = seen_colors(name, points, toward, reach, seed + view)
        # Harmonics are of the direction in which rays travel.
        basis = np.stack(real_harmonics(*(-toward).T), axis=1)[:, :size]
        left += basis[:, :, None] * basis[:, None, :]
        right += basis[:, :, None] * (codes - 0.5)[:, None, :]
    damping = np.diag([1e-6] + [0.3] * (size - 1))
    return np.asarray(np.linalg.solve(left + damping, right), np.float64)


def scan(
    name: str,
    count: int,
    degree: int = 2,
    floaters: float = 0.0,
    *,
    views: int = _VIEWS,
    seed: int = 0,
) -> Splats:
    """Splats of a bundled scene in its own coordinates, +y up, each looked at in so many directions."""
    random = np.random.default_rng(seed)
    description = lippmann.load_scene(name).physical
    assert isinstance(description, SceneDescription)
    points, normals = sample_surfaces(description, count, random)
    camera = np.asarray(description.cameras[0].world_from_camera)[:3, 3]
    normals *= np.where(((camera - points) * normals).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    frames = _frames(normals, random)
    number = np.arange(views)
    height = 0.25 + 0.75 * (number + 0.5) / views
    turn = number * np.pi * (3 - np.sqrt(5))
    lattice = np.stack([np.sqrt(1 - height**2) * np.cos(turn), np.sqrt(1 - height**2) * np.sin(turn), height], axis=1)
    harmonics = fitted_harmonics(name, points, frames, lattice, degree, 2e-3 * diagonal, seed)
    spacing = _spacing(points)
    scales = np.stack([_ALONG * spacing, _ALONG * spacing, _ACROSS * spacing], axis=1)
    opacities = random.uniform(0.75, 0.98, count)
    adrift = random.uniform(size=count) < floaters
    points[adrift] = points.mean(axis=0) + diagonal * random.normal(size=(int(adrift.sum()), 3))
    scales[adrift] = 0.02 * diagonal
    opacities[adrift] = random.uniform(0.02, 0.15, int(adrift.sum()))
    return Splats(
        points.astype(np.float32),
        scales.astype(np.float32),
        Rotation.from_matrix(frames).as_quat().astype(np.float32),
        opacities.astype(np.float32),
        harmonics.astype(np.float32),
    )


def _frames(normals: Numbers, random: np.random.Generator) -> Numbers:
    """Rotations ``(n, 3, 3)`` whose last column is the normal, turned about it at random."""
    first = np.cross(normals, random.normal(size=normals.shape))
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first), normals], axis=2)


def _spacing(points: Numbers) -> Numbers:
    """Distance ``(n,)`` from each point to the fourth nearest other one."""
    distances, _ = cKDTree(points).query(points, 5)
    return np.asarray(distances[:, 4], np.float64)


def write_ply(splats: Splats, path: Path) -> None:
    """Write splats as trainers do, whose y points down."""
    from lippmann.scene.splat_clouds import move

    splats = move(splats, np.diag([1.0, -1.0, -1.0, 1.0]))
    rest = splats.harmonics[:, 1:].transpose(0, 2, 1).reshape(splats.count, -1)
    logits = np.log(splats.opacities / (1 - splats.opacities))
    columns = {name: splats.centers[:, place] for place, name in enumerate("xyz")}
    columns |= {f"f_dc_{color}": splats.harmonics[:, 0, color] for color in range(3)}
    columns |= {f"f_rest_{place}": rest[:, place] for place in range(rest.shape[1])}
    columns |= {"opacity": logits}
    columns |= {f"scale_{axis}": np.log(splats.scales[:, axis]) for axis in range(3)}
    columns |= {f"rot_{place}": splats.rotations[:, (place + 3) % 4] for place in range(4)}
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {splats.count}"]
    lines += [f"property float {name}" for name in columns]
    table = np.column_stack(list(columns.values())).astype("<f4")
    path.write_bytes("\n".join([*lines, "end_header", ""]).encode() + table.tobytes())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", help="a bundled scene's name")
    parser.add_argument("output", type=Path)
    parser.add_argument("--count", type=int, default=200_000)
    parser.add_argument("--degree", type=int, default=2)
    parser.add_argument("--floaters", type=float, default=0.0)
    options = parser.parse_args()
    write_ply(scan(options.scene, options.count, options.degree, options.floaters), options.output)


if __name__ == "__main__":
    main()
