"""Crosstalk and independent directions of prints and slanted panels."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lippmann.display import load_display
from lippmann.display.pixel_aperture import PixelAperture
from lippmann.optics.crosstalk import ANNOYING, VISIBLE, crosstalk, independent_directions, most_strips

#: 26 mil of index 1.57, with the crest of paraxial focus and those that are 10 and 20 % flatter.
PARAXIAL, BEST, FLAT = (
    load_display(f"print:lpi=60,ppi=720,size=50x30mm,viewing-distance=infinite,thickness=26mil,radius={radius}mm")
    for radius in (0.239764, 0.263741, 0.287717)
)


@pytest.mark.parametrize(
    ("strips", "shares"),
    [(6, (0.12, 0, 0)), (12, (0.26, 0.01, 0.20)), (16, (0.32, 0.04, 0.56)), (24, (0.39, 0.08, 0.74))],
)
def test_other_strips_give_the_shares_of_the_prototype(strips, shares):
    for display, share in zip((PARAXIAL, BEST, FLAT), shares, strict=True):
        assert crosstalk(display, 0.0, strips) == pytest.approx(share, abs=0.006)
    # A print of 12 pixels a lens has 12 strips.
    if strips == 12:
        assert crosstalk(BEST, 0.0) == pytest.approx(crosstalk(BEST, 0.0, 12), abs=1e-9)


def test_left_and_right_are_alike_and_the_side_is_worse():
    assert crosstalk(BEST, 0.3) == pytest.approx(crosstalk(BEST, -0.3), abs=1e-6)
    assert crosstalk(BEST, 0.3) > crosstalk(BEST, 0.15) > crosstalk(BEST, 0.0)


def test_an_ideal_lens_over_strips_has_none():
    assert crosstalk(load_display("seed-lenticular"), 0.1) == 0.0
    assert independent_directions(load_display("seed-lenticular")) == pytest.approx(8)
    assert independent_directions(load_display("mla-square")) == pytest.approx(15)


def test_ink_that_runs_gives_its_neighbours_light():
    """Of a strip blurred by a Gaussian an eye in its middle sees erf(w / (2 sqrt 2 sigma)) of itself."""
    pinhole = replace(BEST, lens=None, pixel=PixelAperture(blur=0.5 * BEST.panel.pixel_pitch))
    assert crosstalk(pinhole, 0.0) == pytest.approx(1 - 0.682689, abs=1e-3)
    assert crosstalk(replace(BEST, pixel=pinhole.pixel), 0.0) > crosstalk(pinhole, 0.0)


def test_dark_lines_keep_directions_apart():
    dark = replace(BEST, pixel=PixelAperture(width=0.5 * BEST.panel.pixel_pitch))
    assert crosstalk(dark, 0.1) < crosstalk(BEST, 0.1)


def test_a_slanted_panel_overlaps_by_the_ramps_of_its_trapezoid():
    """Beyond half the half-height width on both sides lie two triangles, a quarter of the ramps."""
    panel = load_display("panel-4k")
    pixel = panel.panel.pixel_pitch
    ramp = pixel * 0.164333  # of a trapezoid 0.328798 wide at half height: sin 9.46 degrees
    assert crosstalk(panel, 0.0) == pytest.approx(0.25 * ramp / (0.328798 * pixel), abs=1e-3)
    assert independent_directions(panel) == pytest.approx(panel.micro_image_pitch / (0.328798 * pixel), rel=1e-4)


def test_most_strips_keep_to_the_mark():
    for display in (PARAXIAL, FLAT):
        for limit in (VISIBLE, ANNOYING):
            strips = most_strips(display, limit)
            assert crosstalk(display, 0.0, strips) <= limit < crosstalk(display, 0.0, strips + 1)
    assert most_strips(PARAXIAL) < 6 < most_strips(FLAT) < 12 < most_strips(BEST)


def test_a_blurred_lens_tells_fewer_directions_apart():
    assert independent_directions(BEST) == pytest.approx(12, abs=0.1)
    assert independent_directions(FLAT) < 10
