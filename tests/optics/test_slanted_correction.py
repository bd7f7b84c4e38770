"""Corrected pictures of slanted panels, as eyes see them that were not solved for: by the light of replays."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lippmann.display import NUMPY, load_display
from lippmann.errors import DisplayError
from lippmann.image import IntegralImage
from lippmann.optics.correction import LensCorrection, parts_beside
from lippmann.viewing.optical_replay import replay_optics

#: A 4K panel behind an acrylic sheet.
PANEL = Path(__file__).parents[2] / "benchmarks" / "slanted_panel.toml"

EYES = (-171.0, -83.0, 13.0, 158.0)


def light(x, y):
    """Light of a point of a plane: smooth stripes of several widths, and edges."""
    waves = sum(
        0.11 * np.sin(2 * np.pi * (a * x + b * y) + c) for a, b, c in ((0.9, 0.2, 0), (0.5, -0.7, 1), (1.6, 0.4, 2))
    )
    return np.clip(0.5 + waves + 0.2 * np.sign(np.sin(1.3 * x + 0.6 * y)), 0.0, 1.0)


def along_rays(display, x, y, z=-3.0):
    """Light that panel points are meant to show of a plane."""
    origin, way = display.light_ray(x, y, NUMPY)
    far = (z - origin[2]) / way[2]
    return light(origin[0] + far * way[0], origin[1] + far * way[1])


def meant(display, beside):
    u, v = np.meshgrid(np.arange(display.panel.width) + 0.5, np.arange(display.panel.height) + 0.5)
    colors = []
    for channel in range(3):
        right, down = display.panel.subpixel_offsets[channel]
        places = [(a, b) for a in (-0.08, 0.08) for b in (-0.25, 0.25)]
        rays = [
            along_rays(display, *display.panel_point(u + right + beside + a, v + down + b), z=-3.0) for a, b in places
        ]
        colors.append(np.mean(rays, axis=0))
    return np.stack(colors, axis=-1).astype(np.float32)


def seen(display, pixels, eye, rows):
    """Light of lenses, windows of ``rows`` rows, over that of a white panel."""
    size = (2 * display.lens_grid.columns, display.panel.height // rows)
    pictures = [
        replay_optics(IntegralImage(np.ascontiguousarray(each), display), (eye, 20.0, 600.0), size=size, pupil=0.0)
        for each in (pixels, np.ones_like(pixels))
    ]
    return pictures[0] / np.maximum(pictures[1], 1e-3)


def truth(display, eye, rows):
    """Light that the eye is meant to see of the same lenses and rows."""
    width, height = 2 * display.lens_grid.columns, display.panel.height // rows
    u = (np.arange(width) + 0.5) * (display.panel.width / width)
    v = (np.arange(height) + 0.5) * (display.panel.height / height)
    lines = []
    for step in (np.arange(12) + 0.5) / 12 - 0.5:
        x, y = display.panel_point(*np.meshgrid(u, v))
        place = display.visible_panel_point(eye, 20.0, 600.0, x, y, NUMPY)
        # A row below lies under the same lens.
        down = -step * rows * display.panel.pixel_pitch
        right = down * np.tan(np.radians(display.lens_array.slant))
        lines.append(along_rays(display, place[0] + right, place[1] + down))
    return np.mean(lines, axis=0)[..., None]


def decibels(display, pixels, rows=6):
    """PSNR to all eyes, away from the panel's edges."""
    inside = np.s_[1:-1, 8:-8]
    errors = [np.mean((seen(display, pixels, eye, rows) - truth(display, eye, rows))[inside] ** 2) for eye in EYES]
    return -10 * np.log10(np.mean(errors))


@pytest.fixture(scope="module")
def panel():
    return load_display(PANEL).resized(120, 60)


@pytest.fixture(scope="module")
def solved(panel):
    display = panel
    parts = [meant(display, beside) for beside in parts_beside()]
    correction = LensCorrection(display, subpixels=True)
    return display, correction, parts, meant(display, 0.0), correction.rows(parts)


@pytest.mark.parametrize("rows", [6, pytest.param(12, marks=pytest.mark.long), 10])
def test_eyes_see_what_is_meant_better(solved, rows):
    display, _, _, plain, corrected = solved
    gain = decibels(display, corrected, rows) - decibels(display, plain, rows)
    assert gain > 1.0


@pytest.mark.parametrize("slant", [14.04, pytest.param(-14.04, marks=pytest.mark.long)])
def test_lenses_that_cross_a_pixel_in_other_rows_gain_too(panel, slant):
    display = replace(panel, lens_array=replace(panel.lens_array, slant=slant))
    corrected = LensCorrection(display, subpixels=True).rows([meant(display, beside) for beside in parts_beside()])
    plain = meant(display, 0.0)
    assert min(decibels(display, corrected, rows) - decibels(display, plain, rows) for rows in (6, 10)) > 0.4


def test_hardly_slanted_lenses_are_refused(panel):
    display = replace(panel, lens_array=replace(panel.lens_array, slant=2.0))
    with pytest.raises(DisplayError, match="within 16 rows"):
        LensCorrection(display, subpixels=True)


@pytest.mark.parametrize(
    "name", ["thickness", *(pytest.param(name, marks=pytest.mark.long) for name in ("radius", "index"))]
)
def test_a_lens_that_is_three_percent_off_loses_nothing(solved, name):
    display, _, _, plain, corrected = solved
    for factor in (0.97, 1.03):
        there = replace(display, lens=replace(display.lens, **{name: factor * getattr(display.lens, name)}))
        assert decibels(there, corrected) - decibels(there, plain) > -0.3


def test_even_light_stays_even(solved):
    _, correction, parts, _, _ = solved
    pixels = correction.rows([np.full_like(part, 0.5) for part in parts])
    np.testing.assert_allclose(pixels[:, 20:-20], 0.5, atol=0.02)


def test_rows_with_others_about_them_are_those_of_the_whole_picture(solved):
    _, correction, parts, _, corrected = solved
    margin = correction.margin
    some = correction.rows([part[20 - margin : 40 + margin] for part in parts], 20 - margin)[margin:-margin]
    assert np.abs(some - corrected[20:40]).max() < 0.02


def test_it_tells_what_it_gains(solved):
    _, correction, parts, _, _ = solved
    step = correction.step([(5, [[part[5:60] for part in parts]])])
    assert step.share > 0.8
    assert step.gains["exact"] > 0.8


def test_the_gain_of_noisy_light_is_that_against_light_without_noise(solved):
    _, correction, parts, _, _ = solved
    rng = np.random.default_rng(7)
    halves = [[(part + 0.1 * rng.standard_normal(part.shape)).astype(np.float32) for part in parts] for _ in range(2)]
    step = correction.step([(0, halves)])
    mean = np.clip(np.mean(halves, axis=0), 0.0, 1.0)
    pictures = [correction.rows(mean, share=share) for share in (0.0, step.share)]
    goal, lights = (
        correction._rows.light_meant(np.stack(parts), 0),
        correction._rows.eyes(correction.display)(pictures, 0),
    )
    plain, stepped = (np.nanmean((light - goal) ** 2) for light in lights)
    assert step.gains["exact"] == pytest.approx(10.0 * np.log10(plain / stepped), abs=0.2)
