"""Tessellation of the exact shapes of classic scenes, in the file's own coordinates.

The more shapes of a kind a scene has, the coarser each one is, so that the number of triangles stays within a budget.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.parsing.round_meshes import join_rings, repeat_triangles, subdivide_sphere
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_shapes import Batch, Numbers, Spheres, Tubes
from lippmann.scene.values.whitted_surfaces import ClassicTexture

Indices = NDArray[np.int64]
#: Positions, faces and normals.
Arrays = tuple[Numbers, Indices, "Numbers | None"]

#: Triangles that all spheres together, and all tubes together, may have.
_BUDGET = 1_500_000
_FINEST_SPHERE = 5  # subdivisions of an icosahedron: 20 480 triangles
_SIDES = (12, 128)
#: Endless shapes reach this many diagonals of the scene to each side.
_REACH = 20.0


@dataclass(frozen=True, eq=False)
class Patch:
    """Triangles of one material and one ``kind`` of shape.

    ``positions (n, 3)``, ``faces (m, 3)`` counter-clockwise in a right-handed reading of the coordinates, ``normals``
    ``(n, 3)`` or None for flat, ``uvs (n, 2)`` and ``colors (n, 3)`` (display codes) or None.
    """

    kind: str
    material: int
    positions: Numbers
    faces: Indices
    normals: Numbers | None = None
    uvs: Numbers | None = None
    colors: Numbers | None = None


def patches(scene: ClassicScene, bounds: Numbers) -> Iterator[Patch]:
    """All shapes of a scene; ``bounds (2, 3)`` tell how far endless ones reach."""
    reach = _REACH * max(float(np.linalg.norm(bounds[1] - bounds[0])), 1e-3)
    middle = bounds.mean(axis=0)
    makers: tuple[tuple[Batch, Callable[[Indices], Arrays]], ...] = (
        (scene.spheres, lambda rows: _spheres(scene, rows)),
        (scene.tubes, lambda rows: _tubes(scene.tubes, rows, _sides(len(scene.tubes)))),
        (scene.cylinders, lambda rows: _cylinders(scene, rows, middle, reach)),
        (scene.rings, lambda rows: _rings(scene, rows)),
        (scene.boxes, lambda rows: _boxes(scene, rows)),
        (scene.planes, lambda rows: _planes(scene, rows, middle, reach)),
        (scene.triangles, lambda rows: _triangles(scene, rows)),
    )
    for batch, make in makers:
        for material, group, colored in _groups(batch):
            rows = _rows(batch, material, group, colored)
            positions, faces, normals = make(rows)
            faces = _clip(positions, faces, scene.clip_groups[group] if group >= 0 else None)
            if not len(faces):
                continue
            texture = scene.materials[material].texture
            colors = scene.triangles.colors[rows].reshape(-1, 3) if colored else None
            kind = "colored triangle" if colored else batch.kind
            yield Patch(kind, material, positions, faces, normals, _uvs(texture, positions), colors)


def _groups(batch: Batch) -> list[tuple[int, int, bool]]:
    """Materials, clip groups and whether corners bring colours, as they occur."""
    colored = getattr(batch, "colored", np.zeros(len(batch), bool))
    keys = zip(batch.material.tolist(), batch.clip_group.tolist(), colored.tolist(), strict=True)
    return list(dict.fromkeys(keys))


def _rows(batch: Batch, material: int, group: int, colored: bool) -> Indices:
    mask = (batch.material == material) & (batch.clip_group == group)
    if hasattr(batch, "colored"):
        mask &= batch.colored == colored
    return np.flatnonzero(mask)


def _clip(positions: Numbers, faces: Indices, planes: Numbers | None) -> Indices:
    """Faces whose centroid the clip planes keep."""
    if planes is None:
        return faces
    centers = positions[faces].mean(axis=1)
    inside: Indices = faces[(centers @ planes[:, :3].T <= planes[:, 3]).all(axis=1)]
    return inside


def _uvs(texture: ClassicTexture, positions: Numbers) -> Numbers | None:
    """Coordinates of a planar picture; other textures are no function of a surface's own coordinates."""
    if texture.kind != "planar-image":
        return None
    q = positions - np.array(texture.center)
    u = q @ np.array(texture.u_axis) * texture.scale[0] + texture.rotate[0]
    v = q @ np.array(texture.v_axis) * texture.scale[1] + texture.rotate[1]
    return np.stack([u, v], axis=-1)


def _merge_copies(positions: Numbers, faces: Indices) -> tuple[Numbers, Indices]:
    """One mesh of ``n`` copies ``(n, k, 3)`` of a shape with the same faces."""
    count, corners = positions.shape[:2]
    return positions.reshape(-1, 3), repeat_triangles(faces, count, corners)


def _spheres(scene: ClassicScene, rows: Indices) -> Arrays:
    batch: Spheres = scene.spheres
    level = next((n for n in range(_FINEST_SPHERE, 0, -1) if len(batch) * 20 * 4**n <= _BUDGET), 1)
    points, faces = icosphere(level)
    copies = batch.centers[rows, None] + points * batch.radii[rows, None, None]
    positions, all_faces = _merge_copies(copies, faces)
    return positions, all_faces, np.tile(points, (len(rows), 1))


def icosphere(level: int) -> tuple[Numbers, Indices]:
    """Points on the unit sphere and faces: an icosahedron, each face cut into four ``level`` times."""
    golden = (1.0 + 5.0**0.5) / 2.0
    corners = [p for a, b in product((-1.0, 1.0), (-golden, golden)) for p in ((0.0, a, b), (a, b, 0.0), (b, 0.0, a))]
    points = np.array(corners)
    distance = np.linalg.norm(points[:, None] - points[None], axis=-1)
    near = (distance > 0) & (distance < 2.1)
    faces = np.array(
        [
            f
            for f in product(range(12), repeat=3)
            if f[0] < f[1] < f[2] and near[f[0], f[1]] and near[f[1], f[2]] and near[f[0], f[2]]
        ]
    )
    outward = (
        np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
        * points[faces[:, 0]]
    ).sum(axis=1)
    faces[outward < 0] = faces[outward < 0][:, ::-1]
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return subdivide_sphere(points, faces, level)


def _sides(count: int) -> int:
    return int(np.clip(_BUDGET // max(2 * count, 1), *_SIDES))


def _frame(axes: Numbers) -> tuple[Numbers, Numbers]:
    """Two unit vectors across each unit axis, right-handed with it."""
    helper = np.where(np.abs(axes[:, :1]) < 0.9, np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]]))
    u = np.cross(helper, axes)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return u, np.cross(axes, u)


def _circle(axes: Numbers, sides: int) -> Numbers:
    """Unit vectors ``(n, sides, 3)`` around each axis."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    u, v = _frame(axes)
    return u[:, None] * np.cos(angle)[:, None] + v[:, None] * np.sin(angle)[:, None]


def _tubes(batch: Tubes, rows: Indices, sides: int) -> Arrays:
    base, apex = batch.base[rows], batch.apex[rows]
    low, high = batch.base_radius[rows], batch.apex_radius[rows]
    axes = apex - base
    length = np.linalg.norm(axes, axis=1)
    axes = axes / length[:, None]
    around = _circle(axes, sides)
    rings = [base[:, None] + around * low[:, None, None], apex[:, None] + around * high[:, None, None]]
    positions, faces = _merge_copies(np.concatenate(rings, axis=1), join_rings(sides))
    slope = ((high - low) / length)[:, None, None]
    normal = around - axes[:, None] * slope
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return positions, faces, np.concatenate([normal, normal], axis=1).reshape(-1, 3)


def _cylinders(scene: ClassicScene, rows: Indices, middle: Numbers, reach: float) -> Arrays:
    batch = scene.cylinders
    along = ((middle - batch.centers[rows]) * batch.axes[rows]).sum(axis=1, keepdims=True)
    near = batch.centers[rows] + batch.axes[rows] * along
    tubes = Tubes(
        base=near - batch.axes[rows] * reach,
        apex=near + batch.axes[rows] * reach,
        base_radius=batch.radii[rows],
        apex_radius=batch.radii[rows],
        inside_only=np.zeros(len(rows), bool),
        material=batch.material[rows],
        clip_group=batch.clip_group[rows],
    )
    return _tubes(tubes, np.arange(len(rows)), _SIDES[1])


def _rings(scene: ClassicScene, rows: Indices) -> Arrays:
    batch = scene.rings
    sides = _sides(len(batch))
    around = _circle(batch.normals[rows], sides)
    center = batch.centers[rows, None]
    circles = [center + around * radius[rows, None, None] for radius in (batch.outer, batch.inner)]
    positions, faces = _merge_copies(np.concatenate(circles, axis=1), join_rings(sides))
    return positions, faces, None


def _planes(scene: ClassicScene, rows: Indices, middle: Numbers, reach: float) -> Arrays:
    batch = scene.planes
    u, v = _frame(batch.normals[rows])
    height = ((middle - batch.centers[rows]) * batch.normals[rows]).sum(axis=1, keepdims=True)
    foot = middle - batch.normals[rows] * height
    corners = [foot + (a * u + b * v) * reach for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    positions, faces = _merge_copies(np.stack(corners, axis=1), np.array([(0, 1, 2), (0, 2, 3)]))
    return positions, faces, None


def _boxes(scene: ClassicScene, rows: Indices) -> Arrays:
    points = scene.boxes.corners()[rows]
    sides = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    # Corners are not shared, so that a face keeps its own pictures.
    corners = points[:, [corner for side in sides for corner in side]]
    faces = np.concatenate([np.array([(0, 1, 2), (0, 2, 3)]) + 4 * n for n in range(6)])
    positions, all_faces = _merge_copies(corners, faces)
    return positions, all_faces, None


def _triangles(scene: ClassicScene, rows: Indices) -> Arrays:
    batch = scene.triangles
    positions = batch.positions[rows].reshape(-1, 3)
    faces = np.arange(len(positions)).reshape(-1, 3)
    return positions, faces, batch.normals[rows].reshape(-1, 3)
