"""Missed pixels as the mean of the corresponding ones under both neighbouring lenses: the paper's interpolation."""

from __future__ import annotations

import numpy as np

from lippmann.display.lens_field import LensField
from lippmann.rendering.reprojection.pixel_tracer import Pixels
from lippmann.rendering.reprojection.point_image import INTERPOLATED, IntArray, PointImage
from lippmann.rendering.reprojection.rules import Rules, color_difference
from lippmann.rendering.reprojection.tuning import TUNING
from lippmann.runtime.numba_jit import uncounted
from lippmann.runtime.row_threads import Bands


def average_neighbors(points: PointImage, field: LensField, numbers: Pixels, rules: Rules, bands: Bands) -> None:
    """Give the pixels ``numbers`` (linear) the mean colour of their one or two corresponding pixels.

    Pixels without a corresponding one stay missed. With ``careful`` rules, so do those with a single one, or with two
    that disagree.
    """
    bands.pixels(_average, len(numbers), points, numbers, *field.corresponding_beside(numbers), rules)


@uncounted
def _average(
    first: int, last: int, points: PointImage, numbers: IntArray, left: IntArray, right: IntArray, rules: Rules
) -> None:
    """``left`` and ``right``: the corresponding pixels of each of ``numbers``; -1 for none."""
    width = points.status.shape[1]
    for i in range(first, last):
        one, other = left[i], right[i]
        if one < 0 and other < 0:
            continue
        if one < 0 or other < 0:
            one = other = max(one, other)
        row, column = divmod(int(numbers[i]), width)
        one_row, one_column = divmod(one, width)
        other_row, other_column = divmod(other, width)
        if rules.careful and (
            one == other
            or points.fragile[one_row, one_column]
            or points.fragile[other_row, other_column]
            or color_difference(points.color, one_row, one_column, other_row, other_column, rules.coded)
            > TUNING.averaged_tolerance * rules.tolerance
        ):
            continue
        for channel in range(3):
            total = points.color[one_row, one_column, channel] + points.color[other_row, other_column, channel]
            points.color[row, column, channel] = np.float32(0.5) * total
        points.disparity[row, column] = points.disparity[one_row, one_column]
        points.status[row, column] = INTERPOLATED
