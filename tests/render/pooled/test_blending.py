"""Which of two pictures is nearer to the truth, told by a noisy third."""

from __future__ import annotations

import numpy as np


def noisy(truth, sigma, seed):
    return (truth + np.random.default_rng(seed).normal(0, sigma, truth.shape)).astype(np.float32)


def flat(value=0.4, size=(96, 96)):
    return np.full((*size, 3), value, np.float32)


def test_finds_the_better_picture_region_by_region():
    from lippmann.render.pooled.blending import blended

    truth, left = flat(), np.arange(96)[None, :, None] < 48
    x = np.where(left, truth, truth + 0.1).astype(np.float32)
    y = np.where(left, truth + 0.1, truth).astype(np.float32)
    best, _ = blended(x, y, noisy(truth, 0.1, 1), 8)
    assert np.abs(best - truth)[:, :24].mean() < 0.03
    assert np.abs(best - truth)[:, 72:].mean() < 0.03


def test_opposite_errors_cancel():
    from lippmann.render.pooled.blending import blended

    truth = flat()
    best, _ = blended(truth - 0.03, truth + 0.06, noisy(truth, 0.05, 2), 8)
    assert abs(float((best - truth).mean())) < 0.003


def test_weight_tells_how_much_of_the_second_there_is():
    from lippmann.render.pooled.blending import blended

    truth = flat(size=(90, 50))
    for share in (0.0, 0.3, 1.0):
        x, y = truth - share * 0.1, truth + (1 - share) * 0.1
        best, weight = blended(x, y, noisy(truth, 0.02, 5), 16)
        assert weight.shape == (90, 50)
        np.testing.assert_allclose(weight, share, atol=0.03)
        np.testing.assert_allclose(best, x + weight[..., None] * (y - x), atol=1e-6)
