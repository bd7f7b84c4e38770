"""Corrected pictures: least squares against a plain solver, and judged from directions that were not solved for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse
from eyes import lenses_seen_by

from lippmann.display import load_display
from lippmann.display.panel import RGB_STRIPE
from lippmann.errors import DisplayError
from lippmann.optics.correction import LensCorrection, parts_beside

WIDE = "print:lpi=60,ppi=720,size=36x10mm,thickness=26mil,radius=0.2877mm"
ROWS = 40


def textured(display, x, z=-3.0, period=7.0):
    """Rows of light of a plane behind the display at places ``x`` of it, mm: smooth stripes, and edges."""
    row = np.arange(ROWS)[:, None]
    wave = 0.5 + 0.3 * np.sin(2 * np.pi * (x / (period / (1 + row % 7)) + row * 0.17))
    edge = 0.2 * np.sign(np.sin(2 * np.pi * (x / 2.3 + row * 0.31)))
    return np.clip(wave + np.where(row % 2, edge, 0.0), 0.0, 1.0)


def meant(display, beside, z=-3.0):
    """Part of a pixel's picture: rays from its middle, and to both sides within the part."""
    total = 0.0
    for step in (-0.125, 0.125):
        u = np.arange(display.panel.width) + 0.5 + beside + step
        x, y = display.panel_point(u, 0.0 * u)
        lens, _ = display.lens_of(x, y)
        axis = display.lens_center(lens, 0.0 * lens, x, y)[0]
        total = total + 0.5 * textured(display, axis - display.pinhole_place(x - axis) / display.gap * z)
    return np.repeat(total[..., None], 3, axis=2).astype(np.float32)


@pytest.fixture(scope="module")
def solved():
    display = load_display(WIDE)
    parts = [meant(display, beside) for beside in parts_beside()]
    correction = LensCorrection(display)
    return display, correction, parts, correction.rows(parts)


def error_to_eyes(display, pixels, z=-3.0):
    """Mean squared error over eyes between those that were solved for, of the lenses away from the edge."""
    lenses = np.arange(8.0, display.lens_grid.columns - 8)
    axis = display.lattice.origin_x + lenses * display.lattice.pitch
    errors = []
    for x in (-167.3, -91.1, -33.7, 2.9, 58.3, 121.7, 188.9):
        seen = lenses_seen_by(display, (x, 0.0, 500.0), lenses).gather(pixels[..., 1])
        errors.append(np.mean((seen - textured(display, axis + (x - axis) / 500.0 * z)) ** 2))
    return np.mean(errors)


def test_it_is_the_least_squares_picture(solved):
    display, correction, parts, pixels = solved
    shares, _ = correction._rows._systems[0]
    n, k = np.nonzero(shares.shares)
    entries = shares.shares[n, k], (n, shares.first[n] + k)
    matrix = scipy.sparse.csr_array(entries, shape=(len(shares.first), display.panel.width))
    normal = matrix.T @ matrix
    goal = np.stack([part[..., 0] for part in parts], axis=-1).reshape(ROWS, -1)
    x = np.mean([part[..., 0] for part in parts], axis=0).astype(float)
    start = x.copy()
    # No entry is negative: the largest row sum bounds the largest eigenvalue.
    step = 1.0 / normal.sum(axis=1).max()
    for _ in range(400):
        x = np.clip(x - step * (x @ normal - goal @ matrix), 0.0, 1.0)

    def error(picture):
        return np.mean((picture @ matrix.T - goal) ** 2)

    assert error(pixels[..., 0]) < error(start) - 0.9 * (error(start) - error(x))
    assert pixels.min() >= 0.0
    assert pixels.max() <= 1.0


def test_eyes_that_were_not_solved_for_see_what_is_meant_better(solved):
    display, _, parts, pixels = solved
    before = error_to_eyes(display, np.mean(parts, axis=0))
    assert 10 * np.log10(before / error_to_eyes(display, pixels)) > 0.7


@pytest.mark.parametrize("changed", ["radius", "thickness", "index"])
def test_a_lens_that_is_three_percent_off_loses_little(solved, changed):
    display, _, parts, pixels = solved
    for factor in (0.97, 1.03):
        other = replace(display, lens=replace(display.lens, **{changed: factor * getattr(display.lens, changed)}))
        gain = error_to_eyes(other, np.mean(parts, axis=0)) / error_to_eyes(other, pixels)
        assert 10 * np.log10(gain) > -0.3


def test_it_tells_what_it_gains(solved):
    _, correction, parts, _ = solved
    step = correction.step([(0, [parts])])
    assert step.share > 0.9
    assert step.gains["exact"] > max(step.gains[name] for name in ("radius", "thickness", "index"))
    options, note = step.describe(0.25)
    assert options["correction_gain_exact"] == step.gains["exact"]
    assert f"{step.gains['exact']:+.1f} dB in the directions solved for" in note


def noisy_halves(parts, noise, seed):
    rng = np.random.default_rng(seed)
    return [[(part + noise * rng.standard_normal(part.shape)).astype(np.float32) for part in parts] for _ in range(2)]


def test_noise_alone_is_not_sharpened(solved):
    _, correction, parts, _ = solved
    halves = noisy_halves([np.full_like(part, 0.5) for part in parts], 0.02, 5)
    step = correction.step([(0, halves)])
    assert step.share < 0.1
    pixels = correction.rows(np.mean(halves, axis=0), share=0.0)
    np.testing.assert_allclose(pixels, np.mean(halves, axis=(0, 1)), atol=1e-6)
    assert "not corrected for its lens" in replace(step, share=0.0).describe(0.0)[1]


def test_the_step_is_that_of_least_mean_error_over_lenses_three_percent_off(solved):
    display, correction, parts, _ = solved
    halves = noisy_halves(parts, 0.08, 6)
    step = correction.step([(0, halves)])
    mean = np.clip(np.mean(halves, axis=0), 0.0, 1.0)
    shares = np.linspace(0.0, 1.0, 21)
    ends = [correction.rows(mean, share=share) for share in (0.0, 1.0)]
    meant = correction._rows.light_meant(np.stack(parts), 0)

    def errors_to_eyes(display):
        plain, whole = correction._rows.eyes(display)(ends, 0)
        return np.array([np.mean((plain + share * (whole - plain) - meant) ** 2) for share in shares])

    exact = errors_to_eyes(display)
    errors = np.zeros(len(shares))
    for name in ("radius", "thickness", "index"):
        for factor in (0.97, 1.03):
            other = replace(display, lens=replace(display.lens, **{name: factor * getattr(display.lens, name)}))
            errors += errors_to_eyes(other)
    assert 0.1 < step.share < 0.9
    assert step.share == pytest.approx(shares[np.argmin(errors)], abs=0.05)
    assert step.share != pytest.approx(shares[np.argmin(exact)], abs=0.05)
    told = 10.0 * np.log10(exact[0] / np.interp(step.share, shares, exact))
    assert step.gains["exact"] == pytest.approx(told, abs=0.1)
    # As samples are solved for by themselves, one half alone believes in more than there is.
    assert correction.step([(0, [list(mean)])]).gains["exact"] > step.gains["exact"] + 0.2


def test_light_beyond_white_is_white(solved):
    _, correction, parts, _ = solved
    bright = correction.rows([np.full_like(part, 3.0) for part in parts])
    np.testing.assert_allclose(bright[:, 20:-20], 1.0, atol=1e-3)


@pytest.mark.parametrize(("name", "what"), [("seed-lenticular", "gives no lens"), ("cells", "cannot be corrected")])
def test_other_displays_are_refused(name, what):
    display = load_display(WIDE if name == "cells" else name)
    if name == "cells":
        display = replace(display, panel=replace(display.panel, subpixel_cells=((RGB_STRIPE, RGB_STRIPE),)))
    with pytest.raises(DisplayError, match=what):
        LensCorrection(display)


def checks(display):
    """Black and white fields, which leave a correction no room."""
    rows, columns = np.indices((ROWS, display.panel.width)) // 10
    return np.repeat(((rows + columns) % 2).astype(np.float32)[..., None], 3, axis=2)


@pytest.fixture(scope="module")
def roomy():
    return LensCorrection(load_display(WIDE), headroom=0.1)


def test_headroom_lets_pixels_take_the_light_of_their_neighbours_away(solved, roomy):
    display, tight, _, _ = solved
    parts = [checks(display)] * len(parts_beside())
    steps = [correction.step([(0, [parts])]) for correction in (tight, roomy)]
    assert steps[1].gains["exact"] > steps[0].gains["exact"] + 0.5
    limited = [np.mean((pixels <= 0.0) | (pixels >= 1.0)) for pixels in (tight.rows(parts), roomy.rows(parts))]
    assert limited[1] < 0.7 * limited[0]
    assert "headroom of 0.1" in steps[1].describe(limited[1])[1]


def test_light_with_headroom_is_that_without_nearer_to_grey(solved, roomy):
    _, correction, parts, _ = solved
    np.testing.assert_allclose(roomy.rows(parts, 0, 0.0), 0.1 + 0.8 * correction.rows(parts, 0, 0.0), atol=1e-6)
