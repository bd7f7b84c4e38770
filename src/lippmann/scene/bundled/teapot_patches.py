"""Newell's teapot: 32 bicubic Bezier patches, and their tessellation into smooth triangles.

Martin Newell, "The Utilization of Procedure Models in Digital Image Synthesis", PhD thesis, University of Utah, 1975;
Blinn's flattened proportions, and the bottom that was added later, as in F. Crow, "The Origins of the Teapot", IEEE
Computer Graphics and Applications 7(1), 1987. The 306 published control points repeat themselves by symmetry, so only
what differs is written down: the profiles of body and lid (surfaces of revolution) and one half of each cross-section
of handle and spout.

Newell's z points up; the tessellation is turned to +y up, spout along +x, base on y = 0. Lengths are Newell's units:
the teapot is about 6.4 long, 4 across the body, 3.15 high.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import UsageError

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
