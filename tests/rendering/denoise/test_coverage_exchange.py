"""Outlines by all rays: no bias, less noise, and nothing elsewhere."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import lippmann
from lippmann.color.transfer import encode_srgb
from lippmann.rendering.denoise.dual_buffer import correct_coverage
from lippmann.rendering.film.wavefront import Coverage

HEIGHT, WIDTH = 12, 20


def edge():
    """Share of each pixel that a slanting edge covers."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    return np.clip((x - 6 - 0.4 * y) / 1.7 + 0.5, 0, 1)


def sampled(random, share, samples):
    found = random.binomial(samples, share) / samples
    return Coverage(found[..., None].astype(np.float32), samples)


SURFACE, BEHIND = np.float32([0.1, 0.3, 0.2]), np.float32([0.8, 0.9, 1.5])


def picture(random, paths, noise=0.1):
    """What so much of either side shows, the surface with noise."""
    of_surface = paths.share * (SURFACE + noise * random.normal(size=(HEIGHT, WIDTH, 3)))
    return (of_surface + (1 - paths.share) * BEHIND).astype(np.float32)


@pytest.mark.parametrize("samples", [1, 2, 8])
def test_no_bias_and_less_noise(samples):
    random = np.random.default_rng(samples)
    share = edge()
    truth = share[..., None] * SURFACE + (1 - share[..., None]) * BEHIND
    before, after = [], []
    for _ in range(600):
        paths, further = sampled(random, share, samples), sampled(random, share, 8)
        noisy = picture(random, paths)
        before.append(noisy - truth)
        after.append(correct_coverage(noisy, paths, further) - truth)
    before, after = np.array(before), np.array(after)
    deviation = np.maximum(after.std(axis=0), 1e-4) / np.sqrt(len(after))
    assert np.abs(after.mean(axis=0) / deviation).max() < 4.8  # of 720 values
    mixed = (share > 0.1) & (share < 0.9)
    assert np.square(after[:, mixed]).mean() < {1: 0.35, 2: 0.5, 8: 0.75}[samples] * np.square(before[:, mixed]).mean()
    # Where a side is alone, nothing is done.
    assert np.array_equal(after[:, share == 0], before[:, share == 0])


def test_pixels_without_both_sides_around_stay():
    """There nothing is known of what is lacking."""
    pixels = np.full((5, 5, 3), 0.5, np.float32)
    paths = Coverage(np.ones((5, 5, 1), np.float32), 2)
    further = Coverage(np.full((5, 5, 1), 0.5, np.float32), 8)
    assert np.array_equal(correct_coverage(pixels, paths, further), pixels)
    half = Coverage(np.full((5, 5, 1), 0.4, np.float32), 5)
    np.testing.assert_allclose(correct_coverage(pixels, half, further), pixels, rtol=1e-6)


def test_highlights_around_count_as_white():
    """One of a hundred times white beside an edge is not the colour of the surface."""
    pixels = np.full((3, 3, 3), 0.2, np.float32)
    share = np.ones((3, 3, 1), np.float32)
    share[:, 0] = 0
    share[1, 1] = 0.5
    pixels[0, 2] = 100
    lit = correct_coverage(pixels, Coverage(share, 2), Coverage(np.ones((3, 3, 1), np.float32), 8))
    assert 0.2 < lit[1, 1].max() < 1
    assert (lit >= 0).all()


def test_a_surface_that_is_beyond_white_all_around_covers_by_that():
    """A tenth of five times white is mid-grey, not a tenth of white."""
    pixels = np.full((3, 6, 3), 5.0, np.float32)
    share = np.ones((3, 6, 1), np.float32)
    pixels[:, :3], share[:, :3] = 0.1, 0
    further = share.copy()
    further[1, 2] = 0.1
    found = correct_coverage(pixels, Coverage(share, 2), Coverage(further, 10**6))
    assert found[1, 2] == pytest.approx(np.full(3, 0.1 + 0.1 * 4.9), rel=1e-3)
    found[1, 2] = 0.1
    assert np.array_equal(found, pixels)


def test_each_sub_pixel_by_its_own_rays():
    pixels = np.zeros((3, 3, 3), np.float32)
    pixels[:, 2] = 0.8
    share = np.zeros((3, 3, 3), np.float32)
    share[:, 2] = 1
    share[1, 1] = 0.5
    pixels[1, 1] = 0.4
    further = share.copy()
    further[1, 1] = [0.0, 0.5, 1.0]
    found = correct_coverage(pixels, Coverage(share, 2), Coverage(further, 6))
    assert found[1, 1] == pytest.approx([0.1, 0.4, 0.7], abs=1e-5)
    found[1, 1] = pixels[1, 1]
    assert np.array_equal(found, pixels)


def by_coverage_pixel_by_pixel(pixels, paths, further):
    """The specification, in plain words."""
    result = pixels.astype(np.float64)
    share = paths.share.mean(axis=2)
    total = paths.samples + further.samples
    for row, column in np.ndindex(share.shape):
        of_all = (paths.samples * paths.share[row, column] + further.samples * further.share[row, column]) / total
        near = [
            (r, c)
            for r in range(max(0, row - 1), min(share.shape[0], row + 2))
            for c in range(max(0, column - 1), min(share.shape[1], column + 2))
            if (r, c) != (row, column)
        ]
        sides, colors = [], np.array([pixels[p] for p in near])
        for weights in ([share[p] ** 4 for p in near], [(1 - share[p]) ** 4 for p in near]):
            if sum(weights) < 0.05:
                break
            mean = np.average(colors, axis=0, weights=weights)
            deviation = np.sqrt(np.average((colors - mean) ** 2, axis=0, weights=weights))
            seen = np.average(np.minimum(colors, 1), axis=0, weights=weights)
            sides.append(np.maximum(seen, mean - deviation))
        else:
            result[row, column] += (of_all - paths.share[row, column]) * (sides[0] - sides[1])
    return np.maximum(result, 0)


@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 3]), st.integers(1, 4))
def test_as_it_is_specified(seed, channels, samples):
    random = np.random.default_rng(seed)
    shares = [random.integers(0, n + 1, (6, 7, channels)) / n for n in (samples, 8)]
    paths, further = (Coverage(share.astype(np.float32), n) for share, n in zip(shares, (samples, 8), strict=True))
    pixels = random.exponential(0.5, (6, 7, 3)).astype(np.float32)
    kept = pixels.copy()
    found = correct_coverage(pixels, paths, further)
    np.testing.assert_allclose(found, by_coverage_pixel_by_pixel(pixels, paths, further), rtol=0, atol=1e-5)
    assert np.array_equal(pixels, kept)


def error(image, references):
    first, second = (coded(image) - coded(reference) for reference in references)
    return float((first * second).mean())


def coded(image):
    return encode_srgb(np.clip(image.pixels, 0, 1).astype(np.float64))


@pytest.mark.long
@pytest.mark.usefixtures("engine")
@pytest.mark.parametrize(("method", "samples"), [("full", 1), ("pooled", 1), ("pooled", 4)])
def test_leaves_before_the_sky(method, samples, monkeypatch):
    display = lippmann.load_display("seed-lenticular").resized(256, 96)

    def tree(method, samples, **options):
        return lippmann.render(
            "tree", display, integrator="path", method=method, spp=samples, tone_map="none", **options
        )

    references = [tree("full", 64, seed=seed, denoise="none") for seed in (8, 9)]
    found = tree(method, samples, denoise="oidn-fast")
    for user in ("rendering.methods", "rendering.denoise.dual_buffer"):
        monkeypatch.setattr(f"lippmann.{user}.correct_coverage", lambda pixels, *_, **__: pixels)
    without = tree(method, samples, denoise="oidn-fast")
    assert error(found, references) < 0.65 * error(without, references)
    assert found.provenance.rays == without.provenance.rays
