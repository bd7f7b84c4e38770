"""Crosstalk: the share of the light in a direction that comes from pixels of other directions."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from lippmann.display.display import Display
from lippmann.optics.lens import Lens, Real, check_display
from lippmann.optics.light_table import light_table
from lippmann.optics.pixel_profile import ink_kernel, kernel, pixel_trapezoid, width_at_half_height

#: Marks of stereoscopic displays: a ghost is seen, and is perceptible but not annoying. (SID 2010, 73.4; Woods, J.
#: Electronic Imaging 21, 2012.)
VISIBLE, ANNOYING = 0.01, 0.058

#: Places across a lens at which profiles are known.
_PLACES = 480

#: Most strips a lens that are tried.
MOST_STRIPS = 200


def crosstalk(display: Display, slope: float, strips: float | None = None) -> float:
    """Crosstalk for an eye whose direction has this slope across the lenses.

    Under upright lenses the eye stands in the middle of a strip: of a pixel, or of one of so many ``strips`` a lens.
    Slanted lenses have sub-pixels at all places: those farther away than half a direction's width are others.

    Examples
    --------
    >>> from lippmann.optics.crosstalk import crosstalk
    >>> display = lippmann.load_display("print-60lpi")
    >>> print(f"{crosstalk(display, 0.0):.3f}")
    0.000
    """
    check_display(display)
    step = display.micro_image_pitch / _PLACES
    spread, blur = _spread(display, slope, step), _blur(display)
    shape = pixel_trapezoid(display)
    is_slanted = display.lens_array.slant != 0.0
    profile = np.convolve(spread, kernel(shape, blur, step) if is_slanted else ink_kernel(blur, step))
    sums = np.concatenate([[0.0], np.cumsum(profile)])
    edges = (np.arange(len(sums)) - 0.5 * len(profile)) * step

    def light(middle: float, width: float) -> float:
        low, high = np.interp([middle - 0.5 * width, middle + 0.5 * width], edges, sums)
        return float(high - low)

    if is_slanted:
        return 1.0 - light(0.0, shape.half_height) / float(sums[-1])
    width = display.panel.pixel_pitch if strips is None else display.micro_image_pitch / strips
    lit = shape.base if strips is None else width
    count = math.ceil(float(edges[-1]) / width) + 1
    return 1.0 - light(0.0, lit) / sum(light(k * width, lit) for k in range(-count, count + 1))


def independent_directions(display: Display) -> float:
    """Number of directions that one lens tells apart: its micro-image over the half-height width of a pixel's light.

    Upright lenses show no more than their pixels.

    Examples
    --------
    >>> from lippmann.optics.crosstalk import independent_directions
    >>> display = lippmann.load_display("print-60lpi")
    >>> print(f"{independent_directions(display):.1f}")
    12.0
    """
    check_display(display)
    shape, blur, step = pixel_trapezoid(display), _blur(display), display.micro_image_pitch / _PLACES
    width = shape.half_height
    if display.lens is not None or blur:
        profile = np.convolve(_spread(display, 0.0, step), kernel(shape, blur, step))
        width = max(width, width_at_half_height(profile, step))
    directions = display.micro_image_pitch / width
    return directions if display.lens_array.slant else min(directions, display.pixels_per_lens[0])


def most_strips(display: Display, limit: float = ANNOYING) -> int:
    """The largest number of strips a lens, of two or more, up to which crosstalk straight ahead keeps to a limit."""
    strips = 1
    while strips < MOST_STRIPS and crosstalk(display, 0.0, strips + 1) <= limit:
        strips += 1
    return strips


def _blur(display: Display) -> float:
    return display.pixel.blur if display.pixel else 0.0


def _spread(display: Display, slope: float, step: float) -> Real:
    """Shares of the light of a direction on places ``step`` wide, as many to both sides of its middle."""
    return np.ones(1) if display.lens is None else _spread_by(Lens.of(display), slope, step)


@lru_cache(maxsize=16)
def _spread_by(lens: Lens, slope: float, step: float) -> Real:
    """That of a lens; kept, as numbers of strips are tried on the same one."""
    table = light_table(lens, slope, places_per_lens=_PLACES, neighbours=2)
    sums = np.concatenate([[0.0], np.cumsum(table.shares[0])]) / table.light[0]
    half = len(table.places) // 2
    edges = table.mean_places[0] + (np.arange(2 * half + 1) - half) * step
    return np.diff(np.interp(edges, table.edges, sums))
