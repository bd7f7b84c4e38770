"""Missed pixels: a few of each run are traced, the others are interpolated between them or between lenses. Compiled.

A run is a stretch of missed pixels of one row under one lens. A lens shows only a small part of a surface near to the
lens plane, strongly magnified: no other lens sees the same points, but few samples suffice.
"""

from __future__ import annotations

import numpy as np

from lippmann.display.lens_field import LensField
from lippmann.rendering.reprojection.pixel_tracer import Pixels
from lippmann.rendering.reprojection.point_image import BRIDGED, INTERPOLATED, QUEUED, REPROJECTED, IntArray, PointImage
from lippmann.rendering.reprojection.rules import Rules, alike, color_difference
from lippmann.rendering.reprojection.tuning import TUNING
from lippmann.runtime.numba_jit import uncounted
from lippmann.runtime.row_threads import Bands


@uncounted
def thin_out(first_row: int, last_row: int, points: PointImage, lens: IntArray, rules: Rules) -> None:
    """Leave :data:`QUEUED` only the first pixel of each run and one in ``run_step`` of the others.

    The traced columns shift from row to row, so that vertical lines are not missed.
    """
    for row in range(first_row, last_row):
        place = 0
        for column in range(points.status.shape[1]):
            if points.status[row, column] != QUEUED or (place and lens[row, column] != lens[row, column - 1]):
                place = 0
            if points.status[row, column] == QUEUED:
                if place and (place + row) % rules.run_step:
                    points.status[row, column] = BRIDGED
                place += 1


@uncounted
def bridge(first_row: int, last_row: int, points: PointImage, lens: IntArray, rules: Rules) -> None:
    """Fill pixels left out between traced ones: interpolate on one surface, else copy the nearer pixel.

    With careful rules, pixels between two that differ in surface, colour or fragility are queued for tracing instead.
    """
    width = points.status.shape[1]
    for row in range(first_row, last_row):
        for start in range(1, width):
            if points.status[row, start] != BRIDGED:
                continue
            left, right = start - 1, start + 1
            while right < width and points.status[row, right] == BRIDGED and lens[row, right] == lens[row, left]:
                right += 1
            has_right = right < width and lens[row, right] == lens[row, left]
            last = right if has_right else left
            s, t = np.float64(points.disparity[row, left]), np.float64(points.disparity[row, last])
            # Near to the lens plane disparities are huge and change their sign: there heights are compared.
            is_one = has_right and (alike(s, t, TUNING.one_surface) or abs(s - t) <= TUNING.one_height * abs(s * t))
            if rules.careful and (
                not is_one
                or points.fragile[row, left] != points.fragile[row, last]
                or color_difference(points.color, row, left, row, last, rules.coded) > rules.tolerance
            ):
                points.status[row, start:right] = QUEUED
                continue
            for column in range(start, right):
                share = (column - left) / (right - left)
                nearest = last if share > 0.5 else left
                if not is_one:
                    share = 1.0 if nearest == last else 0.0
                for channel in range(3):
                    one, other = points.color[row, left, channel], points.color[row, last, channel]
                    points.color[row, column, channel] = (1.0 - share) * one + share * other
                points.disparity[row, column] = points.disparity[row, nearest]
                if s * t > 0.0:
                    points.disparity[row, column] = (1.0 - share) * s + share * t
                points.fragile[row, column] = points.fragile[row, left] or points.fragile[row, last]
                points.status[row, column] = REPROJECTED


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
    """Average the corresponding pixels ``left`` and ``right`` (-1: none) into each of the pixels ``numbers``."""
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
            > TUNING.part_tolerance * rules.tolerance
        ):
            continue
        for channel in range(3):
            total = points.color[one_row, one_column, channel] + points.color[other_row, other_column, channel]
            points.color[row, column, channel] = np.float32(0.5) * total
        points.disparity[row, column] = points.disparity[one_row, one_column]
        points.status[row, column] = INTERPOLATED
