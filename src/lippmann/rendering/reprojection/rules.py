"""Tolerances of reprojection, and the comparisons that its kernels share."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lippmann.rendering.reprojection.point_image import RealArray
from lippmann.rendering.reprojection.tuning import TUNING
from lippmann.runtime.numba_jit import inlined


class Rules(NamedTuple):
    """Tolerances and densities of reprojection.

    Attributes
    ----------
    careful:
        Trace pixels that reprojection would falsify: fragile points, colour edges, pixels beside outlines, and points
        on which the two sources disagree.
    tolerance:
        Colour difference that counts as an edge or as a disagreement.
    coded:
        Compare the square roots of colour values (roughly perceptual), else the values.
    probe_rows:
        Rows from one row with probes (two in each micro-image) to the next, under straight cylindrical lenses.
    probe_stride:
        Pixels per probe under all other lenses.
    run_step:
        Pixels from one traced pixel of a run of missed ones to the next.
    """

    careful: bool
    tolerance: float
    coded: bool
    probe_rows: int
    probe_stride: int
    run_step: int


def choose_rules(*, careful: bool, coded: bool) -> Rules:
    """The rules of a picture; ``careful`` and ``coded`` as in :class:`Rules`."""
    if careful:
        return Rules(True, 0.06, coded, probe_rows=4, probe_stride=16, run_step=3)
    return Rules(False, 0.12, coded, probe_rows=16, probe_stride=32, run_step=4)


@inlined
def nearer(s: float, t: float) -> bool:
    """Whether disparity ``s`` belongs to a point nearer to the viewer than that of ``t``."""
    return s > 0.0 if (s > 0.0) != (t > 0.0) else s < t


@inlined
def alike(s: float, t: float, part: float) -> bool:
    """Whether two disparities differ by at most ``part`` of the larger."""
    return abs(s - t) <= part * max(abs(s), abs(t))


@inlined
def widen(nearest: float, farthest: float, s: float) -> tuple[float, float]:
    """The range of disparities from ``nearest`` to ``farthest``, widened to hold ``s``; (0, 0) is an empty range."""
    if nearest == 0.0:
        nearest, farthest = s, s
    elif nearer(s, nearest):
        nearest = s
    elif nearer(farthest, s):
        farthest = s
    return nearest, farthest


@inlined
def limit_of_probes(nearest: float, farthest: float) -> float:
    """Disparity of the farthest point to expect beside probes with these disparities; 0 without probes.

    Probes on one surface allow its farthest point; probes on different ones only the nearest.
    """
    return farthest if alike(nearest, farthest, TUNING.one_surface) else nearest


@inlined
def is_behind(s: float, limit: float) -> bool:
    """Whether disparity ``s`` belongs to a surface behind the ``limit`` of probes; never where that is 0."""
    return limit != 0.0 and nearer(limit, s) and not alike(limit, s, TUNING.one_surface)


@inlined
def coded_value(value: float, coded: bool) -> float:
    """Colour value in [0, 1] for comparisons: the square root of a ``coded`` one, which approximates sRGB."""
    value = min(max(value, 0.0), 1.0)
    return np.sqrt(value) if coded else value


@inlined
def color_difference(color: RealArray, row: int, column: int, other_row: int, other_column: int, coded: bool) -> float:
    """Largest difference of a channel between two pixels."""
    largest = 0.0
    for channel in range(3):
        one = coded_value(color[row, column, channel], coded)
        other = coded_value(color[other_row, other_column, channel], coded)
        largest = max(largest, abs(one - other))
    return largest
