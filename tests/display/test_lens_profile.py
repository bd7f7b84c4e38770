"""Profiles of lenses: sags, and what cannot stand side by side."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from lippmann.display import Display, load_display
from lippmann.display.lens_array import LensArray
from lippmann.display.lens_profile import LensProfile
from lippmann.errors import DisplayError
from lippmann.optics.lens import Lens

SQUARE, HEXAGONAL, CYLINDERS = (LensArray(layout, 1.0) for layout in ("square", "hexagonal", "lenticular"))


def test_sags_by_hand():
    assert LensProfile(5.0, 9.0).sag(3.0) == pytest.approx(1.0)  # a circle: 3, 4, 5
    assert LensProfile(2.0, 9.0, conic=-1.0).sag(2.0) == pytest.approx(1.0)  # a parabola: x^2 / 2R
    # A hyperbola x^2 = 2 R h + h^2: x = sqrt(2.25) for R = 0.625, h = 1.
    assert LensProfile(0.625, 9.0, conic=-2.0).sag(1.5) == pytest.approx(1.0)


def test_crests_reach_to_where_lenses_meet():
    profile = LensProfile(2.0, 4.0)
    assert profile.reach(CYLINDERS) == 0.5
    assert profile.reach(SQUARE) == pytest.approx(math.sqrt(0.5))
    assert profile.reach(HEXAGONAL) == pytest.approx(1 / math.sqrt(3))
    assert replace(profile, diameter=0.8).reach(SQUARE) == 0.4


@pytest.mark.parametrize(
    ("lenses", "values", "said"),
    [
        (CYLINDERS, {"radius": 0.5}, "lens.radius: radius is 0.5 mm; lenses 1 mm wide need more than 0.5 mm"),
        (SQUARE, {"radius": 0.7}, "lenses 1.414 mm wide need more than 0.7071 mm"),
        (CYLINDERS, {"radius": 0.6, "conic": 1.0}, "need more than 0.7071 mm; sheets have 0.53 to 1.7 pitches"),
        (
            CYLINDERS,
            {"thickness": 0.06},
            "thickness is 0.06 mm; the crest alone is 0.06351 mm high",
        ),
        (CYLINDERS, {"diameter": 1.1}, "diameter is 1.1 mm; lenses 1 mm apart cannot be wider than that"),
        (CYLINDERS, {"index": math.nan}, "index is nan; it must lie between 1.3 and 2"),
        (CYLINDERS, {"index": True}, "index is True"),
        (CYLINDERS, {"conic": -11}, "conic is -11; it must lie between -10 and 10; crests have -1 (parabola) to 0"),
        (CYLINDERS, {"radius": math.inf}, "radius is inf"),
        (CYLINDERS, {"radius": 1e300}, "radius is 1e+300; it must lie between 1e-09 and 1e+12 mm"),
        (CYLINDERS, {"thickness": 120.0}, "thickness is 120 mm; 100 mm is the most; sheets are 1.2 to 4 pitches thick"),
        (CYLINDERS, {"thickness": "2 mm"}, "thickness is '2 mm'"),
        (CYLINDERS, {"radius": math.nan}, "it must be a finite length above zero; sheets have 0.53 to 1.7 pitches"),
    ],
)
def test_what_cannot_be_is_refused(lenses, values, said):
    with pytest.raises(DisplayError) as caught:
        LensProfile(**{"radius": 2.0, "thickness": 4.0, **values}).check(lenses)
    assert said in str(caught.value)


def test_a_display_checks_its_lens_and_keeps_it():
    display = load_display("seed-lenticular")
    with pytest.raises(DisplayError, match="need more than"):
        replace(display, lens=LensProfile(1.0, 10.0))
    with_lens = replace(display, lens=LensProfile(3.0, 10.0, 1.5, -0.4, 2.0))
    assert Display.from_dict(with_lens.to_dict()) == with_lens
    assert with_lens.in_words()["lens"] == "10 mm thick, index 1.5, crest radius 3 mm, conic -0.4"
    # A pinhole is written as it always was.
    assert "lens" not in display.to_dict()
    assert "lens" not in display.in_words()


#: Even points of the square, ``s`` and ``t``.
SQUARE_POINTS = tuple(each.ravel() for each in np.meshgrid(*(2 * [(np.arange(60) + 0.5) / 60]), indexing="ij"))


def with_lens(name, diameter=None):
    """A preset with a lens of so many pitches."""
    display = load_display(name)
    pitch = display.lens_array.pitch
    lens = LensProfile(3.0 * pitch, 4.0 * pitch, diameter=None if diameter is None else diameter * pitch)
    return replace(display, lens=lens)


def test_points_of_cylinders_and_square_lenses_fill_them_across_the_way_of_the_pixel():
    s, t = SQUARE_POINTS
    assert load_display("mla-square").aperture_point(s, t) == (0.0, 0.0)
    for name, diameter, high in (("panel-4k", None, 0.0), ("panel-4k", 0.5, 0.0), ("mla-square", None, 1.0)):
        display = with_lens(name, diameter)
        right, up = display.aperture_point(s, t)
        pitch = display.lens_array.pitch
        across, along = display.lattice.across(right, up), display.lattice.along(right, up)
        np.testing.assert_allclose(across, (t - 0.5) * (diameter or 1.0) * pitch, atol=1e-12)
        np.testing.assert_allclose(along, (s - 0.5) * high * pitch, atol=1e-12)


def test_points_of_a_hexagonal_lens_are_those_that_its_light_table_is_made_of():
    display = with_lens("mla-hexagonal")
    points, expected = display.aperture_point(*SQUARE_POINTS), Lens.of(display).samples(60)
    for mine, other in zip(points, expected, strict=True):
        np.testing.assert_allclose(np.sort(mine), np.sort(other), atol=1e-9)
    assert np.abs(points[1]).max() > 0.5 * display.lens_array.row_spacing


@pytest.mark.parametrize("name", ["mla-square", "mla-hexagonal"])
def test_points_of_a_round_lens_cover_its_disc_evenly(name):
    display = with_lens(name, 0.8)
    radius = 0.4 * display.lens_array.pitch
    x, y = np.array(display.aperture_point(*SQUARE_POINTS)) / radius
    r = np.hypot(x, y)
    assert r.max() <= 1.0 + 1e-12
    # Rings and sectors of one area hold as many points each.
    rings = np.histogram(r**2, bins=5, range=(0.0, 1.0))[0]
    sectors = np.histogram(np.arctan2(y, x), bins=8, range=(-math.pi, math.pi))[0]
    np.testing.assert_allclose(rings, len(r) / 5, rtol=0.13)
    np.testing.assert_allclose(sectors, len(r) / 8, rtol=0.13)
    # Across the way of the pixel, as in all lenses: the middle column and row of the square are diameters.
    np.testing.assert_allclose(display.aperture_point(0.5, 0.9), (0.8 * radius, 0.0), atol=1e-12)
    np.testing.assert_allclose(display.aperture_point(0.9, 0.5), (0.0, 0.8 * radius), atol=1e-12)
