"""True directions: the median over a pixel's own light, and its inverse."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.display.formats.print_sheet import TYPICAL_SHEETS
from lippmann.display.lens_array import LensArray
from lippmann.display.lens_profile import LensProfile
from lippmann.optics.directions import _interpolate, true_directions
from lippmann.optics.fitting import fit_profile, gap_of
from lippmann.optics.lens import Lens
from lippmann.optics.trace import Vectors, trace_back

SIXTY = Lens(fit_profile(LensArray("lenticular", 25.4 / 60), thickness=0.6604), LensArray("lenticular", 25.4 / 60))


@pytest.mark.parametrize("name", TYPICAL_SHEETS)
def test_each_is_the_others_inverse(name):
    sheet = TYPICAL_SHEETS[name]
    lens = Lens(LensProfile(sheet.radius, sheet.thickness, sheet.index), LensArray("lenticular", 25.4 / sheet.lpi))
    directions = true_directions(lens)
    places = np.linspace(-0.6, 0.6, 501) * lens.pitch
    slopes = directions.direction_of(places)
    assert np.all(np.diff(slopes) < 0)
    assert slopes == pytest.approx(-slopes[::-1], abs=1e-12)
    assert _interpolate(slopes, directions.slopes[::-1], directions.places[::-1]) == pytest.approx(places, abs=1e-12)


def test_the_median_is_that_of_light_sent_from_the_panel():
    """Followed the other way: from a place of the panel through all of its own lens, weighted alike."""
    lens, place = SIXTY, 0.1
    targets = np.linspace(-0.5, 0.5, 20_001)[1:-1] * lens.pitch
    sag = np.array([lens.profile.sag(x) for x in targets])
    length = np.hypot(targets - place, lens.profile.thickness - sag)
    inside = Vectors((targets - place) / length, targets * 0, (lens.profile.thickness - sag) / length)
    slope, _, transmission = trace_back(lens, np.full_like(targets, place), targets * 0, inside)
    leaves = transmission > 0
    # Evenly in angle as the eye sees it: n d(sin) inside is cos d(angle) outside, per place of the panel.
    sine = inside.x[leaves]
    slope, transmission = slope[leaves], transmission[leaves]
    seen = np.abs(np.gradient(sine)) * np.sqrt(1 + slope**2) * transmission
    order = np.argsort(slope)
    sums = np.cumsum(seen[order])
    expected = slope[order][np.searchsorted(sums, 0.5 * sums[-1])]
    assert true_directions(lens).direction_of(place) == pytest.approx(expected, abs=3e-4)


def test_directions_near_the_axis_are_those_of_the_gap():
    directions = true_directions(SIXTY)
    place = 0.02 * SIXTY.pitch
    assert directions.direction_of(place) == pytest.approx(-place / gap_of(SIXTY.profile, SIXTY.array), rel=0.03)
    # A pinhole at thickness over index is wrong by a tenth and more.
    place = 0.4 * SIXTY.pitch
    assert abs(directions.direction_of(place)) > 1.07 * place / (0.6604 / 1.57)


def test_light_spreads_more_where_focus_is_worse():
    sharp = true_directions(SIXTY).spread
    blurred = true_directions(Lens(LensProfile(0.2398, 0.6604), SIXTY.array)).spread
    assert sharp[len(sharp) // 2] < 0.3 * blurred[len(blurred) // 2]
