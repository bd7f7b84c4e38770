"""Random displays of every kind, for property tests."""

from __future__ import annotations

import math

import pytest
from hypothesis import strategies as st

from lippmann.display import Display, LensArray, Panel
from lippmann.display.lens_array import LAYOUTS

DISTANCES = st.sampled_from([math.inf, 1000.0, 300.0]) | st.floats(60, 3000)


@st.composite
def random_displays(draw, layouts=LAYOUTS, aligned=None, viewing_distances=DISTANCES):
    """A display of at most 40x30 pixels: whole and broken pixels per lens, one lens or many, one view or many.

    With ``aligned`` lenses cover whole pixels and, except hexagonal ones, whole lenses the panel.
    """
    layout = draw(st.sampled_from(layouts))
    gap = draw(st.floats(0.5, 10))
    viewing_distance = draw(viewing_distances)
    pixel_pitch = draw(st.sampled_from([0.25, 25.4 / 96, 0.1, 25.4 / 720]) | st.floats(0.02, 0.5))
    magnification = (viewing_distance + gap) / viewing_distance if math.isfinite(viewing_distance) else 1.0
    whole = draw(st.booleans()) if aligned is None else aligned
    steps = st.integers(-500, 500).map(lambda step: step / 100)
    slant, offset, row_pixels = 0.0, None, None
    if whole:
        pixels, columns, rows = draw(st.integers(1, 8)), draw(st.integers(1, 5)), draw(st.integers(1, 4))
        height = draw(st.integers(1, 30)) if layout == "lenticular" else pixels * rows
        if layout == "hexagonal":
            row_pixels = max(1, round(pixels * 0.866))
            height = row_pixels * rows
        width = pixels * columns
    else:
        width, height = draw(st.integers(1, 40)), draw(st.integers(1, 30))
        most = width if layout == "lenticular" else min(width, height)
        # With half pixels every other boundary hits a pixel's centre.
        pixels = draw(st.integers(2, 2 * most).map(lambda halves: halves / 2) | st.floats(1, most))
        if layout == "lenticular":
            slant = draw(st.sampled_from([0.0, 9.46, -18.43, 45.0]) | st.floats(-79, 79))
        if draw(st.booleans()):
            offset = draw(st.tuples(steps, steps))
        if layout == "hexagonal":
            row_pixels = draw(st.none() | st.floats(max(1.0, 0.5001 * pixels), float(height)))
            if row_pixels is None and not 1 <= pixels * math.sqrt(3) / 2 <= height:
                row_pixels = min(max(1.0, 0.5001 * pixels), float(height))
    pitch = pixels * pixel_pitch / magnification * math.cos(math.radians(slant))
    row_pitch = None if row_pixels is None else row_pixels * pixel_pitch / magnification
    return Display(
        name="random",
        panel=Panel(width, height, pixel_pitch),
        lens_array=LensArray(layout, pitch, slant=slant, offset=offset, row_pitch=row_pitch),
        gap=gap,
        viewing_distance=viewing_distance,
        aperture_distance=draw(st.floats(0, 50)),
    )


@pytest.fixture(scope="session")
def displays():
    """The strategy maker: ``displays(layouts=..., aligned=..., viewing_distances=...)``."""
    return random_displays
