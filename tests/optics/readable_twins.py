"""Twins of the light table in NumPy: slower, and easier to read."""

from __future__ import annotations

import numpy as np

from lippmann.optics.light_table import _NEIGHBOURS, _SQUARE_RAYS, PLACES_PER_LENS, LightTable, _frame, _nodes
from lippmann.optics.trace import trace


def readable_light_table(lens, slopes, along=0.0, *, places_per_lens=PLACES_PER_LENS, neighbours=_NEIGHBOURS):
    """The twin of :func:`light_table` in NumPy: slower, and easier to read."""
    directions, edges = _frame(lens, slopes, along, places_per_lens, neighbours)
    if lens.is_cylinder:
        x = _nodes(lens)
        rows = [_lines(trace(lens, x, x * 0.0, *direction), edges) for direction in directions]
        return LightTable(directions, edges, np.array(rows))
    squares = []
    x, y = lens.samples(_SQUARE_RAYS)
    for direction in directions:
        rays = trace(lens, x, y, *direction)
        squares.append(np.histogram2d(rays.y, rays.x, bins=(edges, edges), weights=rays.light)[0] / len(x))
    return LightTable(directions, edges, np.sum(squares, axis=1), np.array(squares))


def _lines(rays, edges):
    """Light of each place: that between two neighbouring rays is spread evenly between where they land."""
    light = 0.5 * (rays.light[1:] + rays.light[:-1]) / (len(rays.light) - 1)
    lit = rays.light > 0.0
    before = np.where(lit[:-1], rays.x[:-1], rays.x[1:])
    here = np.where(lit[1:], rays.x[1:], rays.x[:-1])
    low, high = np.minimum(before, here), np.maximum(before, here)
    # The share of each interval that lies left of each edge.
    with np.errstate(invalid="ignore", divide="ignore"):
        left = np.clip((edges - low[:, None]) / (high - low)[:, None], 0.0, 1.0)
    left = np.where((high > low)[:, None], left, edges > low[:, None])
    return light @ np.diff(left, axis=1)
