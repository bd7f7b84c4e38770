"""The light buffer of Haines and Greenberg (1986): which shapes may stand between a light source and a point.

All shadow rays of a source meet in it. Seen from there, the shapes are sorted into the cells of a grid once, those of
a cell by their distance from the source. A shadow ray then looks at the shapes of one cell, from the source up to its
own start, instead of walking through the hierarchy of all.

A source outside the shapes has one grid that fits them, one among them has six, the faces of a cube. A directional
source has a grid of parallel lines. Shapes are sorted in by rectangles around them, never too small, so that nothing is
missed; whether a ray does cross a shape is tested as ever.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.device.whitted.shape_table import Column, Kind, ShapeTable
from lippmann.scene.values.whitted_shapes import Numbers
from lippmann.scene.values.whitted_surfaces import ClassicLight

#: Cells along a side of a grid that are tried, the finest first.
SIDES = (256, 128, 64, 32, 16)
#: Cells and entries of all grids together that the finest affordable side may have: 16 MB each.
MOST_CELLS, MOST_ENTRIES = 1 << 22, 1 << 21
#: Limit on the number of grids; a scene that needs more has none.
MOST_GRIDS = 64
#: Entries that a ray's cell may have on the average: with more, walking is as fast.
MOST_IN_CELL = 48
#: A source that sees all shapes within a cone of this half angle has one grid.
_NARROW = np.radians(60)
#: Room around a shape for rounding: relative to the coordinates, and in cells.
_MARGIN, _CELL_MARGIN = 2e-6, 0.05
#: Slope beyond which a shape lies beside or behind a grid.
_STEEP = 1e6

Whole = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class LightBuffer:
    """Grids of ``side x side`` cells, and what lies in them.

    A point p lies in column u = (U p + u0) / (W p + w0) and row v = (V p + v0) / (W p + w0) of a grid, both from 0 to
    ``side``, if W p + w0 > 0. Its depth is D p + d0 for directional sources, else its distance from the source.

    Attributes
    ----------
    side:
        Cells along a side.
    grids:
        ``(grids, 4, 4)`` float32: (U, u0), (V, v0), (W, w0), (D, d0).
    of_light:
        ``(lights, 2)`` uint32: first grid, and how many there are. Six are +x, -x, +y, -y, +z, -z, by the direction
        from the source to the point.
    directional:
        ``(lights,)`` bool.
    starts:
        ``(grids * side**2 + 1,)`` uint32: first entry of each cell, rows one after the other.
    entries:
        ``(n, 2)`` uint32: the smallest depth of a shape (the bits of a float32), and its row in the shape table.
    """

    side: int
    grids: NDArray[np.float32]
    of_light: NDArray[np.uint32]
    directional: NDArray[np.bool_]
    starts: NDArray[np.uint32]
    entries: NDArray[np.uint32]


@dataclass(frozen=True, eq=False)
class _View:
    """The shapes as a grid sees them: rectangles ``(n, 2, 2)`` (low and high, u and v) and smallest depths ``(n,)``.

    ``matrix (4, 4)`` leads to u, v, w and depth before the rectangle ``frame (2, 2)`` of all is known.
    """

    matrix: Numbers
    frame: Numbers
    rectangles: Numbers
    near: Numbers


def make_light_buffer(table: ShapeTable, lights: Sequence[ClassicLight]) -> LightBuffer | None:
    """The buffer of all ``lights`` over the walked shapes of ``table``.

    None where it would be of no use: without lights or walked shapes, with very many lights, and where many shapes
    overlap in every cell.
    """
    if not table.walked or not lights:
        return None
    shapes = _Shapes.of_table(table)
    views: list[_View] = []
    of_light = []
    for light in lights:
        light_views = _views(light, shapes)
        of_light.append((len(views), len(light_views)))
        views += light_views
        if len(views) > MOST_GRIDS:
            return None
    side = _affordable_side(views)
    if side is None:
        return None
    starts, entries = _sort_in(views, side, table.walked_rows.start)
    filled = np.diff(starts).astype(np.float64)
    # By entries, not by cells: where shapes are, there are the rays.
    if len(entries) and np.square(filled).sum() > MOST_IN_CELL * filled.sum():
        return None
    grids = np.stack([_scale(view, side) for view in views]).astype(np.float32)
    directional = np.array([light.kind == "directional" for light in lights])
    return LightBuffer(side, grids, np.array(of_light, np.uint32), directional, starts, entries)


@dataclass(frozen=True, eq=False)
class _Shapes:
    """Spheres and boxes around shapes, both: neither serves all of them best."""

    centers: Numbers
    radii: Numbers
    low: Numbers
    high: Numbers
    corners: Numbers  # (n, 8, 3)

    @staticmethod
    def of_table(table: ShapeTable) -> _Shapes:
        rows = table.rows[table.walked_rows.start : table.walked_rows.stop].astype(np.float64)
        room = _MARGIN * np.abs(table.boxes).max()
        low, high = table.boxes[:, 0] - room, table.boxes[:, 1] + room
        is_sphere = rows[:, Column.KIND] == Kind.SPHERE
        radii = np.linalg.norm(high - low, axis=1) / 2
        radii[is_sphere] = np.sqrt(rows[is_sphere, Column.K0]) + room
        sides = np.stack([low, high], axis=1)
        corners = np.stack(
            [sides[:, [x, y, z], [0, 1, 2]] for x in range(2) for y in range(2) for z in range(2)], axis=1
        )
        return _Shapes((low + high) / 2, radii, low, high, corners)


def _views(light: ClassicLight, shapes: _Shapes) -> list[_View]:
    if light.kind == "directional":
        return [_parallel_view(np.asarray(light.direction, np.float64), shapes)]
    source = np.asarray(light.center, np.float64)
    axis = shapes.corners.reshape(-1, 3).mean(axis=0) - source
    offset = shapes.centers - source
    distance = np.linalg.norm(offset, axis=1)
    length = np.linalg.norm(axis)
    if length > 0 and (distance > shapes.radii).all():
        # Angle of the farthest side of each shape off the axis.
        off = np.arccos(np.clip(offset @ axis / (distance * length), -1, 1)) + np.arcsin(shapes.radii / distance)
        if off.max() < _NARROW:
            return [_central_view(source, _frame(axis / length), shapes, np.inf)]
    faces = [_frame(sign * np.eye(3)[direction]) for direction in range(3) for sign in (1.0, -1.0)]
    return [_central_view(source, frame, shapes, 1.0) for frame in faces]


def _frame(forward: Numbers) -> Numbers:
    """Three unit vectors ``(3, 3)`` at right angles, ``forward`` the last."""
    helper = np.eye(3)[np.argmin(np.abs(forward))]
    right = np.cross(helper, forward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def _parallel_view(direction: Numbers, shapes: _Shapes) -> _View:
    frame = _frame(direction)
    middle = shapes.centers @ frame.T
    corners = shapes.corners @ frame.T
    low = np.maximum(middle[:, :2] - shapes.radii[:, None], corners[:, :, :2].min(axis=1))
    high = np.minimum(middle[:, :2] + shapes.radii[:, None], corners[:, :, :2].max(axis=1))
    near = np.maximum(middle[:, 2] - shapes.radii, corners[:, :, 2].min(axis=1))
    matrix = np.zeros((4, 4))
    matrix[:2, :3], matrix[2, 3], matrix[3, :3] = frame[:2], 1.0, direction
    rectangles = np.stack([low, high], axis=1)
    return _View(matrix, _around(rectangles), rectangles, near)


def _central_view(source: Numbers, frame: Numbers, shapes: _Shapes, most: float) -> _View:
    """``most``: greatest slope of the grid's sides."""
    middle = (shapes.centers - source) @ frame.T
    corners = (shapes.corners - source) @ frame.T
    by_corners = _corner_slopes(corners)
    rectangles = np.empty((len(middle), 2, 2))
    for side in range(2):
        low, high = _sphere_slopes(middle[:, side], middle[:, 2], shapes.radii)
        rectangles[:, 0, side] = np.maximum(low, by_corners[:, 0, side])
        rectangles[:, 1, side] = np.minimum(high, by_corners[:, 1, side])
    to_box = np.maximum(np.maximum(shapes.low - source, source - shapes.high), 0.0)
    near = np.maximum(np.linalg.norm(middle, axis=1) - shapes.radii, np.linalg.norm(to_box, axis=1))
    matrix = np.zeros((4, 4))
    matrix[:3, :3], matrix[:3, 3] = frame, -frame @ source
    frame_of_all = np.clip(_around(rectangles), -most, most)
    empty = (frame_of_all[1] <= frame_of_all[0]).any()
    return _View(matrix, np.array([[-1.0] * 2, [1.0] * 2]) if empty else frame_of_all, rectangles, near)


def _sphere_slopes(x: Numbers, z: Numbers, radius: Numbers) -> tuple[Numbers, Numbers]:
    """Least and greatest x / z of spheres, in front of the source."""
    distance = np.hypot(x, z)
    inside = distance <= radius
    half = np.arcsin(np.where(inside, 0.0, radius / np.maximum(distance, 1e-300)))
    angle = np.arctan2(x, z)
    right = np.pi / 2
    low = np.where(inside, -right, np.clip(angle - half, -right, right))
    high = np.where(inside, right, np.clip(angle + half, -right, right))
    return np.clip(np.tan(low), -_STEEP, _STEEP), np.clip(np.tan(high), -_STEEP, _STEEP)


def _corner_slopes(corners: Numbers) -> Numbers:
    """Slopes ``(n, 2, 2)`` of boxes; without bounds where a box is not wholly in front of the source."""
    depth = corners[:, :, 2]
    front = depth.min(axis=1) > 0
    slopes = corners[:, :, :2] / np.where(front[:, None], depth, 1.0)[:, :, None]
    bounds: Numbers = np.stack([slopes.min(axis=1), slopes.max(axis=1)], axis=1)
    bounds[~front] = np.array([-_STEEP, _STEEP])[:, None]
    return bounds


def _around(rectangles: Numbers) -> Numbers:
    frame: Numbers = np.stack([rectangles[:, 0].min(axis=0), rectangles[:, 1].max(axis=0)])
    room = 1e-6 * np.maximum(np.abs(frame).max(axis=0), frame[1] - frame[0]) + 1e-30
    frame += np.stack([-room, room])
    return frame


def _cells(view: _View, side: int) -> tuple[Whole, Whole, NDArray[np.bool_]]:
    """Lowest and highest cells ``(n, 2)`` of the shapes of a view, and which lie in it at all."""
    cell = (view.frame[1] - view.frame[0]) / side
    low = (view.rectangles[:, 0] - view.frame[0]) / cell - _CELL_MARGIN
    high = (view.rectangles[:, 1] - view.frame[0]) / cell + _CELL_MARGIN
    there = ((high > 0) & (low < side) & (low <= high)).all(axis=1)
    first, last = (np.clip(np.floor(part), 0, side - 1).astype(np.int64) for part in (low, high))
    return first, last, there


def _affordable_side(views: Sequence[_View]) -> int | None:
    for side in SIDES:
        if len(views) * side**2 > MOST_CELLS:
            continue
        entries = 0
        for view in views:
            first, last, there = _cells(view, side)
            entries += int((last - first + 1)[there].prod(axis=1).sum())
        if entries <= MOST_ENTRIES:
            return side
    return None


def _sort_in(views: Sequence[_View], side: int, first_row: int) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Starts of all cells, and entries."""
    cells, shapes, nears = [], [], []
    for number, view in enumerate(views):
        first, last, there = _cells(view, side)
        # By depth, which sorting by cells then keeps.
        order = np.argsort(view.near, kind="stable")
        order = order[there[order]]
        size = (last - first + 1)[order]
        count = size.prod(axis=1)
        shape = np.repeat(order, count)
        inside = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        width = np.repeat(size[:, 0], count)
        row, column = inside // width, inside % width
        cells.append((number * side + first[shape, 1] + row) * side + first[shape, 0] + column)
        shapes.append(shape)
        nears.append(view.near[shape])
    cell, shape, near = (np.concatenate(part) for part in (cells, shapes, nears))
    order = np.argsort(cell, kind="stable")
    counts = np.bincount(cell, minlength=len(views) * side**2)
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.uint32)
    # Never beyond the true depth.
    depths = np.nextafter(near[order].astype(np.float32), np.float32(-np.inf))
    return starts, np.column_stack([depths.view(np.uint32), (shape[order] + first_row).astype(np.uint32)])


def _scale(view: _View, side: int) -> Numbers:
    """The matrix of a view with u and v in cells."""
    matrix = view.matrix.copy()
    low, high = view.frame
    for row in range(2):
        scale = side / (high[row] - low[row])
        matrix[row] = scale * (view.matrix[row] - low[row] * view.matrix[2])
    return matrix
