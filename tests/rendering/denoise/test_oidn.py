"""Noise taken out of pictures: less of it than before, and every pixel back in its place."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel
from lippmann.errors import UsageError
from lippmann.rendering.denoise import oidn
from lippmann.rendering.denoise.oidn import denoise

SQUARE = Display("square", Panel(8 * 20, 8 * 12, 0.25), LensArray("square", 2.0), 6.8)


def known(height=120, width=160):
    """A soft slope with a dark disc and a bright bar in it: colours, albedo and a constant normal."""
    v, u = np.mgrid[0:height, 0:width] / width
    albedo = np.stack([0.3 + 0.4 * u, 0.5 - 0.3 * v, 0.2 + 0 * u], axis=-1)
    albedo[(u - 0.5) ** 2 + (v - 0.35) ** 2 < 0.02] = (0.05, 0.1, 0.3)
    albedo[(np.abs(v - 0.6) < 0.03)] = (0.9, 0.8, 0.7)
    normal = np.broadcast_to([0.0, 0.0, 1.0], albedo.shape)
    return tuple(np.asarray(part, dtype=np.float32) for part in (albedo * 1.2, albedo, normal))


def noisy(color, seed=1, samples=4):
    """As unbiased as light: each sample is worth twice the mean or nothing."""
    rng = np.random.default_rng(seed)
    return (color * 2 * rng.binomial(samples, 0.5, color.shape[:2])[..., None] / samples).astype(np.float32)


def error(a, b):
    return float(np.sqrt(np.mean((a - b) ** 2)))


# ---- Pictures -------------------------------------------------------------------------------------------------------


def test_noise_falls_and_guides_help():
    color, albedo, normal = known()
    seen = noisy(color)
    plain, guided = denoise(seen), denoise(seen, albedo, normal)
    assert error(plain, color) < error(seen, color) / 4
    assert error(guided, color) < error(plain, color) / 1.5
    assert error(denoise(seen, albedo, normal, clean_guides=True), color) < error(plain, color) / 1.5
    assert guided.dtype == np.float32
    assert guided.shape == color.shape


def test_little_memory_gives_the_same_picture(monkeypatch):
    color, guide = np.random.default_rng(4).random((2, 640, 512, 3), np.float32)
    pictures = [denoise(color, guide, effort="fast")]
    monkeypatch.setattr(oidn, "NETWORK_MOST", 1 << 20)
    pictures.append(denoise(color, guide, effort="fast"))
    assert np.array_equal(*pictures)


def test_means_are_kept():
    color, albedo, normal = known()
    guided = denoise(noisy(color), albedo, normal)
    for rows, columns in ((slice(0, 30), slice(0, 40)), (slice(80, 120), slice(100, 160))):
        expected = color[rows, columns].mean(axis=(0, 1))
        assert guided[rows, columns].mean(axis=(0, 1)) == pytest.approx(expected, rel=0.04)


def test_clean_pictures_stay_as_they_are():
    color, albedo, normal = known()
    kept = color.copy()
    assert error(denoise(color, albedo, normal, clean_guides=True), color) < 0.006
    assert np.array_equal(color, kept)


def test_bright_values_survive():
    color, albedo, normal = known()
    color = color * 50
    assert denoise(color, albedo, normal).max() > 45


def test_equal_input_gives_equal_output_whatever_the_threads():
    color, albedo, normal = known()
    seen = noisy(color)
    first = denoise(seen, albedo, normal, threads=1)
    assert np.array_equal(first, denoise(seen, albedo, normal, threads=1))
    assert np.allclose(first, denoise(seen, albedo, normal, threads=2), atol=2e-3)


@pytest.mark.parametrize("height", [96, 101])
def test_rotated_the_network_sees_the_whole_picture_and_errs_another_way(height):
    """Nothing moves, also where the sides are no whole steps of the network."""
    color, albedo, normal = known(height, 155)
    halves = noisy(color, 1), noisy(color, 2)
    upright = [denoise(half, albedo, normal, clean_guides=True, effort="fast") for half in halves]
    rotated = denoise(halves[1], albedo, normal, clean_guides=True, effort="fast", rotated=True)
    assert rotated.shape == color.shape
    assert rotated.flags.c_contiguous
    assert error(rotated, color) < 1.2 * error(upright[1], color)
    assert not np.array_equal(rotated, upright[1])
    mean_of_rotated, mean_of_upright = 0.5 * (upright[0] + rotated), 0.5 * (upright[0] + upright[1])
    assert error(mean_of_rotated, color) < error(mean_of_upright, color)


@pytest.mark.parametrize("width", [256, 250])
def test_a_turned_window_is_what_the_whole_shows_there(width):
    """Windows begin with a step of the network; where the picture ends must not matter."""
    color, albedo, normal = known(64, width)
    layers = noisy(color), albedo, normal
    options = {"clean_guides": True, "effort": "fast", "rotated": True}
    whole = denoise(*layers, **options)
    window = denoise(*(layer[:, :192] for layer in layers), **options)
    # What lies 87 pixels beyond is seen by none.
    assert np.abs(window - whole[:, :192])[:, :100].max() < 1e-4


@pytest.mark.parametrize("layout", ["transposed", "double", "read-only"])
def test_any_array_of_the_right_shape_will_do(layout):
    color, _, _ = known(40, 64)
    given = {
        "transposed": np.ascontiguousarray(color.swapaxes(0, 1)).swapaxes(0, 1),
        "double": color.astype(np.float64),
        "read-only": color.copy(),
    }[layout]
    given.flags.writeable = False
    assert np.array_equal(denoise(given), denoise(color))


@pytest.mark.parametrize(
    ("color", "albedo", "normal", "said"),
    [
        (np.zeros((4, 5)), None, None, r"color has the shape \(4, 5\)"),
        (np.zeros((0, 5, 3)), None, None, "shape"),
        (np.zeros((4, 5, 3)), np.zeros((4, 6, 3)), None, r"albedo has the shape \(4, 6, 3\).*\(4, 5, 3\)"),
        (np.full((4, 5, 3), np.nan), None, None, "not finite"),
    ],
)
def test_arguments_that_will_not_do(color, albedo, normal, said):
    with pytest.raises(UsageError, match=said):
        denoise(color, albedo, normal)


def test_missing_library_is_said_with_its_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    with pytest.raises(UsageError, match=r'pip install "pyoidn>=2\.5"'):
        denoise(np.zeros((4, 5, 3)))


def test_channels_of_sub_pixels_stay_apart():
    """Sub-pixels see different places: red and blue have their edges a pixel apart, and keep them there."""
    step = np.ones((SQUARE.panel.height, SQUARE.panel.width), dtype=np.float32) * 0.1
    red, green, blue = (step.copy() for _ in range(3))
    red[:, 79:], green[:, 80:], blue[:, 81:] = 0.8, 0.8, 0.8
    color = np.stack([red, green, blue], axis=-1)
    rng = np.random.default_rng(3)
    # Each channel has noise of its own.
    seen = (color * 2 * rng.binomial(8, 0.5, color.shape) / 8).astype(np.float32)
    result = denoise(seen, color, np.zeros_like(color), clean_guides=True)
    assert error(result, color) < error(seen, color) / 4
    half = (result > 0.45).argmax(axis=1)
    assert np.median(half, axis=0).tolist() == [79, 80, 81]
