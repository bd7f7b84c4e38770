"""Displays and pictures for the tests of other tools' layouts."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import strategies as st

from lippmann.image import IntegralImage, Provenance

PLACEMENT = np.array([[0.0, 0.0, 2.0, 0.1], [0.0, 2.0, 0.0, -1 / 3], [-2.0, 0.0, 0.0, 7.0], [0.0, 0.0, 0.0, 1.0]])


def make_image(display, seed=0, *, stored="float32", depth=False, **parts):
    """Random values of that type, some above 1 where it has them, with depth that knows empty places if asked."""
    from lippmann.color.transfer import dequantize

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
def display(make_display):
    """``display(layout, lenses, pixels, distance=..., ...)``: a small display, a square array unless told."""

    def make(layout="square", *sizes, **options):
        return make_display(layout, *sizes, **{"gap": 6.0, **options})

    return make


@pytest.fixture(scope="session")
def random_displays(make_display):
    """The Hypothesis strategy maker ``random_displays(layouts)``."""

    @st.composite
    def make(draw, layouts=("square", "lenticular")):
        """A small display of whole lenses, or of any lenses that cover whole pixels if other layouts are asked for."""
        return make_display(
            draw(st.sampled_from(layouts)),
            (draw(st.integers(1, 5)), draw(st.integers(1, 4))),
            draw(st.integers(1, 5)),
            distance=draw(st.sampled_from([math.inf, 500.0]) | st.floats(60, 3000)),
            gap=draw(st.floats(0.5, 9)),
            pixel_pitch=draw(st.sampled_from([0.25, 25.4 / 96]) | st.floats(0.02, 0.4)),
        )

    return make


@pytest.fixture(scope="session")
def picture():
    """``picture(display, seed, stored=..., depth=...)``: random values with provenance and placement."""
    return make_image


@pytest.fixture(scope="session")
def same():
    """``same(one, other)``: refuses any difference between two pictures."""
    return assert_same
