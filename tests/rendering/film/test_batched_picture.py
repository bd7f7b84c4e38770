"""The error of a picture by its own batches, for noise that is made and so known."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.color.transfer import encode, encode_srgb

pytestmark = pytest.mark.usefixtures("engine")


def errors(batches, taken=None, transfer="srgb"):
    """Of the means ``batches`` ``(K, pixels)`` of grey pixels, each of ``taken`` samples."""
    from lippmann.rendering.film.batched_picture import estimate_batch_errors

    taken = [1] * len(batches) if taken is None else taken
    sums = np.repeat(np.asarray(batches)[..., None] * np.asarray(taken)[:, None, None], 3, axis=2)
    return estimate_batch_errors(sums.astype(np.float32), taken, transfer)


def slow_errors(sums, taken):
    """Errors and outliers' parts of ``(K, pixels, 3)`` sums, by the definition, batch by batch.

    The first batches of each stream hold samples; K is a power of two, and halved while only the first half hold any.
    The jackknife of the sRGB codes; and (n - 2) / (n - 1) times what the streams differ by less what three halves
    differ by that hold as much of either stream, n being the batches that hold samples.
    """
    sums, taken = sums.astype(np.float64), np.asarray(taken, np.float64)
    while len(taken) > 2 and not taken.reshape(4, -1)[1::2].any():
        taken, sums = (part.reshape(4, -1, *part.shape[1:])[::2].reshape(-1, *part.shape[1:]) for part in (taken, sums))
    number, count, total = len(taken), taken.sum(), sums.sum(axis=0)
    held = np.flatnonzero(taken)
    without = {k: encode_srgb((total - sums[k]) / max(count - taken[k], 1)) for k in held}
    middle = np.mean(list(without.values()), axis=0)
    moves = {k: np.square(without[k] - middle).mean(axis=1) for k in held}
    jackknife = sum(moves[k] * (count - taken[k]) / count for k in held)
    largest, spread = np.max(list(moves.values()), axis=0), sum(moves.values())
    # Of the largest share that one of so many can have.
    share = 0.8 * 8 / 7 * (len(held) - 1) / len(held)
    is_outlier = (len(held) >= 4) & (largest > share * spread) & (largest > 0.15**2 / 3)
    outliers = np.where(is_outlier, jackknife, 0)

    def apart(half):
        """Squared error of the mean by what a half and the rest differ by; None if one of them has no samples."""
        some, own = sums[half].sum(axis=0), taken[half].sum()
        rest = count - own
        if own == 0 or rest == 0:
            return None
        difference = encode_srgb(some / own) - encode_srgb((total - some) / rest)
        return np.square(difference).mean(axis=1) * own * rest / count**2

    signs = (np.array([(-1) ** bin(pattern & k).count("1") for k in range(number)]) for pattern in range(1, number))
    halves = [np.flatnonzero(sign > 0) for sign in signs if 0 < (sign[: number // 2] > 0).sum() < number // 2]
    mixed = [difference for half in halves[:3] if (difference := apart(half)) is not None]
    evenness = 0.0
    if mixed:
        streams = apart(np.arange(number // 2))
        evenness = (len(held) - 2) / max(len(held) - 1, 1) * (streams - np.mean(mixed, axis=0))
    return jackknife + evenness, outliers


@pytest.mark.slow
@pytest.mark.parametrize(
    "taken", [[1, 1], [2, 2, 1, 1], [3, 3, 2, 2, 3, 2, 2, 2], [1, 1, 0, 0, 1, 0, 0, 0], [8] * 8], ids=str
)
def test_errors_are_those_of_the_definition(taken):
    from lippmann.rendering.film.batched_picture import estimate_batch_errors

    random = np.random.default_rng(3)
    values = random.lognormal(-1, 0.7, (len(taken), 500, 3)) + 30 * (random.random((len(taken), 500, 1)) < 0.02)
    sums = (values * np.array(taken)[:, None, None]).astype(np.float32)
    found, outliers = estimate_batch_errors(sums, taken, "srgb")
    expected, expected_outliers = slow_errors(sums, taken)
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=2e-6)
    np.testing.assert_allclose(outliers, expected_outliers, rtol=1e-3, atol=2e-6)
    assert (expected_outliers > 0).any() == (np.count_nonzero(taken) >= 4)


def test_batches_without_samples_change_nothing():
    random = np.random.default_rng(4)
    few = 0.4 + 0.05 * random.standard_normal((4, 1000))
    many = np.insert(few, [2, 2, 4, 4], 0.0, axis=0)
    for found, expected in zip(errors(many, [1, 1, 0, 0, 1, 1, 0, 0]), errors(few), strict=True):
        np.testing.assert_array_equal(found, expected)


def picture(batches, taken=None):
    return np.average(batches, axis=0, weights=taken)


def true_error(batches, truth, taken=None, transfer="srgb"):
    grey = np.repeat(np.append(picture(batches, taken), truth)[:, None], 3, axis=1)
    codes = encode(grey, transfer)
    return np.square(codes[:-1] - codes[-1]).mean()


@pytest.mark.slow
@pytest.mark.parametrize("transfer", ["srgb", "linear", "pbr-neutral"])
@pytest.mark.parametrize("number", [2, 4, 8])
def test_plain_noise_is_measured_without_bias(number, transfer):
    random = np.random.default_rng(number)
    batches = 0.4 + 0.05 * random.standard_normal((number, 60000))
    found, outliers = errors(batches, transfer=transfer)
    assert found.mean() == pytest.approx(true_error(batches, 0.4, transfer=transfer), rel=0.04)
    assert outliers.sum() < 0.05 * found.sum()


def test_evenly_spread_samples_are_given_their_due():
    random = np.random.default_rng(1)
    batches = 0.4 + 0.05 * random.standard_normal((8, 60000))
    for stream in (slice(0, 4), slice(4, 8)):
        # The batches of a stream make up for most of what each is off.
        batches[stream] -= 0.8 * (batches[stream].mean(axis=0) - 0.4)
    found, _ = errors(batches)
    assert found.mean() == pytest.approx(true_error(batches, 0.4), rel=0.06)


def test_streams_that_agree_too_well_do_not_hide_that_they_are_two():
    random = np.random.default_rng(1)
    batches = 0.4 + 0.05 * random.standard_normal((4, 60000))
    # The same noise twice: as if both streams had one seed. Half of the error is all that can be seen then.
    found, _ = errors(np.concatenate([batches, batches]))
    assert found.mean() < 0.05 * true_error(np.concatenate([batches, batches]), 0.4)


def test_batches_count_by_their_samples():
    random = np.random.default_rng(1)
    taken = [3, 3, 2, 2, 3, 2, 2, 2]
    batches = 0.4 + 0.1 * random.standard_normal((8, 60000)) / np.sqrt(taken)[:, None]
    found, _ = errors(batches, taken)
    assert found.mean() == pytest.approx(true_error(batches, 0.4, taken), rel=0.05)


def test_batches_that_hold_nothing_are_no_witnesses():
    random = np.random.default_rng(1)
    taken = [1, 1, 0, 0, 1, 0, 0, 0]
    batches = 0.4 + 0.03 * random.standard_normal((8, 60000))
    found, _ = errors(batches, taken)
    assert found.mean() == pytest.approx(true_error(batches, 0.4, taken), rel=0.06)


def test_noise_that_clips_is_measured_as_it_shows():
    random = np.random.default_rng(1)
    batches = random.exponential(0.9, (8, 60000))
    found, _ = errors(batches)
    true = true_error(batches, 0.9)
    carried_by_slope = np.var(picture(batches)) * (1.055 / 2.4 * 0.9 ** (1 / 2.4 - 1)) ** 2
    assert found.mean() == pytest.approx(true, rel=0.12)
    assert carried_by_slope > 1.4 * true


def test_fireflies_count_as_what_they_show_and_are_called_outliers():
    random = np.random.default_rng(1)
    batches = 0.2 + 100.0 * (random.random((8, 60000)) < 1e-4)
    hit = (batches > 1).any(axis=0)
    found, outliers = errors(batches)
    shown = np.square(encode_srgb(np.ones(1)) - encode_srgb(np.full(1, 0.2)))[0]
    assert found[hit].mean() == pytest.approx(shown, rel=0.3)
    assert found[~hit].max() < 1e-6
    assert outliers[hit] == pytest.approx(found[hit], rel=0.2)


def test_what_no_sample_changes_has_no_error():
    found, outliers = errors(np.full((8, 100), 0.3))
    assert np.abs(found).max() < 1e-10
    assert outliers.max() == 0
