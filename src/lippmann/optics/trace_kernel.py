"""Compiled light tables, whose readable twin is :mod:`lippmann.optics.trace`.

They are imported late: Numba takes time to load.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.numba_jit import inlined, uncounted

Real = NDArray[np.float64]


@inlined
def _light_through(
    x: float, y: float, slope_x: float, slope_y: float, shape: Real, crests: Real
) -> tuple[float, float, float]:
    """Landing place of a ray through a point of the lens, relative to the lens's axis, and the ray's light.

    ``shape`` holds crest radius, thickness, index, conic constant, reach and rim of the crest, and whether it bends
    light along y. ``crests`` are the centres of the lens and its neighbours.
    """
    radius, thickness, index, flat, reach, rim, tangential = (
        shape[0],
        shape[1],
        shape[2],
        1.0 + shape[3],
        shape[4],
        shape[5],
        shape[6],
    )
    length = math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    squared = x * x + tangential * y * y
    is_crest = squared <= reach * reach * (1.0 + 1e-12)
    root = math.sqrt(1.0 - flat * squared / (radius * radius)) if is_crest else 1.0
    h = squared / radius / (1.0 + root) if is_crest else rim
    normal_x = x if is_crest else 0.0
    normal_y = tangential * y if is_crest else 0.0
    normal_z = radius * root
    size = math.sqrt(normal_x * normal_x + normal_y * normal_y + normal_z * normal_z)
    normal_x, normal_y, normal_z = normal_x / size, normal_y / size, normal_z / size
    facing = (slope_x * normal_x + slope_y * normal_y + normal_z) / length
    light = 0.0
    land_x, land_y = x, y
    if facing > 0.0:
        light = facing * length / normal_z
        # Crests in the way; where the sheet is flat, the lens's own too.
        for k in range(crests.shape[0]):
            from_x, from_y = x - crests[k, 0], y - crests[k, 1]
            if from_x * slope_x + from_y * slope_y >= 0.0:
                continue  # the crest is on the side away from the eye
            a = slope_x * slope_x + tangential * slope_y * slope_y + flat
            b = from_x * slope_x + tangential * from_y * slope_y - (flat * h - radius)
            c = from_x * from_x + tangential * from_y * from_y + flat * h * h - 2.0 * radius * h
            inside = b * b - a * c
            if inside <= 0.0 or a == 0.0:
                continue
            for sign in (-1.0, 1.0):
                way = (-b + sign * math.sqrt(inside)) / a
                depth = h - way
                at_x, at_y = from_x + way * slope_x, from_y + way * slope_y
                if way > 1e-9 * reach and 0.0 <= depth <= rim and _is_own(at_x, at_y, reach, tangential, crests):
                    light = 0.0
    if light > 0.0:
        ratio = 1.0 / index
        behind = math.sqrt(1.0 - ratio * ratio * (1.0 - facing * facing))
        across = (ratio * facing - behind) / (ratio * facing + behind)
        along = (facing - ratio * behind) / (facing + ratio * behind)
        light *= 1.0 - 0.5 * (across * across + along * along)
        bend = ratio * facing - behind
        inside_x = -ratio * slope_x / length + bend * normal_x
        inside_y = -ratio * slope_y / length + bend * normal_y
        inside_z = -ratio / length + bend * normal_z
        way = (thickness - h) / -inside_z
        land_x, land_y = x + way * inside_x, y + way * inside_y
        # Light that leaves again through the far flank of the crest.
        a = inside_x * inside_x + tangential * inside_y * inside_y + flat * inside_z * inside_z
        b = x * inside_x + tangential * y * inside_y - (flat * h - radius) * inside_z
        if a != 0.0:
            out = -2.0 * b / a
            depth = h - out * inside_z
            leaves = out > 1e-9 * reach and 0.0 <= depth < rim
            if leaves and _is_own(x + out * inside_x, y + out * inside_y, reach, tangential, crests):
                light = 0.0
    return land_x, land_y, light


@inlined
def _is_own(x: float, y: float, reach: float, tangential: float, crests: Real) -> bool:
    """Whether a point relative to the axis of a lens lies on its crest, nearer to no other lens."""
    own = x * x + tangential * y * y
    is_own = own <= reach * reach
    if tangential > 0.0:
        for k in range(crests.shape[0]):
            other = (x - crests[k, 0]) ** 2 + (y - crests[k, 1]) ** 2
            is_own = is_own and own <= other
    return is_own


@uncounted
def fill_lines(slopes: Real, x: Real, shape: Real, crests: Real, first: float, step: float, table: Real) -> None:
    """Light tables of a cylinder: ``table`` ``(directions, places)`` of places ``step`` wide from ``first`` on.

    ``slopes`` is ``(directions, 2)``; ``x`` holds the nodes across the lens in order. Light between two nodes is spread
    evenly between where they land.
    """
    intervals = x.shape[0] - 1
    for k in range(slopes.shape[0]):
        before, light_before = 0.0, 0.0
        for i in range(x.shape[0]):
            here, _, light_here = _light_through(x[i], 0.0, slopes[k, 0], slopes[k, 1], shape, crests)
            light = 0.5 * (light_before + light_here) / intervals
            # In shadow a node has no place of its own.
            start = before if light_before > 0.0 else here
            end = here if light_here > 0.0 else before
            low, high = (min(start, end) - first) / step, (max(start, end) - first) / step
            if i > 0 and light > 0.0:
                for place in range(max(0, math.floor(low)), min(table.shape[1] - 1, math.floor(high)) + 1):
                    share = 1.0 if high <= low else (min(high, place + 1.0) - max(low, float(place))) / (high - low)
                    table[k, place] += light * share
            before, light_before = here, light_here


@uncounted
def fill_squares(
    slopes: Real, x: Real, y: Real, shape: Real, crests: Real, first: float, step: float, table: Real
) -> None:
    """Light tables of a micro-lens: ``table`` ``(directions, rows, columns)``; the points ``(x, y)`` cover the lens."""
    for k in range(slopes.shape[0]):
        for i in range(x.shape[0]):
            at_x, at_y, light = _light_through(x[i], y[i], slopes[k, 0], slopes[k, 1], shape, crests)
            if light > 0.0:
                column, row = math.floor((at_x - first) / step), math.floor((at_y - first) / step)
                if 0 <= column < table.shape[2] and 0 <= row < table.shape[1]:
                    table[k, int(row), int(column)] += light / x.shape[0]
