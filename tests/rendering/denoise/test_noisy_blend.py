"""How much of a denoised pixel its samples make up, where it is known what is right."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.rendering.denoise.noisy_blend import weigh_samples

SHAPE = (96, 96, 3)


def halves(noise, seed=1, value=0.3):
    random = np.random.default_rng(seed)
    return tuple(np.float32(value) + random.normal(0, noise, SHAPE).astype(np.float32) for _ in range(2))


def clean(value=0.3):
    return (np.full(SHAPE, value, dtype=np.float32),) * 2


def share(noisy, of, transfer="linear", threads=1):
    return weigh_samples(noisy, of, transfer, threads=threads)[..., 0]


def test_samples_change_nothing_where_the_clean_picture_is_right():
    assert float(share(halves(0.1), clean()).mean()) < 0.03


@pytest.mark.parametrize("off", [0.05, 0.1, 0.3])
@pytest.mark.parametrize("transfer", ["linear", "srgb"])
def test_where_it_is_wrong_the_weight_is_that_of_the_least_error(off, transfer):
    noise = 0.1
    found = share(halves(noise), clean(0.3 + off), transfer)
    assert float(found.mean()) == pytest.approx(off**2 / (off**2 + noise**2), abs=0.12)
    assert found.std() < 0.12


def test_more_samples_take_over():
    weights = [float(share(halves(noise), clean(0.33)).mean()) for noise in (0.3, 0.03, 0.003)]
    assert weights[0] < 0.1
    assert weights[2] > 0.97
    assert weights == sorted(weights)


def test_only_where_it_is_wrong():
    wrong = clean()[0].copy()
    wrong[:, 48:] += np.float32(0.2)
    found = share(halves(0.02), (wrong, wrong))
    assert found[:, :30].max() < 0.2
    assert found[:, 66:].min() > 0.8


def test_a_pixel_has_no_say_in_its_own_weight():
    """Else its judge would be party: the other half's noise would decide where it is asked."""
    noisy, of = halves(0.1), clean(0.4)
    changed = noisy[1].copy()
    changed[40, 40] = noisy[0][40, 40]
    before, after = share(noisy, of), share((noisy[0], changed), of)
    # Its noise stays known: a bright hit must not look like the truth.
    assert after[40, 40] == pytest.approx(before[40, 40], abs=0.02)
    assert abs(after[40, 41] - before[40, 41]) > 1e-4


def test_a_bright_hit_is_not_taken_for_light_that_is_missing():
    noisy = tuple(half.copy() for half in halves(0.001))
    noisy[0][50, 50] = 200
    assert share(noisy, clean())[50, 50] < 0.01


def test_threads_change_nothing_and_nothing_is_made_of_nothing():
    noisy, of = halves(0.1), clean(0.35)
    assert np.array_equal(share(noisy, of), share(noisy, of, threads=3))
    black = (np.zeros(SHAPE, np.float32),) * 2
    assert not share(black, black).any()
    single = tuple(part[:1, :1] for part in noisy)
    assert np.isfinite(share(single, tuple(part[:1, :1] for part in of))).all()
