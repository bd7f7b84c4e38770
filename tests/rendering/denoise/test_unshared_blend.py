"""How much of shared light gives way to a pixel's own, where it is known what is right."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.rendering.denoise.unshared_blend import own_light

SHAPE = (96, 96, 3)
TRUTH = np.float32(0.3)


def around(noise, seed):
    random = np.random.default_rng(seed)
    return tuple(TRUTH + random.normal(0, noise, SHAPE).astype(np.float32) for _ in range(2))


def off(by):
    return (np.full(SHAPE, TRUTH + np.float32(by), np.float32),) * 2


def weight(noisy, clean, shared, transfer="linear", threads=1):
    return own_light(noisy, clean, shared, transfer, threads=threads)[..., 0]


@pytest.mark.parametrize("transfer", ["linear", "srgb"])
def test_what_is_right_is_kept(transfer):
    noisy = around(0.05, 1)
    assert float(weight(noisy, off(0.0), off(0.05), transfer).min()) > 0.8
    assert float(weight(noisy, off(0.05), off(0.0), transfer).max()) == 0


@pytest.mark.parametrize(("clean", "shared", "expected"), [(-0.01, 0.03, 0.75), (-0.03, 0.01, 0.25), (0.03, 0.01, 0)])
def test_the_mix_is_the_one_with_the_least_error(clean, shared, expected):
    found = weight(around(0.01, 2), off(clean), off(shared))
    assert float(found.mean()) == pytest.approx(expected, abs=0.05)


def test_chance_moves_nothing():
    """Both are equally far from the truth, by chance of their own; samples are far noisier."""
    found = weight(around(0.3, 3), around(0.01, 4), off(0.0))
    assert float(found.mean()) < 0.02


def test_single_hits_of_strong_light_move_little():
    noisy = around(0.01, 5)
    for half, at in zip(noisy, ((40, 40), (60, 50)), strict=True):
        half[at] = 300.0
    found = weight(noisy, off(0.02), off(0.0))
    assert float(found.max()) < 0.02


def test_a_pixel_has_no_say_in_its_own_weight():
    noisy, clean, shared = around(0.05, 6), off(0.01), around(0.02, 7)
    changed = tuple(half.copy() for half in noisy)
    for half in changed:
        half[48, 48] += np.float32(0.5)
    before, after = weight(noisy, clean, shared), weight(changed, clean, shared)
    assert before[48, 48] > 0
    assert after[48, 48] == pytest.approx(before[48, 48], rel=1e-4)
    assert abs(after[48, 49] - before[48, 49]) > 1e-4


def test_threads_change_nothing_and_nothing_is_made_of_nothing():
    noisy, clean, shared = around(0.05, 8), off(0.01), around(0.02, 9)
    assert np.array_equal(weight(noisy, clean, shared), weight(noisy, clean, shared, threads=3))
    black = (np.zeros(SHAPE, np.float32),) * 2
    assert not weight(black, black, black).any()
    one = tuple(tuple(part[:1, :1] for part in parts) for parts in (noisy, clean, shared))
    assert np.isfinite(weight(*one)).all()
