"""Crests from what makers state, and gaps of lenses."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.display.lens_array import LensArray
from lippmann.display.lens_profile import LensProfile
from lippmann.errors import DisplayError
from lippmann.optics.first_order import extreme_ray_field
from lippmann.optics.fitting import fit_profile, gap_of, profile_behind
from lippmann.optics.lens import Lens
from lippmann.optics.trace import trace

SIXTY = LensArray("lenticular", 25.4 / 60)


def spread(profile):
    """Root mean square of where light from straight ahead lands, of many more rays than the fit's own."""
    lens = Lens(profile, SIXTY)
    rays = trace(lens, *lens.samples(5000), 0.0)
    return math.sqrt(np.average(rays.x**2, weights=rays.light))


def test_the_best_focus_lies_between_its_neighbours():
    best = fit_profile(SIXTY, thickness=0.6604)
    # A tenth more than the crest whose paraxial focus lies on the print, as sheets of a circular crest have it.
    assert best.radius / (0.6604 * 0.57 / 1.57) == pytest.approx(1.1, abs=0.01)
    for factor in (0.98, 1.02):
        assert spread(LensProfile(factor * best.radius, 0.6604)) > spread(best)


def test_the_ellipse_without_aberration_is_found():
    best = fit_profile(SIXTY, thickness=0.6604, conic=-1 / 1.57**2)
    assert best.radius == pytest.approx(0.6604 * 0.57 / 1.57, rel=1e-6)
    # Paraxial light meets on the panel, and the crest's centre of curvature lies t / n over it.
    assert best.index * best.radius / (best.index - 1) == pytest.approx(best.thickness)
    assert best.thickness - best.radius == pytest.approx(best.thickness / best.index)
    assert spread(best) < 1e-7


@given(field=st.floats(40, 75), lpi=st.floats(15, 160))
@settings(deadline=None, max_examples=25)
def test_a_stated_viewing_angle_is_that_of_the_extreme_ray(field, lpi):
    pitch = 25.4 / lpi
    profile = fit_profile(LensArray("lenticular", pitch), thickness=1.56 * pitch, field=field)
    assert extreme_ray_field(profile, pitch) == pytest.approx(field)


def test_a_narrow_lens_has_the_gap_of_a_pinhole():
    assert gap_of(LensProfile(1.0, 3.0, 1.5), LensArray("lenticular", 0.05)) == pytest.approx(2.0, rel=1e-3)
    assert gap_of(fit_profile(SIXTY, thickness=0.6604), SIXTY) == pytest.approx(0.6604 / 1.57 * 0.909, rel=2e-3)


@pytest.mark.parametrize("layout", ["square", "hexagonal"])
def test_micro_lenses_focus_as_cylinders_do(layout):
    """A round crest has the aberration of a cylinder: its best focus is beyond the paraxial one, and so is its gap."""
    profile = fit_profile(LensArray(layout, 0.5), thickness=1.6)
    assert 1.0 < profile.radius / (1.6 * 0.57 / 1.57) < 1.1
    assert 0.9 < gap_of(profile, LensArray(layout, 0.5)) / (1.6 / 1.57) < 1.0


@pytest.mark.parametrize("distance", [150.0, 600.0, math.inf])
def test_an_apparent_pitch_is_that_of_the_micro_images(distance):
    profile, pitch, gap = profile_behind(
        lambda pitch: fit_profile(LensArray("lenticular", pitch), thickness=2.0), 0.8, distance
    )
    assert pitch * (1 + gap / distance) == pytest.approx(0.8, rel=1e-9)
    assert gap == pytest.approx(gap_of(profile, LensArray("lenticular", pitch)), rel=1e-9)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"thickness": 0.6, "radius": 0.3, "field": 50}, "lens.field: radius and field are both given"),
        ({"thickness": 0.6, "field": 5}, "field is 5 degrees; crests on 0.6 mm of index 1.57 have 4"),
        ({"thickness": 0.6, "field": math.nan}, "field is nan"),
        ({"thickness": 0.6, "index": 1.2}, "index is 1.2; it must lie between 1.3 and 2; sheets have 1.49"),
        ({"thickness": 0.6, "conic": 1e9}, "conic is 1e+09; it must lie between -10 and 10"),
        ({"thickness": 0.6, "diameter": 0.5}, "diameter is 0.5 mm; lenses 0.4233 mm apart cannot be wider"),
        ({"thickness": 0.6, "radius": 0.2}, "radius is 0.2 mm; lenses 0.4233 mm wide need more than 0.2117 mm"),
        ({"thickness": 0.1}, "thickness is 0.1 mm; the crest alone is 0.1532 mm high"),
        ({"thickness": 0.1, "radius": 0.22}, "thickness is 0.1 mm; the crest alone is 0.16 mm high"),
        ({"thickness": 0.0}, "thickness is 0.0; it must be a finite length above zero"),
    ],
)
def test_what_cannot_be_is_refused(values, said):
    with pytest.raises(DisplayError) as caught:
        fit_profile(SIXTY, **values)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_sheet_too_thin_for_directions_is_refused():
    with pytest.raises(DisplayError, match="thickness is 0\\.16 mm; behind this crest it forms no image of directions"):
        gap_of(fit_profile(SIXTY, thickness=0.16), SIXTY)
