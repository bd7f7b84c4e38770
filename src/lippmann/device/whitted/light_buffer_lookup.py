"""Looking up a light buffer on the device: the shapes that may stand between a source and a point."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from lippmann.device.kernel_ops import upload
from lippmann.device.types import Float, Point3f, UInt32, Vector3f, Vector4f
from lippmann.device.whitted.light_buffer import LightBuffer


class LightBufferLookup:
    """A :class:`~lippmann.device.whitted.light_buffer.LightBuffer` on the device."""

    # Not a dataclass: Dr.Jit would take it for loop state and write its fields.
    def __init__(self, buffer: LightBuffer) -> None:
        self._side = buffer.side
        self._grids = upload(buffer.grids)
        self._of_light = upload(buffer.of_light)
        self._has_cubes = bool((buffer.of_light[:, 1] > 1).any())
        self._has_directional = bool(buffer.directional.any())
        self._directional = mi.Bool(buffer.directional)
        self._starts = upload(buffer.starts)
        self._entries = upload(buffer.entries)

    def find(self, light: UInt32, o: Point3f, d: Vector3f, t: Float) -> tuple[UInt32, UInt32, Float]:
        """First entry and end of the cell that the ray from ``o`` to a source lies in, and the depth of ``o``.

        ``d`` and ``t`` are the direction and the distance from ``o`` to the source. Entries up to that depth count.
        """
        grid = dr.gather(mi.UInt32, self._of_light, light * 2)
        if self._has_cubes:
            is_cube = dr.gather(mi.UInt32, self._of_light, light * 2 + 1) > 1
            grid += dr.select(is_cube, _face(-d), 0)
        u, v, w = (_affine(self._row(grid, number), o) for number in range(3))
        column, row = u / w, v / w
        there = (w > 0) & (column >= 0) & (column < self._side) & (row >= 0) & (row < self._side)
        cell = (grid * self._side + mi.UInt32(row)) * self._side + mi.UInt32(column)
        start = dr.gather(mi.UInt32, self._starts, cell, there)
        end = dr.gather(mi.UInt32, self._starts, cell + 1, there)
        if not self._has_directional:
            return start, end, t
        directional = dr.gather(mi.Bool, self._directional, light)
        return start, end, dr.select(directional, _affine(self._row(grid, 3), o), t)

    def entry(self, place: UInt32) -> tuple[Float, UInt32]:
        """Least depth and row in the shape table of an entry."""
        depth, row = dr.gather(mi.ArrayXu, self._entries, place, shape=(2, dr.width(place)))
        return dr.reinterpret_array(mi.Float, depth), row

    def _row(self, grid: UInt32, number: int) -> Vector4f:
        return dr.gather(mi.Vector4f, self._grids, grid * 4 + number)


def _affine(row: Vector4f, p: Point3f) -> Float:
    return dr.fma(row.x, p.x, dr.fma(row.y, p.y, dr.fma(row.z, p.z, row.w)))


def _face(v: Vector3f) -> UInt32:
    """Number of the face of a cube that a direction leaves it by: +x, -x, +y, -y, +z, -z."""
    size = dr.abs(v)
    along_x = (size.x >= size.y) & (size.x >= size.z)
    along_y = ~along_x & (size.y >= size.z)
    part = dr.select(along_x, v.x, dr.select(along_y, v.y, v.z))
    axis = dr.select(along_x, mi.UInt32(0), dr.select(along_y, mi.UInt32(2), mi.UInt32(4)))
    return axis + dr.select(part < 0, mi.UInt32(1), mi.UInt32(0))
