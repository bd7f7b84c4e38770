"""The compiled kernel of refocusing for micro-lens arrays. It is imported late: loading Numba takes half a second.

Neighbouring points of a row meet the same lens, some tens of times in a row: a lens holds one run of a row at most,
because its cell is convex. The end of a run is calculated. Only where it falls on a point, up to rounding, is the lens
of that point looked up as :class:`~lippmann.display.lens_array.Lattice` does.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.image.stored_values import FloatArray
from lippmann.runtime.numba_jit import inlined, uncounted

Real = NDArray[np.float64]

#: Indices of the numbers of a lattice: :attr:`Lattice.pitch`, ``row_pitch``, ``origin_x``, ``origin_y`` and
#: ``tolerance``, then the magnification of the display.
PITCH, ROW_PITCH, ORIGIN_X, ORIGIN_Y, TOLERANCE, MAGNIFICATION = range(6)

#: Distance from a boundary, in lens pitches, within which lenses are looked up: far above rounding errors.
_MARGIN = 1e-6
#: Points per lens below which every lens is looked up: so short runs save nothing.
_SHORTEST_RUN = 3.0


@inlined
def _nearest(distance: float, pitch: float, tolerance: float) -> float:
    return math.floor(distance / pitch + (0.5 + tolerance))


@inlined
def _in_row(x: float, y: float, j: float, lattice: Real) -> tuple[float, float]:
    """Nearest lens of row ``j`` of a hexagonal array, and the squared distance of its centre."""
    shift = (0.5 * lattice[PITCH]) * (j - 2.0 * math.floor(0.5 * j))
    i = _nearest(x - lattice[ORIGIN_X] - shift, lattice[PITCH], lattice[TOLERANCE])
    right = lattice[ORIGIN_X] + i * lattice[PITCH] + shift - x
    up = lattice[ORIGIN_Y] - j * lattice[ROW_PITCH] - y
    return i, right * right + up * up


@inlined
def _lens_at(x: float, y: float, is_hexagonal: bool, lattice: Real) -> tuple[float, float]:
    """:meth:`lippmann.display.lens_array.Lattice.lens_at`, in the same operations in the same order."""
    down = lattice[ORIGIN_Y] - y
    if not is_hexagonal:
        j = _nearest(down, lattice[ROW_PITCH], lattice[TOLERANCE])
        return _nearest(x - lattice[ORIGIN_X], lattice[PITCH], lattice[TOLERANCE]), j
    upper = math.floor(down / lattice[ROW_PITCH])
    lower = upper + 1.0
    upper_i, upper_distance = _in_row(x, y, upper, lattice)
    lower_i, lower_distance = _in_row(x, y, lower, lattice)
    excess = lower_distance - upper_distance
    if excess <= 2.0 * lattice[TOLERANCE] * lattice[PITCH] * lattice[PITCH]:
        return lower_i, lower
    return upper_i, upper


@inlined
def _right_edge(i: float, j: float, y: float, is_hexagonal: bool, lattice: Real) -> tuple[float, float, float, bool]:
    """The x at which a lens ends at the height ``y``, the lens that follows, and whether that lens is certain.

    The edge lies midway between the centres of the lens and of its right neighbour in its own row or in the row on
    the side of ``y``, whichever comes first.
    """
    pitch, row_pitch = lattice[PITCH], lattice[ROW_PITCH]
    center, reach = lattice[ORIGIN_X] + i * pitch, 0.5 * pitch
    if not is_hexagonal:
        return center + reach, i + 1.0, j, True
    is_odd = j - 2.0 * math.floor(0.5 * j)
    center += (0.5 * pitch) * is_odd
    up = lattice[ORIGIN_Y] - j * row_pitch - y  # negative: the point lies above the centre
    to_next_row = (0.25 * pitch * pitch + row_pitch * row_pitch - 2.0 * abs(up) * row_pitch) / pitch
    is_certain = abs(to_next_row - reach) > _MARGIN * pitch
    if to_next_row < reach:
        return center + to_next_row, i + is_odd, (j - 1.0 if up < 0.0 else j + 1.0), is_certain
    return center + reach, i + 1.0, j, is_certain


@uncounted
def add_views(
    first: int,
    last: int,
    views: FloatArray,
    masks: NDArray[np.bool_],
    eyes: Real,
    x: Real,
    y: Real,
    z: float,
    is_hexagonal: bool,
    lattice: Real,
    total: FloatArray,
    steps: NDArray[np.int32],
) -> None:
    """Add what all views show of the plane at ``z`` to rows ``first`` to before ``last``.

    ``views`` is ``(views, lens_rows, lens_cols, 3)`` and ``masks`` ``(views, lens_rows, lens_cols)``; ``eyes`` is
    ``(views, 3)``, mm. ``x`` ``(width,)`` and ``y`` ``(height,)`` are the points of the plane, mm. ``total``
    ``(height, width, 3)`` is added to, and so is ``steps`` ``(height, width + 1)``: the number of views that show a
    point, less that of the point on its left.
    """
    width, scale = x.shape[0], lattice[MAGNIFICATION]
    k, pitch = 1.0 / scale, lattice[PITCH]
    for line in range(first, last):
        for view in range(views.shape[0]):
            stretch = z / (eyes[view, 2] - z)
            eye_x = eyes[view, 0]
            lens_y = (y[line] + (y[line] - eyes[view, 1]) * stretch) * scale * k
            left = (x[0] + (x[0] - eye_x) * stretch) * scale * k
            step = (x[width - 1] - x[0]) / max(width - 1, 1) * (1.0 + stretch)
            has_runs = step > 0.0 and step * _SHORTEST_RUN < pitch
            margin = _MARGIN * pitch / step if has_runs else 0.0
            start = 0
            i, j = _lens_at(left, lens_y, is_hexagonal, lattice)
            while start < width:
                stop, next_i, next_j, is_certain = start + 1, i, j, False
                if has_runs:
                    edge, next_i, next_j, is_certain = _right_edge(i, j, lens_y, is_hexagonal, lattice)
                    # In points from the first; a run ends before the next whole number.
                    end = min(max((edge - left) / step, start - 1.0), width + 1.0)
                    nearest = math.floor(end + 0.5)
                    stop = min(max(math.ceil(end), start), width)
                    if abs(end - nearest) <= margin and start <= nearest < width:
                        point = nearest
                        lens_x = (x[point] + (x[point] - eye_x) * stretch) * scale * k
                        at_i, at_j = _lens_at(lens_x, lens_y, is_hexagonal, lattice)
                        stop = point + 1 if at_i == i and at_j == j else point
                        is_certain = False
                if not is_certain and stop < width:
                    lens_x = (x[stop] + (x[stop] - eye_x) * stretch) * scale * k
                    next_i, next_j = _lens_at(lens_x, lens_y, is_hexagonal, lattice)
                    if stop == start and next_i == i and next_j == j:
                        stop += 1  # the lens is looked up again there
                # Lenses far beyond the array exceed all integers.
                if 0 <= j < views.shape[1] and 0 <= i < views.shape[2] and masks[view, int(j), int(i)]:
                    row, column = int(j), int(i)
                    red, green = views[view, row, column, 0], views[view, row, column, 1]
                    blue = views[view, row, column, 2]
                    for at in range(start, stop):
                        total[line, at, 0] += red
                        total[line, at, 1] += green
                        total[line, at, 2] += blue
                    steps[line, start] += 1
                    steps[line, stop] -= 1
                start, i, j = stop, next_i, next_j
