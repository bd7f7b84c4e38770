"""The mean over the views that see a point, against one that follows its definition pixel by pixel."""

from __future__ import annotations

import math

import numpy as np
import pytest

#: Views in a row and a column of the quilt, pixels of a view, and how many views reach to either side.
COLUMNS, ROWS, WIDTH, HEIGHT, REACH = 3, 2, 24, 7, 3
#: One over the viewing distance in millimetres, and pixels of a view per millimetre.
CONVERGENCE, PIXELS_PER_MM = 1 / 300.0, 0.8


def views_of(quilt):
    """``(views, HEIGHT, WIDTH, ...)``, the leftmost camera's first; it is at the bottom left of the quilt."""
    parts = quilt.reshape(ROWS, HEIGHT, COLUMNS, WIDTH, *quilt.shape[2:])
    return parts[::-1].swapaxes(1, 2).reshape(ROWS * COLUMNS, HEIGHT, WIDTH, *quilt.shape[2:])


def shared_light(light, normal, height, slopes):
    """The mean of ``light`` over the views that see the same point, nearer ones with more weight: views ``(N, h, w)``.

    What view k sees at height z at some place, view j sees ``(s_k - s_j) z / (1 - z / D)`` to the right of it. Heights
    must agree within 2 pixels and a fiftieth of z, normals within ``|n - n'|^2 <= 0.19``.
    """
    result = np.zeros(light.shape)
    for k, row, column in np.ndindex(height.shape):
        here, z = (k, row, column), float(height[k, row, column])
        total = 0.0
        for j in range(len(slopes)):
            aside = (slopes[k] - slopes[j]) * z / (1 - z * CONVERGENCE) * PIXELS_PER_MM
            there = j, row, column + math.floor(aside + 0.5)
            if abs(j - k) > REACH or not 0 <= there[2] < WIDTH:
                continue
            agrees = abs(float(height[there]) - z) <= 2 / PIXELS_PER_MM + 0.02 * abs(z)
            agrees &= bool(np.square(normal[there] - normal[here]).sum() <= 0.19)
            if agrees or j == k:
                weight = 1 - abs(j - k) / (REACH + 1)
                total += weight
                result[here] += weight * light[there]
        result[here] /= total
    return result


@pytest.mark.usefixtures("engine")
def test_the_mean_is_the_slow_one(monkeypatch):
    from lippmann.rendering.sharing import cross_lens
    from lippmann.rendering.sharing.cross_view import _Views

    monkeypatch.setattr(cross_lens, "PREFERRED_LANES", 100)  # several parts
    random = np.random.default_rng(1)
    shape = (ROWS * HEIGHT, COLUMNS * WIDTH)
    light = random.lognormal(0, 0.5, (*shape, 3)).astype(np.float32)
    height = np.where(np.arange(shape[1]) % WIDTH < 10, -30.0, 20.0) + random.normal(0, 1, shape)
    normal = random.normal([0, 0, 1], 0.15, (*shape, 3))
    height, normal = height.astype(np.float32), normal.astype(np.float32)
    slopes = np.linspace(-0.2, 0.2, ROWS * COLUMNS)
    views = _Views(light, normal, height, slopes, COLUMNS, CONVERGENCE, PIXELS_PER_MM, REACH)
    found = cross_lens.light_of_pixels(views.mean_light, light.shape)
    expected = shared_light(*(views_of(part) for part in (light, normal, height)), slopes)
    np.testing.assert_allclose(views_of(found), expected, rtol=1e-5)
    # Neither all views agree nor none.
    kept = np.isclose(expected, views_of(light)).all(axis=-1).mean()
    assert 0.01 < kept < 0.9
