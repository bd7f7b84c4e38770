"""Rounds of the search for falsified pixels: trace, see what is a surprise, look there further."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.rendering.reprojection.common.gap_filling import Settled
from lippmann.rendering.reprojection.common.pixel_tracer import Pixels, PixelTracer
from lippmann.rendering.reprojection.common.point_image import PointImage
from lippmann.rendering.reprojection.common.schedule import few_lenses
from lippmann.rendering.reprojection.common.thresholds import Rules
from lippmann.rendering.reprojection.retrace import region_growing
from lippmann.runtime.row_threads import Bands

#: Rounds at most. They die out by themselves; what is left then is a handful of pixels.
MOST_ROUNDS = 16


class Look(NamedTuple):
    """A look at the surroundings of some pixels: so many ``rows`` up and down, one pixel in ``share``."""

    rows: int
    share: int


class Looks(NamedTuple):
    """Where the search looks beside the very neighbours: around all edges at first, around surprises in every round."""

    at_edges: tuple[Look, ...]
    at_surprises: tuple[Look, ...]


def choose_looks(display: Display, reach: int) -> Looks:
    """Looks for a display whose micro-images are ``reach`` columns wide.

    Square and hexagonal micro-images have so few pixels that one wrong pixel spoils them, and a thing near to the lens
    plane may be under one of them only: they are looked through most closely. The tall ones of cylindrical lenses are
    so where there are few of them.
    """
    if display.lens_array.layout != "lenticular":
        return Looks((Look(1, 1),), (Look(4, 1), Look(reach, 3)))
    return Looks((Look(6, 3),) if few_lenses(display.lens_grid.columns) else (), (Look(6, 8),))


Follow = Callable[[Pixels, NDArray[np.int32], NDArray[np.bool_]], None]


def search(
    points: PointImage,
    lens: NDArray[np.int32],
    reach: int,
    looks: Looks,
    tracer: PixelTracer,
    bands: Bands,
    rules: Rules,
    follow: Follow,
    settled: Settled,
) -> None:
    """Trace what of the finished picture ``points`` is falsified, as far as it can be found.

    Parameters
    ----------
    lens:
        ``(H, W)`` the number of each pixel's lens.
    reach:
        Columns of a micro-image, about.
    follow:
        Called with the surprising pixels, ``lens`` and the map of wanted pixels, to which it adds those under other
        lenses that should see the same points.
    settled:
        Told how many pixels have just been traced.
    """
    wanted = np.zeros(points.status.shape, dtype=np.bool_)
    bands.lines(region_growing.mark_edges, len(points.status), points, lens, rules.tolerance, rules.coded, wanted)
    # Where one thing ends under a lens, another may begin that only the next lens shows.
    edges = np.flatnonzero(wanted).astype(np.uint32)
    for look in looks.at_edges:
        region_growing.look_around(points, reach, *look, edges, wanted)
    colors = points.color.reshape(-1, 3)
    for _ in range(MOST_ROUNDS):
        numbers = np.flatnonzero(wanted).astype(np.uint32)
        if not len(numbers):
            return
        wanted[:] = False
        expected = colors[numbers]
        tracer.trace(numbers, points)
        settled(len(numbers))
        surprised = region_growing.surprises(points, numbers, expected, rules.tolerance, rules.coded)
        region_growing.surround(points, lens, surprised, wanted)
        for look in looks.at_surprises:
            region_growing.look_around(points, reach, *look, surprised, wanted)
        follow(surprised, lens, wanted)
