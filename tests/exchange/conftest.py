"""Displays and pictures for the tests of other tools' layouts."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import strategies as st

from lippmann.display import Display, LensArray, Panel
from lippmann.image import IntegralImage, Provenance

PLACEMENT = np.array([[0.0, 0.0, 2.0, 0.1], [0.0, 2.0, 0.0, -1 / 3], [-2.0, 0.0, 0.0, 7.0], [0.0, 0.0, 0.0, 1.0]])


def make_display(
    layout="square", lenses=(4, 3), pixels=3, *, distance=math.inf, gap=6.0, pixel_pitch=0.25, **lens_array
):
    """``lenses`` (across, down) of ``pixels`` whole pixels; a lenticular sheet has as many rows as a square array."""
    magnification = 1.0 + gap / distance
    height = lenses[1] * pixels
    if layout == "hexagonal":
        row_pixels = max(1, round(0.866 * pixels))
        height = row_pixels * lenses[1]
        lens_array["row_pitch"] = row_pixels * pixel_pitch / magnification
    return Display(
        name=f"test-{layout}",
        panel=Panel(lenses[0] * pixels, height, pixel_pitch),
        lens_array=LensArray(layout, pixels * pixel_pitch / magnification, **lens_array),
        gap=gap,
        viewing_distance=distance,
        aperture_distance=min(5.0, distance / 2),
    )


@st.composite
def make_random_display(draw, layouts=("square", "lenticular")):
    """A small display of whole lenses, or of any lenses that cover whole pixels if other layouts are asked for."""
    return make_display(
        draw(st.sampled_from(layouts)),
        (draw(st.integers(1, 5)), draw(st.integers(1, 4))),
        draw(st.integers(1, 5)),
        distance=draw(st.sampled_from([math.inf, 500.0]) | st.floats(60, 3000)),
        gap=draw(st.floats(0.5, 9)),
        pixel_pitch=draw(st.sampled_from([0.25, 25.4 / 96]) | st.floats(0.02, 0.4)),
    )


def make_image(display, seed=0, *, stored="float32", depth=False, **parts):
    """Random values of that type, some above 1 where it has them, with depth that knows empty places if asked."""
    from lippmann.image.color import dequantize

    random = np.random.default_rng(seed)
    shape = (display.panel.height, display.panel.width)
    if stored.startswith("uint"):
        codes = random.integers(0, np.iinfo(stored).max, (*shape, 3), dtype=stored, endpoint=True)
        pixels = dequantize(codes, parts.get("provenance", Provenance()).transfer)
    else:
        pixels = random.uniform(-0.1, 1.4, (*shape, 3)).astype(stored).astype(np.float32)
    maps = dict(parts.pop("maps", {}))
    if depth:
        reach = min(20.0, display.viewing_distance / 4)
        heights = random.uniform(-reach, reach / 2, shape).astype(np.float32)
        heights[random.uniform(size=shape) < 0.1] = -np.inf
        maps["depth"] = heights
    parts = {
        "world_from_display": PLACEMENT,
        "provenance": Provenance(method="full", scene="Küche 100 %\n= 1", spp=4, seed=3),
        **parts,
    }
    return IntegralImage(pixels, display, maps=maps, stored=stored, **parts)


def assert_same(one, other, *, maps=True):
    """All that a picture is, bit by bit."""
    np.testing.assert_array_equal(one.pixels, other.pixels)
    np.testing.assert_array_equal(one.world_from_display, other.world_from_display)
    assert (one.display, one.provenance, one.stored) == (other.display, other.provenance, other.stored)
    if maps:
        assert one.maps.keys() == other.maps.keys()
        for name, values in one.maps.items():
            np.testing.assert_array_equal(values, other.maps[name])
            assert values.dtype == other.maps[name].dtype


@pytest.fixture(scope="session")
def display():
    """``display(layout, lenses, pixels, distance=..., ...)``: a small display."""
    return make_display


@pytest.fixture(scope="session")
def random_displays():
    """The Hypothesis strategy maker ``random_displays(layouts)``."""
    return make_random_display


@pytest.fixture(scope="session")
def picture():
    """``picture(display, seed, stored=..., depth=...)``: random values with provenance and placement."""
    return make_image


@pytest.fixture(scope="session")
def same():
    """``same(one, other)``: refuses any difference between two pictures."""
    return assert_same
