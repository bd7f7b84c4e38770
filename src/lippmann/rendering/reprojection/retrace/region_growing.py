"""The search for what reprojection has falsified, from the edges outward. Compiled.

Every pixel beside an edge is traced. Where one turns out other than it was taken for, a *surprise*, there is more to be
found: all pixels around it are traced next, a few in the wider surroundings, and those under the neighbouring lenses
where its point should be seen; and so on until there are no surprises left. Smooth outlines, which reprojection got
right, end the search at once; a small thing that one pixel has given away is followed to its end.

It works for every lens layout: it only needs to know which lens a pixel belongs to.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.reprojection.common.array_types import BoolArray, IntArray, RealArray
from lippmann.rendering.reprojection.common.epipolar_rows import Rows
from lippmann.rendering.reprojection.common.point_image import BACKGROUND, TRACED, PointImage
from lippmann.rendering.reprojection.common.thresholds import coded_value, color_difference, nearer
from lippmann.runtime.numba_jit import compiled, uncounted

#: A traced pixel that differs from what it was taken for by more than this share of the tolerance is a surprise.
SURPRISE = 0.7
#: Pixels around a surprise that are all traced: columns and rows to either side.
NEAR_COLUMNS, NEAR_ROWS = 3, 3
#: A pixel of a neighbouring lens is looked at if what it shows lies farther away by this part.
_BEHIND = 0.05


@uncounted
def mark_edges(
    first_row: int, last_row: int, points: PointImage, lens: IntArray, tolerance: float, coded: bool, wanted: BoolArray
) -> None:
    """Set ``wanted (H, W)`` for untraced pixels that differ from a neighbour under the same lens.

    ``lens (H, W)`` is the number of each pixel's lens. Pixels differ if a colour does by more than ``tolerance``, or if
    one shows the background and the other does not.
    """
    height, width = points.status.shape
    for row in range(first_row, last_row):
        for column in range(width):
            if points.status[row, column] == TRACED:
                continue
            for way in range(4):
                r = row + (way == 0) - (way == 1)
                c = column + (way == 2) - (way == 3)
                if r < 0 or r >= height or c < 0 or c >= width or lens[r, c] != lens[row, column]:
                    continue
                outline = (points.disparity[row, column] == BACKGROUND) != (points.disparity[r, c] == BACKGROUND)
                if outline or color_difference(points.color, row, column, r, c, coded) > tolerance:
                    wanted[row, column] = True
                    break


@compiled
def surprises(
    points: PointImage, numbers: IntArray, expected: RealArray, tolerance: float, coded: bool
) -> NDArray[np.uint32]:
    """Those of the pixels ``numbers`` whose colour is not what was ``expected (n, 3)``."""
    width = points.status.shape[1]
    found = np.empty(len(numbers), np.uint32)
    count = 0
    for i in range(len(numbers)):
        row, column = divmod(int(numbers[i]), width)
        for channel in range(3):
            one = coded_value(expected[i, channel], coded)
            other = coded_value(points.color[row, column, channel], coded)
            if abs(one - other) > tolerance * SURPRISE:
                found[count] = numbers[i]
                count += 1
                break
    return found[:count]


@uncounted
def surround(points: PointImage, lens: IntArray, surprised: IntArray, wanted: BoolArray) -> None:
    """Set ``wanted`` for the untraced pixels near to the pixels ``surprised``, under the same lens."""
    height, width = points.status.shape
    for i in range(len(surprised)):
        row, column = divmod(int(surprised[i]), width)
        for r in range(max(0, row - NEAR_ROWS), min(height, row + NEAR_ROWS + 1)):
            for c in range(max(0, column - NEAR_COLUMNS), min(width, column + NEAR_COLUMNS + 1)):
                if points.status[r, c] != TRACED and lens[r, c] == lens[row, column]:
                    wanted[r, c] = True


@compiled
def look_around(points: PointImage, reach: int, rows: int, share: int, around: IntArray, wanted: BoolArray) -> None:
    """Set ``wanted`` for a few untraced pixels, one in ``share``, in the wider surroundings of the pixels ``around``.

    These are the micro-image, which is about ``reach`` columns wide, and those beside it, so many ``rows`` up and down.
    """
    height, width = points.status.shape
    # Surroundings overlap: one visit to each row of a micro-image is enough.
    visited = np.zeros((height, width // max(1, reach) + 1), np.bool_)
    for i in range(len(around)):
        row, column = divmod(int(around[i]), width)
        cell = column // max(1, reach)
        for r in range(max(0, row - rows), min(height, row + rows + 1)):
            if visited[r, cell]:
                continue
            visited[r, cell] = True
            for c in range(max(0, (cell - 1) * reach), min(width, (cell + 2) * reach)):
                # Five has no factor in common with the shares in use: every column and row is visited.
                if points.status[r, c] != TRACED and (c + 5 * r) % share == 0:
                    wanted[r, c] = True


@uncounted
def follow_across(points: PointImage, rows: Rows, surprised: IntArray, lens: IntArray, wanted: BoolArray) -> None:
    """Set ``wanted`` for the untraced pixels under the two neighbouring lenses where the points of the pixels
    ``surprised`` should be seen, if what is shown there lies behind them. For straight lenticular displays."""
    width = points.status.shape[1]
    lenses = len(rows.center)
    for i in range(len(surprised)):
        row, column = divmod(int(surprised[i]), width)
        s = np.float64(points.disparity[row, column])
        if s == BACKGROUND:
            continue
        source = lens[row, column]
        for target in (source - 1, source + 1):
            if target < 0 or target >= lenses:
                continue
            shift = rows.center[target] - rows.center[source]
            place = rows.offset[source] + (column - rows.first[source]) + shift * s - rows.offset[target]
            count = rows.first[target + 1] - rows.first[target]
            if not (place > -1.0 and place < count):
                continue
            low = int(np.floor(place))
            for c in range(max(0, low), min(count - 1, low + 1) + 1):
                there = rows.first[target] + c
                shown = np.float64(points.disparity[row, there])
                behind = nearer(s, shown) and abs(s - shown) > _BEHIND * max(abs(s), abs(shown))
                if points.status[row, there] != TRACED and behind:
                    wanted[row, there] = True
