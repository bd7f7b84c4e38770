"""Displays and pictures for the tests of pictures and their files."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import strategies as st

from lippmann.display import Display, LensArray, Panel
from lippmann.image import IntegralImage, Provenance

#: A turn by 90 degrees about y, twice as large, moved: no entry of it is like another by chance.
PLACEMENT = np.array([[0.0, 0.0, 2.0, 0.1], [0.0, 2.0, 0.0, -1 / 3], [-2.0, 0.0, 0.0, 7.0], [0.0, 0.0, 0.0, 1.0]])

PROVENANCE = Provenance(
    method="full",
    integrator="path",
    depth=8,
    spp=64,
    seed=2**32 - 1,
    subpixels=True,
    scene='Küche "1"\n',
    version="0.1.0",
    device="cpu",
    traced_fraction=0.19,
    rays={"primary": 16777216, "shadow": 2**40},
    options={"filter": "box", "nested": [1, [2.5, None, True]]},
    notes=("a scene without lights", "größer"),
)


@st.composite
def make_random_display(draw, *, whole=None):
    """A display of at most 24 x 16 pixels; with ``whole`` a whole number of pixels lies from lens to lens."""
    layout = draw(st.sampled_from(["lenticular", "square", "hexagonal"]))
    whole = draw(st.booleans()) if whole is None else whole
    width, height = draw(st.integers(1, 24)), draw(st.integers(1, 16))
    most = width if layout == "lenticular" else min(width, height)
    pixels = draw(st.integers(1, most) if whole else st.floats(1, most) | st.integers(2, 2 * most).map(lambda n: n / 2))
    distance = draw(st.sampled_from([math.inf, 500.0]) | st.floats(80, 2000))
    gap, pixel_pitch = draw(st.floats(0.5, 9)), draw(st.sampled_from([0.25, 25.4 / 96]) | st.floats(0.02, 0.4))
    magnification = (distance + gap) / distance if math.isfinite(distance) else 1.0
    slant = draw(st.just(0.0) | st.sampled_from([9.46, -45.0]) | st.floats(-70, 70)) if layout == "lenticular" else 0.0
    row_pixels = None
    if layout == "hexagonal":
        low = max(1.0, 0.5001 * pixels)
        row_pixels = draw(st.integers(math.ceil(low), max(math.ceil(low), height)) if whole else st.floats(low, height))
        height = max(height, math.ceil(row_pixels))
    offset = draw(st.none() | st.tuples(st.floats(-3, 3), st.floats(-3, 3)))
    scale = pixel_pitch / magnification
    return Display(
        name="random",
        panel=Panel(width, height, pixel_pitch),
        lens_array=LensArray(
            layout,
            pixels * scale * math.cos(math.radians(slant)),
            slant=slant,
            offset=offset,
            row_pitch=None if row_pixels is None else row_pixels * scale,
        ),
        gap=gap,
        viewing_distance=distance,
    )


def make_picture(display, seed=0, **parts):
    """Random values, some of them brighter than 1, with everything that a picture can carry but maps."""
    panel = display.panel
    pixels = np.random.default_rng(seed).uniform(0, 1.2, (panel.height, panel.width, 3)).astype(np.float32)
    parts = {"world_from_display": PLACEMENT, "provenance": PROVENANCE, **parts}
    return IntegralImage(pixels, display, **parts)


@pytest.fixture(scope="session")
def display(make_display):
    """``display(layout, lenses, pixels, ...)``: a small display of whole lenses."""
    return make_display


@pytest.fixture(scope="session")
def random_displays():
    """The Hypothesis strategy maker ``random_displays(whole=...)``."""
    return make_random_display


@pytest.fixture(scope="session")
def picture():
    """``picture(display, ...)``: random pixels with provenance and placement."""
    return make_picture


@pytest.fixture(scope="session")
def provenance():
    """A provenance with every field set."""
    return PROVENANCE
