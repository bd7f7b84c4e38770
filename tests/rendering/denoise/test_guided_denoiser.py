"""The network sees what has noise: surfaces and a margin; the rest stays as it is."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.rendering.denoise import guided_denoiser as module
from lippmann.rendering.denoise.guided_denoiser import MARGIN, SurfacePart, denoise_surfaces, measure_noise

SHAPE = (200, 260)


@pytest.fixture
def calls(monkeypatch):
    """What the network was shown; it answers with -1."""
    shown = []

    def network(color, albedo, normal, **options):
        shown.append((color, albedo, normal, options))
        return np.full_like(color, -1)

    monkeypatch.setattr(module, "denoise", network)
    return shown


def layers(*surfaces):
    rng = np.random.default_rng(1)
    color, albedo = (rng.random((*SHAPE, 3)).astype(np.float32) for _ in range(2))
    normal = np.zeros((*SHAPE, 3), dtype=np.float32)
    for row, column in surfaces:
        normal[row, column] = (0, 0, -1)
    return color, albedo, normal


def test_the_rectangle_of_all_surfaces_is_shown_and_they_are_cleaned(calls):
    color, albedo, normal = layers((70, 100), (90, 47))
    result = denoise_surfaces(color, albedo, normal, SurfacePart.of(normal), effort="fast", rotated=True, threads=1)
    cleaned = np.zeros(SHAPE, bool)
    for row, column in ((70, 100), (90, 47)):
        cleaned[row - 1 : row + 2, column - 1 : column + 2] = True
    assert (result[cleaned] == -1).all()
    np.testing.assert_array_equal(result[~cleaned], color[~cleaned])
    ((*shown, options),) = calls
    for part, whole in zip(shown, (color, albedo, normal), strict=True):
        # It begins where the network's steps do.
        np.testing.assert_array_equal(part, whole[48 : 91 + MARGIN, 16 : 101 + MARGIN])
    assert options == {"effort": "fast", "rotated": True, "threads": 1, "clean_guides": True}


def test_the_network_is_shown_what_is_open_and_what_stands_around_it(calls):
    color, albedo, normal = layers((70, 100), (190, 250))
    mask = np.zeros(SHAPE, bool)
    mask[71, 101] = mask[150, 20] = True  # beside a surface, and far from any
    result = denoise_surfaces(color, albedo, normal, SurfacePart.of(normal, mask))
    assert result[71, 101, 0] == -1
    np.testing.assert_array_equal(calls[0][0], color[48 : 72 + MARGIN, 80 : 102 + MARGIN])
    assert SurfacePart.of(normal, mask[::-1]) is None


def test_at_the_edge_the_picture_ends(calls):
    color, albedo, normal = layers((0, 259), (199, 3))
    result = denoise_surfaces(color, albedo, normal, SurfacePart.of(normal))
    assert (result[:2, -2:] == -1).all()
    assert calls[0][0].shape == color.shape


def test_where_nothing_is_seen_nothing_is_done(calls):
    color, albedo, normal = layers()
    result = denoise_surfaces(color, albedo, normal, SurfacePart.of(normal))
    np.testing.assert_array_equal(result, color)
    assert result is not color
    assert calls == []


def test_the_noise_that_is_taken_falls_with_the_samples_and_does_not_rest_on_single_paths():
    rng = np.random.default_rng(1)
    clean = np.full((*SHAPE, 3), 0.25, np.float32)
    few, more = (np.square(0.5 + rng.normal(0, width, clean.shape)).astype(np.float32) for width in (0.08, 0.04))
    assert measure_noise(few, clean) == pytest.approx(4 * measure_noise(more, clean), rel=0.02)
    assert measure_noise(more, clean) == pytest.approx(0.04**2 * 2 / np.pi, rel=0.02)  # of the mean of a half-normal
    more[::50, ::50] = 1000.0
    assert measure_noise(more, clean) == pytest.approx(0.04**2 * 2 / np.pi, rel=0.03)
