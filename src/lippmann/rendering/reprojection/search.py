"""Search for falsified pixels by region growing from edges; they are traced anew. Compiled kernels.

Every pixel beside an edge is traced. Where the traced colour differs from the reprojected one, the search goes on: all
pixels around it are traced next, a few in the wider surroundings, and those under the neighbouring lenses that should
see the same point. It ends when all predictions are right: at once along outlines that reprojection got right, while a
small object that one pixel reveals is followed to its end.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.display.lens_field import LensField
from lippmann.rendering.reprojection.pixel_tracer import PixelTracer
from lippmann.rendering.reprojection.point_image import BACKGROUND, TRACED, BoolArray, IntArray, PointImage, RealArray
from lippmann.rendering.reprojection.rules import Rules, alike, coded_value, color_difference, nearer
from lippmann.rendering.reprojection.tuning import TUNING
from lippmann.runtime.numba_jit import compiled, uncounted
from lippmann.runtime.row_threads import Bands


class Surroundings(NamedTuple):
    """A pixel's micro-image and its two neighbours, ``rows`` up and down, of which one pixel in ``share`` is traced."""

    rows: int
    share: int


class Neighborhoods(NamedTuple):
    """Surroundings that are traced: of edges in the first round, of wrong predictions in every round."""

    of_edges: tuple[Surroundings, ...]
    of_wrong: tuple[Surroundings, ...]


def choose_neighborhoods(display: Display, reach: int) -> Neighborhoods:
    """Neighborhoods for a display whose micro-images are ``reach`` columns wide.

    Square and hexagonal micro-images have so few pixels that one wrong pixel shows, and an object near to the lens
    plane may be under a single one: they are searched most densely.
    """
    if display.lens_array.layout == "lenticular":
        return Neighborhoods((Surroundings(6, 3),), (Surroundings(6, 8),))
    return Neighborhoods((Surroundings(1, 1),), (Surroundings(4, 1), Surroundings(reach, 3)))


def search(
    points: PointImage,
    field: LensField,
    neighborhoods: Neighborhoods,
    tracer: PixelTracer,
    bands: Bands,
    rules: Rules,
) -> None:
    """Trace the falsified pixels of the finished picture ``points``, as far as the search finds them."""
    sides = ((0, -1), (0, 1), (-1, 0), (1, 0))
    reach, beside = field.reach, np.stack([field.lens_beside(*side) for side in sides], axis=1)
    marked = np.zeros(points.status.shape, dtype=np.bool_)
    kernel = mark_edges
    bands.lines(kernel, len(marked), points, field.lens, rules.tolerance, rules.coded, marked)
    # Behind an outline, another object may begin that only the next lens shows.
    edges = np.flatnonzero(marked).astype(np.uint32)
    for each in neighborhoods.of_edges:
        mark_surroundings(points, reach, *each, edges, marked)
    traced = np.flatnonzero(points.status == TRACED).astype(np.uint32)
    follow_points(points, field, beside, traced, rules, marked)
    colors = points.color.reshape(-1, 3)
    for _ in range(16):  # bounds the search; later rounds would find a handful of pixels
        numbers = np.flatnonzero(marked).astype(np.uint32)
        if not len(numbers):
            return
        marked[:] = False
        predicted = colors[numbers]
        tracer.trace(numbers, points)
        wrong = wrong_predictions(points, numbers, predicted, rules.tolerance, rules.coded)
        mark_near(points, field.lens, wrong, marked)
        for each in neighborhoods.of_wrong:
            mark_surroundings(points, reach, *each, wrong, marked)
        follow_points(points, field, beside, wrong, rules, marked)


@uncounted
def mark_edges(
    first_row: int, last_row: int, points: PointImage, lens: IntArray, tolerance: float, coded: bool, marked: BoolArray
) -> None:
    """Set ``marked (H, W)`` for untraced pixels that differ from a neighbour under the same lens.

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
                    marked[row, column] = True
                    break


@compiled
def wrong_predictions(
    points: PointImage, numbers: IntArray, predicted: RealArray, tolerance: float, coded: bool
) -> NDArray[np.uint32]:
    """The pixels among ``numbers`` whose colour differs from the ``predicted (n, 3)`` one."""
    width = points.status.shape[1]
    wrong = np.empty(len(numbers), np.uint32)
    count = 0
    for i in range(len(numbers)):
        row, column = divmod(int(numbers[i]), width)
        for channel in range(3):
            one = coded_value(predicted[i, channel], coded)
            other = coded_value(points.color[row, column, channel], coded)
            if abs(one - other) > tolerance * TUNING.deviation:
                wrong[count] = numbers[i]
                count += 1
                break
    return wrong[:count]


@uncounted
def mark_near(points: PointImage, lens: IntArray, numbers: IntArray, marked: BoolArray) -> None:
    """Set ``marked`` for the untraced pixels near to the pixels ``numbers``, under the same lens."""
    height, width = points.status.shape
    for i in range(len(numbers)):
        row, column = divmod(int(numbers[i]), width)
        for r in range(max(0, row - TUNING.around), min(height, row + TUNING.around + 1)):
            for c in range(max(0, column - TUNING.around), min(width, column + TUNING.around + 1)):
                if points.status[r, c] != TRACED and lens[r, c] == lens[row, column]:
                    marked[r, c] = True


@compiled
def mark_surroundings(
    points: PointImage, reach: int, rows: int, share: int, numbers: IntArray, marked: BoolArray
) -> None:
    """Set ``marked`` for one in ``share`` of the untraced pixels in the wider surroundings of the pixels ``numbers``.

    These are the micro-image, about ``reach`` columns wide, and those beside it, up to ``rows`` rows up and down.
    """
    height, width = points.status.shape
    # Surroundings of several pixels overlap, so each row of a micro-image is visited once.
    visited = np.zeros((height, width // max(1, reach) + 1), np.bool_)
    for i in range(len(numbers)):
        row, column = divmod(int(numbers[i]), width)
        cell = column // max(1, reach)
        for r in range(max(0, row - rows), min(height, row + rows + 1)):
            if visited[r, cell]:
                continue
            visited[r, cell] = True
            for c in range(max(0, (cell - 1) * reach), min(width, (cell + 2) * reach)):
                # Five has no factor in common with the shares in use: every column and row is visited.
                if points.status[r, c] != TRACED and (c + 5 * r) % share == 0:
                    marked[r, c] = True


@uncounted
def follow_points(
    points: PointImage, field: LensField, neighbors: IntArray, numbers: IntArray, rules: Rules, marked: BoolArray
) -> None:
    """Set ``marked (H, W)`` for untraced pixels under the ``neighbors (lenses, n)`` that should show the points of the
    pixels ``numbers``, and do not.

    A point lies between four pixels of another lens. It is missing there if none of them shows that surface in that
    colour, and none anything nearer, which may hide it.
    """
    height, width = points.status.shape
    for i in range(len(numbers)):
        row, column = divmod(int(numbers[i]), width)
        s = np.float64(points.disparity[row, column])
        if s == np.float32(BACKGROUND):
            continue
        lens = field.lens[row, column]
        for k in range(neighbors.shape[1]):
            target = neighbors[lens, k]
            if target < 0:
                continue
            x = column + (field.center[target, 0] - field.center[lens, 0]) * (1.0 + s)
            y = row + (field.center[target, 1] - field.center[lens, 1]) * (1.0 + s)
            if not (x > -1.0 and x < width and y > -1.0 and y < height):
                continue
            left, top = int(np.floor(x)), int(np.floor(y))
            missing = True
            for r in range(max(0, top), min(height, top + 2)):
                for c in range(max(0, left), min(width, left + 2)):
                    if field.lens[r, c] != target:
                        continue
                    other = np.float64(points.disparity[r, c])
                    if alike(s, other, TUNING.one_surface):
                        # The colours of a view-dependent surface differ between lenses: they prove nothing.
                        if (
                            points.fragile[row, column]
                            or points.fragile[r, c]
                            or color_difference(points.color, row, column, r, c, rules.coded) <= rules.tolerance
                        ):
                            missing = False
                    elif nearer(other, s):
                        missing = False
            if not missing:
                continue
            for r in range(max(0, top), min(height, top + 2)):
                for c in range(max(0, left), min(width, left + 2)):
                    if field.lens[r, c] == target and points.status[r, c] != TRACED:
                        marked[r, c] = True
