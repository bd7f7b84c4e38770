"""Rounds of the search for falsified pixels: trace, compare with the prediction, search further where it was wrong."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lippmann.display import Display
from lippmann.rendering.reprojection.common.lens_map import LensField
from lippmann.rendering.reprojection.common.pixel_tracer import PixelTracer
from lippmann.rendering.reprojection.common.point_image import TRACED, PointImage
from lippmann.rendering.reprojection.common.thresholds import Rules
from lippmann.rendering.reprojection.retrace import region_growing
from lippmann.runtime.row_threads import Bands


class Surroundings(NamedTuple):
    """The micro-image of a pixel and those beside it, so many ``rows`` up and down: one pixel in ``share`` of them."""

    rows: int
    share: int


class Neighborhoods(NamedTuple):
    """What is traced around edges in the first round, and in every round around pixels that were wrongly predicted."""

    of_edges: tuple[Surroundings, ...]
    of_wrong: tuple[Surroundings, ...]


def choose_neighborhoods(display: Display, reach: int) -> Neighborhoods:
    """Neighborhoods for a display whose micro-images are ``reach`` columns wide.

    Square and hexagonal micro-images have so few pixels that one wrong pixel spoils them, and a thing near to the lens
    plane may be under one of them only: they are searched most closely.
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
    """Trace what of the finished picture ``points`` is falsified, as far as it can be found."""
    sides = ((0, -1), (0, 1), (-1, 0), (1, 0))
    reach, beside = field.reach, np.stack([field.lens_beside(*side) for side in sides], axis=1)
    wanted = np.zeros(points.status.shape, dtype=np.bool_)
    kernel = region_growing.mark_edges
    bands.lines(kernel, len(wanted), points, field.lens, rules.tolerance, rules.coded, wanted)
    # Where one thing ends under a lens, another may begin that only the next lens shows.
    edges = np.flatnonzero(wanted).astype(np.uint32)
    for each in neighborhoods.of_edges:
        region_growing.mark_surroundings(points, reach, *each, edges, wanted)
    traced = np.flatnonzero(points.status == TRACED).astype(np.uint32)
    region_growing.follow_points(points, field, beside, traced, rules, wanted)
    colors = points.color.reshape(-1, 3)
    for _ in range(16):  # rounds die out by themselves; what is left then is a handful of pixels
        numbers = np.flatnonzero(wanted).astype(np.uint32)
        if not len(numbers):
            return
        wanted[:] = False
        predicted = colors[numbers]
        tracer.trace(numbers, points)
        wrong = region_growing.wrong_predictions(points, numbers, predicted, rules.tolerance, rules.coded)
        region_growing.mark_near(points, field.lens, wrong, wanted)
        for each in neighborhoods.of_wrong:
            region_growing.mark_surroundings(points, reach, *each, wrong, wanted)
        region_growing.follow_points(points, field, beside, wrong, rules, wanted)
