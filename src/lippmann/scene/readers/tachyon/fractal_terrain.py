"""The fractal landscape of Tachyon's SCAPE: a height field by midpoint displacement, the same on every machine.

The procedure (order of the recursion, the generator, its seed and all constants) is that of Tachyon 0.99's
``rt_landscape``, so that a file gives the same hills here and there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lippmann.scene.values.whitted_shapes import Numbers

_MULTIPLIER = 1099087573  # Fishman's multiplier of the congruential generator x' = a x mod 2^32
_MODULUS = 1 << 32


@dataclass(frozen=True, eq=False)
class Landscape:
    """Smooth triangles: ``vertices`` and unit ``normals`` ``(m n, 3)``, ``faces (2 (m - 1) (n - 1), 3)``."""

    vertices: Numbers
    normals: Numbers
    faces: np.ndarray[tuple[int, ...], np.dtype[np.int64]]


def landscape(columns: int, rows: int, width: float, depth: float, center: tuple[float, float, float]) -> Landscape:
    """A landscape over a rectangle of the x-z plane, y up.

    Parameters
    ----------
    columns, rows:
        Samples along x and z, 2 or more each.
    width, depth:
        Extent along x and z; it also scales the hills.
    center:
        Middle of the rectangle, at height 0 of the field.
    """
    heights = _heights(columns, rows, width, depth)
    step_x, step_z = width / (columns - 1), depth / (rows - 1)
    x = np.arange(columns) * step_x + (center[0] - width / 2.0)
    z = np.arange(rows) * step_z + (center[2] - depth / 2.0)
    vertices = np.empty((rows, columns, 3))
    vertices[..., 0], vertices[..., 1], vertices[..., 2] = x, heights + center[1], z[:, None]

    normals = np.zeros((rows, columns, 3))
    normals[..., 1] = 1.0  # along the rim the field counts as level
    inner = (slice(1, -1), slice(1, -1))
    with np.errstate(divide="ignore", invalid="ignore"):  # a field of no width has no slope that counts
        normals[(*inner, 0)] = -(heights[1:-1, 2:] - heights[1:-1, :-2]) / (2.0 * step_x)
        normals[(*inner, 2)] = -(heights[2:, 1:-1] - heights[:-2, 1:-1]) / (2.0 * step_z)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)

    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    across = corner + columns + 1
    faces = np.stack(
        [np.stack([corner, across, corner + 1], axis=-1), np.stack([corner, corner + columns, across], axis=-1)], axis=1
    )
    return Landscape(vertices.reshape(-1, 3), normals.reshape(-1, 3), faces.reshape(-1, 3))


def _heights(columns: int, rows: int, width: float, depth: float) -> Numbers:
    """Heights ``(rows, columns)``."""
    field = [0.0] * (columns * rows)
    state = columns * rows
    highest = float(columns + rows)
    roughness = math.sqrt(width * width + depth * depth) / 16.0

    def draw() -> float:
        nonlocal state
        state = state * _MULTIPLIER % _MODULUS
        return state / _MODULUS

    def displace(a: int, b: int, middle: int, spread: float) -> None:
        if field[middle] == 0.0:
            height = (field[a] + field[b]) / 2.0 + (draw() - 0.5) * spread / 4.0 * roughness
            field[middle] = min(max(height, 0.0), highest)

    def subdivide(left: int, top: int, right: int, bottom: int) -> None:
        if right - left < 2 and bottom - top < 2:
            return
        x, z = (left + right) // 2, (top + bottom) // 2
        upper, lower, row = columns * top, columns * bottom, columns * z
        across = (right - left) / columns * width
        along = (bottom - top) / rows * depth
        displace(upper + left, upper + right, upper + x, across)
        displace(upper + right, lower + right, row + right, along)
        displace(lower + left, lower + right, lower + x, across)
        displace(upper + left, lower + left, row + left, along)
        if field[row + x] == 0.0:
            corners = field[upper + left] + field[upper + right] + field[lower + right] + field[lower + left]
            field[row + x] = corners / 4.0
        subdivide(left, top, x, z)
        subdivide(x, top, right, z)
        subdivide(x, z, right, bottom)
        subdivide(left, z, x, bottom)

    for corner in (0, columns - 1, columns * (rows - 1), columns * rows - 1):
        field[corner] = draw()
    subdivide(0, 0, columns - 1, rows - 1)
    return np.array(field).reshape(rows, columns)
