"""Rounds of the search for falsified pixels: trace, see what is a surprise, look there further."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lippmann.render.reuse import growth
from lippmann.render.reuse.bands import Bands
from lippmann.render.reuse.gaps import Settled
from lippmann.render.reuse.points import PointImage
from lippmann.render.reuse.rules import Rules
from lippmann.render.reuse.tracing import Pixels, PixelTracer

#: Rounds at most. They die out by themselves; what is left then is a handful of pixels.
MOST_ROUNDS = 16

Follow = Callable[[Pixels, NDArray[np.int32], NDArray[np.bool_]], None]


def search(
    points: PointImage,
    lens: NDArray[np.int32],
    reach: int,
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
    bands.rows(growth.mark_edges, points, lens, rules.tolerance, rules.coded, wanted)
    if rules.look_share:
        # Where one thing ends under a lens, another may begin that only the next lens shows.
        growth.look_around(points, reach, rules.look_share, np.flatnonzero(wanted), wanted)
    colors = points.color.reshape(-1, 3)
    for _ in range(MOST_ROUNDS):
        numbers = np.flatnonzero(wanted).astype(np.uint32)
        if not len(numbers):
            return
        wanted[:] = False
        expected = colors[numbers]
        tracer.trace(numbers, points)
        settled(len(numbers))
        surprised = growth.surprises(points, numbers, expected, rules.tolerance, rules.coded)
        growth.surround(points, lens, surprised, wanted)
        growth.look_around(points, reach, growth.WIDE_SHARE, surprised, wanted)
        follow(surprised, lens, wanted)
