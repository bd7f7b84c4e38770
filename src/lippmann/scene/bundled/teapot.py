"""The teapot: Newell's patches on a half-mirroring checkerboard, the scene that everyone has seen before.

Two lights fall on the same geometry: :func:`describe` gives glazed porcelain in a studio for physically based light,
:mod:`.copper_teapot` the classic metal pot under two lights. Millimetres of the paper's display, +y up, the floor at
y = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import UsageError
from lippmann.scene.bundled.stage import Stage
from lippmann.scene.values.description import (
    Environment,
    FloatArray,
    Instance,
    Material,
    Matrix,
    Mesh,
    SceneDescription,
)

Array = NDArray[np.float64]

PARTS = ("body", "lid", "handle", "spout")

# (radius, height) from the inside of the rim over the belly to the middle of the bottom: rim, upper and lower body, and
# bottom share their end points.
_BODY_PROFILE = (
    (1.4, 2.4),
    (1.3375, 2.53125),
    (1.4375, 2.53125),
    (1.5, 2.4),
    (1.75, 1.875),
    (2.0, 1.35),
    (2.0, 0.9),
    (2.0, 0.45),
    (1.5, 0.225),
    (1.5, 0.15),
    (1.5, 0.075),
    (1.425, 0.0),
    (0.0, 0.0),
)
_LID_PROFILE = ((0.0, 3.15), (0.8, 3.15), (0.0, 2.85), (0.2, 2.7), (0.4, 2.55), (1.3, 2.55), (1.3, 2.4))

# Newell's quarter circles take 0.56 of the radius for the inner control points (the best value is 0.5523); the widest
# ring of the knob alone takes 0.5625.
_QUARTER_CIRCLE = 0.56
_KNOB_QUARTER_CIRCLE = 0.5625

# Cross-sections of the tubes, from the body outwards: (x, z) on the inner and on the outer side of the bend, and the
# half-width in y.
_HANDLE_SECTIONS = (
    ((-1.6, 2.025), (-1.5, 2.25), 0.3),
    ((-2.3, 2.025), (-2.5, 2.25), 0.3),
    ((-2.7, 2.025), (-3.0, 2.25), 0.3),
    ((-2.7, 1.8), (-3.0, 1.8), 0.3),
    ((-2.7, 1.575), (-3.0, 1.35), 0.3),
    ((-2.5, 1.125), (-2.65, 0.9375), 0.3),
    ((-2.0, 0.9), (-1.9, 0.6), 0.3),
)
_SPOUT_SECTIONS = (
    ((1.7, 1.425), (1.7, 0.6), 0.66),
    ((2.6, 1.425), (3.1, 0.825), 0.66),
    ((2.3, 2.1), (2.4, 2.025), 0.25),
    ((2.7, 2.4), (3.3, 2.4), 0.25),
    ((2.8, 2.475), (3.525, 2.49375), 0.25),
    ((2.9, 2.475), (3.45, 2.5125), 0.15),
    ((2.8, 2.4), (3.2, 2.4), 0.15),
)


@dataclass(frozen=True, eq=False)
class SmoothTriangles:
    """A triangle mesh with a unit normal per vertex.

    ``positions`` and ``normals`` are ``(n, 3)`` float64, ``faces`` ``(m, 3)`` uint32, counter-clockwise seen from
    outside. Vertices along the seams of patches are shared, not doubled.
    """

    positions: Array
    normals: Array
    faces: NDArray[np.uint32]


def patches() -> Array:
    """Return the control points of all patches, ``(32, 4, 4, 3)``, in Newell's own frame (z up)."""
    nets = [_control_net(part) for part in PARTS]
    cut = [
        net[row : row + 4][:, np.arange(column, column + 4) % net.shape[1]]
        for net in nets
        for row in range(0, net.shape[0] - 1, 3)
        for column in range(0, net.shape[1], 3)
    ]
    return np.stack(cut)


def tessellate(subdivisions: int, parts: Sequence[str] = PARTS) -> SmoothTriangles:
    """Split each patch into ``subdivisions`` x ``subdivisions`` cells of two triangles, with the patches' own normals.

    Neighbouring patches of a part share the vertices of their seam; patches that shrink to a point (the knob's top, the
    middle of the bottom) end in one vertex and a fan. Parts stay open where Newell left them open: rim, lid, and the
    ends of handle and spout.

    Raises
    ------
    UsageError
        ``subdivisions`` below 1, or a part not in :data:`PARTS`.
    """
    if subdivisions < 1:
        raise UsageError(f"{subdivisions} subdivisions per patch", rule="at least 1 is needed")
    meshes = [_tessellate_part(part, subdivisions) for part in parts]
    starts = np.cumsum([0] + [len(mesh.positions) for mesh in meshes])
    return SmoothTriangles(
        positions=_y_up(np.concatenate([mesh.positions for mesh in meshes])),
        normals=_y_up(np.concatenate([mesh.normals for mesh in meshes])),
        faces=np.concatenate([mesh.faces + np.uint32(start) for mesh, start in zip(meshes, starts, strict=False)]),
    )


def _y_up(vectors: Array) -> Array:
    return vectors[:, [0, 2, 1]] * (1.0, 1.0, -1.0)


def _control_net(part: str) -> Array:
    """Control points of one part, ``(3 rows + 1, 3 columns, 3)``; columns close upon themselves.

    Rows run along the profile or tube, columns around it, such that (along the rows) x (along the columns) points out.
    """
    if part == "body":
        return _revolve(_BODY_PROFILE, [_QUARTER_CIRCLE] * len(_BODY_PROFILE))
    if part == "lid":
        quarter_circles = [_QUARTER_CIRCLE] * len(_LID_PROFILE)
        quarter_circles[1] = _KNOB_QUARTER_CIRCLE
        return _revolve(_LID_PROFILE, quarter_circles)
    if part == "handle":
        return _tube(_HANDLE_SECTIONS)
    if part == "spout":
        return _tube(_SPOUT_SECTIONS)
    raise UsageError.unknown("part of the teapot", part, PARTS)


def _revolve(profile: Sequence[tuple[float, float]], quarter_circles: Sequence[float]) -> Array:
    rows = []
    for (radius, height), k in zip(profile, quarter_circles, strict=True):
        circle = [
            (1, 0),
            (1, k),
            (k, 1),
            (0, 1),
            (-k, 1),
            (-1, k),
            (-1, 0),
            (-1, -k),
            (-k, -1),
            (0, -1),
            (k, -1),
            (1, -k),
        ]
        rows.append([(radius * x, radius * y, height) for x, y in circle])
    return np.array(rows, dtype=np.float64)


def _tube(sections: Sequence[tuple[tuple[float, float], tuple[float, float], float]]) -> Array:
    rows = []
    for (inner_x, inner_z), (outer_x, outer_z), half_width in sections:
        ring = [(inner_x, w, inner_z) for w in (0.0, half_width)] + [(outer_x, w, outer_z) for w in (half_width, 0.0)]
        ring += [(outer_x, -half_width, outer_z), (inner_x, -half_width, inner_z)]
        rows.append(ring)
    return np.array(rows, dtype=np.float64)


def _tessellate_part(part: str, n: int) -> SmoothTriangles:
    net = _control_net(part)
    along, along_slope = _bernstein_rows((net.shape[0] - 1) // 3, n)
    around, around_slope = (_close(weights) for weights in _bernstein_rows(net.shape[1] // 3, n))

    def surface(row_weights: Array, column_weights: Array) -> Array:
        points: Array = np.einsum("ri,cj,ijk->rck", row_weights, column_weights, net, optimize=True)
        return points

    positions = surface(along, around)
    row_tangents = surface(along_slope, around)
    normals = np.cross(row_tangents, surface(along, around_slope))
    pole_first, pole_last = (bool(np.all(net[end] == net[end, 0])) for end in (0, -1))
    # At a pole the tangent around vanishes; the tangents along the rows fan out over the tangent plane instead.
    if pole_first:
        normals[0] = _fan_normal(row_tangents[0])
    if pole_last:
        normals[-1] = -_fan_normal(row_tangents[-1])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)

    rows, columns = positions.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    if pole_first:
        index[0] = index[0, 0]
    if pole_last:
        index[-1] = index[-1, 0]
    here, right = index, np.roll(index, -1, axis=1)
    quads = np.stack([here[:-1], here[1:], right[1:], right[:-1]], axis=-1).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    collapsed = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    used, faces = np.unique(faces[~collapsed], return_inverse=True)
    return SmoothTriangles(
        positions.reshape(-1, 3)[used], normals.reshape(-1, 3)[used], faces.reshape(-1, 3).astype(np.uint32)
    )


def _fan_normal(tangents: Array) -> Array:
    total: Array = np.cross(tangents, np.roll(tangents, -1, axis=0)).sum(axis=0)
    return total


def _bernstein_rows(spans: int, n: int) -> tuple[Array, Array]:
    """Weights of the control points of ``spans`` joined cubics at ``spans n + 1`` even parameters, and their slopes.

    Both are ``(spans n + 1, 3 spans + 1)``. The weights on a joint are exactly (..., 0, 1, 0, ...).
    """
    samples = np.arange(spans * n + 1)
    span = np.minimum(samples // n, spans - 1)
    t = (samples - span * n) / n
    s = 1.0 - t
    weights = np.stack([s**3, 3 * s * s * t, 3 * s * t * t, t**3], axis=1)
    slopes = np.stack([-3 * s * s, 3 * s * s - 6 * s * t, 6 * s * t - 3 * t * t, 3 * t * t], axis=1)
    columns = 3 * span[:, None] + np.arange(4)
    dense = np.zeros((2, len(samples), 3 * spans + 1))
    np.put_along_axis(dense[0], columns, weights, axis=1)
    np.put_along_axis(dense[1], columns, slopes, axis=1)
    return dense[0], dense[1]


def _close(weights: Array) -> Array:
    """Join the last control point and the last parameter of an open curve to its first."""
    closed = weights[:-1, :-1].copy()
    closed[:, 0] += weights[:-1, -1]
    return closed


NAME = "teapot"


@dataclass(frozen=True)
class Layout:
    """Sizes and places, in mm and degrees.

    ``unit`` is the length of Newell's unit, ``turn`` swings the spout from +x toward the viewer. The floor is
    ``columns`` x ``rows`` tiles of ``tile`` mm, its middle moved by ``floor_shift`` toward the viewer; the tile at the
    far left is light.
    """

    unit: float = 16.0
    subdivisions: int = 16
    turn: float = 25.0
    tile: float = 12.0
    columns: int = 10
    rows: int = 6
    floor_shift: float = 10.0


LAYOUT = Layout()
STAGE = Stage(target=(2.0, 24.0, 22.1), elevation=29.0)


def pot_from_newell() -> Matrix:
    """Carries the tessellation of :mod:`~lippmann.scene.bundled.teapot` into the scene."""
    turn = np.radians(LAYOUT.turn)
    matrix = np.diag([LAYOUT.unit, LAYOUT.unit, LAYOUT.unit, 1.0])
    matrix[:3, :3] @= [[np.cos(turn), 0, -np.sin(turn)], [0, 1, 0], [np.sin(turn), 0, np.cos(turn)]]
    return matrix


def tiles(*, light: bool) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Return the floor's light or dark tiles as triangles facing up: positions ``(4 t, 3)``, faces ``(2 t, 3)``."""
    row, column = np.divmod(np.arange(LAYOUT.rows * LAYOUT.columns), LAYOUT.columns)
    mask = (row + column) % 2 == (0 if light else 1)
    corner = np.stack([column - LAYOUT.columns / 2, np.zeros(len(row)), row - LAYOUT.rows / 2], axis=1)[mask]
    around = np.array([(0, 0, 0), (0, 0, 1), (1, 0, 1), (1, 0, 0)])
    positions = (corner[:, None, :] + around) * LAYOUT.tile + (0.0, 0.0, LAYOUT.floor_shift)
    faces = 4 * np.arange(len(corner))[:, None, None] + np.array([(0, 1, 2), (0, 2, 3)])
    return positions.reshape(-1, 3), faces.reshape(-1, 3).astype(np.uint32)


def describe() -> SceneDescription:
    """Return the physically based teapot: glazed porcelain and polished tiles in a studio."""
    pot = tessellate(LAYOUT.subdivisions)
    light_tiles, dark_tiles = tiles(light=True), tiles(light=False)
    meshes = [
        Mesh(
            "teapot",
            pot.positions.astype(np.float32),
            pot.faces,
            material=0,
            normals=pot.normals.astype(np.float32),
        ),
        Mesh("light tiles", light_tiles[0].astype(np.float32), light_tiles[1], material=1),
        Mesh("dark tiles", dark_tiles[0].astype(np.float32), dark_tiles[1], material=2),
    ]
    materials = [
        Material(
            "porcelain",
            base_color=(0.30, 0.52, 0.42),
            roughness=0.15,
            double_sided=True,
        ),
        Material("light tiles", base_color=(0.86, 0.84, 0.78), metallic=0.6, roughness=0.12),
        Material("dark tiles", base_color=(0.05, 0.05, 0.06), metallic=0.6, roughness=0.12),
    ]
    return SceneDescription(
        NAME,
        meshes=meshes,
        materials=materials,
        instances=[Instance(0, pot_from_newell()), Instance(1, np.eye(4)), Instance(2, np.eye(4))],
        cameras=[STAGE.camera()],
        environment=Environment(_studio(), name="studio"),
        background=(0.10, 0.13, 0.17),
    )


def _studio() -> FloatArray:
    """Paint a studio: a grey shell, brighter above, with two soft boxes and a strip whose reflections model the glaze.

    Equirectangular ``(256, 512, 3)`` radiance, row 0 up, the middle column toward -z.
    """
    height = 256
    elevation = np.pi / 2 - (np.arange(height) + 0.5) * np.pi / height
    azimuth = (np.arange(2 * height) + 0.5) * np.pi / height - np.pi
    up = np.sin(elevation)[:, None, None]
    shell = 0.10 + 0.30 * np.clip(0.5 + 0.5 * up, 0, 1) ** 2
    pixels = shell * np.ones((1, 2 * height, 1)) * np.array([0.86, 0.95, 1.1])

    def soft_box(
        center: tuple[float, float], half_size: tuple[float, float], radiance: tuple[float, float, float]
    ) -> None:
        # Edges fade over two degrees, so that their reflections do not look cut out.
        across = np.abs((azimuth - np.radians(center[0]) + np.pi) % (2 * np.pi) - np.pi)
        along = np.abs(elevation - np.radians(center[1]))
        fade = [
            np.clip((np.radians(half) - distance) / np.radians(2.0) + 0.5, 0, 1)
            for half, distance in zip(half_size, (across, along), strict=True)
        ]
        pixels[...] += (fade[1][:, None] * fade[0][None, :])[..., None] * np.array(radiance)

    soft_box((-130.0, 45.0), (38.0, 26.0), (4.6, 4.3, 3.8))
    soft_box((75.0, 30.0), (8.0, 24.0), (3.0, 3.4, 4.2))
    soft_box((0.0, 62.0), (60.0, 10.0), (2.0, 2.1, 2.3))
    radiance: FloatArray = pixels.astype(np.float32)
    return radiance
