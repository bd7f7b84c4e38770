"""How much of a denoised pixel its own samples should make up, by what the halves of a picture say of each other.

A denoiser knows pictures, not this scene: it wipes out stripes that it takes for noise, and what is seen through water.
Such errors stay, however many samples there are, while the samples' own noise falls. So where a clean half lies farther
from the truth than its noisy samples scatter, it gives way to them: of two pictures with squared errors E and V that
know nothing of each other the best mean has E / (E + V) of the second. Both are measured, E by the other half. That
such means converge was shown by A. Firmino, J. R. Frisvad, H. W. Jensen, *Progressive Denoising of Monte Carlo Rendered
Images*, Computer Graphics Forum 41(2), 2022, where a network chooses; here the measurement does, over the pixels
around.

Single pixels tell nothing. E counts as far as it exceeds its own standard deviation, so that few and noisy samples
change nothing, and over small and large neighbourhoods: in a small one a bright hit may be missing by chance, in a
large one what is wrong with an edge is lost. The geometric mean of what both say is zero where either says nothing.

A pixel's own difference to the other half has no say in its weight: where that half happens to agree with the noise of
the samples, these would seem to be right, and the other half could not judge the picture any more.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Transfer, coding_slope
from lippmann.rendering.denoise.tuning import TUNING
from lippmann.runtime.row_threads import Bands

Floats = NDArray[np.float32]
Halves = tuple[Floats, Floats]


def weigh_samples(noisy: Halves, clean: Halves, transfer: Transfer, *, threads: int) -> Floats:
    """The weight of each pixel's own samples against its clean value, ``(H, W, 1)`` in [0, 1].

    Parameters
    ----------
    noisy, clean:
        Two halves of the samples that know nothing of each other, and what a denoiser made of each; ``(H, W, 3)``
        linear.
    transfer:
        How values become codes; errors are measured between codes.
    threads:
        CPU threads; the result does not depend on them.
    """
    bands = Bands(threads)
    noise, error = np.empty((2, *noisy[0].shape[:2]), dtype=np.float32)

    def measure_rows(start: int, end: int) -> None:
        band = slice(start, end)
        a, b, clean_a, clean_b = (half[band] for half in (*noisy, *clean))
        noise[band], error[band] = _noise_and_error(a, b, clean_a, clean_b, transfer)

    bands.lines(measure_rows, len(noise))
    share = np.ones_like(noise)
    for reach in TUNING.reaches:
        of_noise = np.maximum(mean_around(noise, reach, bands), 0)
        known = leave_one_out_mean(error, reach, bands)
        share *= known / (known + of_noise + np.float32(1e-12))  # 0 where there is neither noise nor error
    return np.asarray(np.sqrt(share)[..., None])


def _noise_and_error(
    a: Floats, b: Floats, clean_a: Floats, clean_b: Floats, transfer: Transfer
) -> tuple[Floats, Floats]:
    """Squared errors, between codes, of a noisy half and of a clean one, ``(H, W)``; right on the average.

    Beyond white the codes are cut off, but what is wrong there is wrong around, too.
    """
    weight = np.square(coding_slope(np.clip(np.float32(0.5) * (clean_a + clean_b), 0, 1), transfer)) / 6
    scatter = np.square(a - b)
    error = np.square(clean_a - b) + np.square(clean_b - a) - scatter
    return np.einsum("hwc,hwc->hw", weight, scatter), np.einsum("hwc,hwc->hw", weight, error)


def mean_around(values: Floats, reach: int, bands: Bands) -> Floats:
    """Means of ``(H, W)`` over the square of pixels up to ``reach`` away, cut at the edges."""
    padded = np.pad(values, reach)
    count = _pixels_around(values.shape, reach)
    mean = np.empty_like(values)

    def mean_rows(start: int, end: int) -> None:
        columns = _window_sums(padded[start : end + 2 * reach], 2 * reach + 1)
        mean[start:end] = _window_sums(columns.T, 2 * reach + 1).T / count[start:end]

    bands.lines(mean_rows, len(values))
    return mean


def _window_sums(values: Floats, size: int) -> Floats:
    """Sums down each column over all windows of ``size`` rows.

    Windows are put together from such of 1, 2, 4, ... rows: nothing is taken away again, so that a strong value leaves
    nothing behind.
    """
    length = len(values) - size + 1
    total = np.zeros_like(values[:length])
    block, rows, done = values, 1, 0
    while True:
        if size & rows:
            total += block[done : done + length]
            done += rows
        if done == size:
            return total
        block = block[:-rows] + block[rows:]
        rows *= 2


def _pixels_around(shape: tuple[int, ...], reach: int) -> Floats:
    """``(H, W)``: of how many pixels the mean around each is, itself included."""
    rows, columns = (
        np.minimum(place + reach, len(place) - 1) - np.maximum(place - reach, 0) + 1 for place in map(np.arange, shape)
    )
    return np.outer(rows, columns).astype(np.float32)


def leave_one_out_mean(values: Floats, reach: int, bands: Bands, errors: float = 1.0) -> Floats:
    """Leave-one-out local mean, soft-thresholded at ``errors`` of its own standard errors (>= 0), ``(H, W)``.

    The mean of a pixel is that of the others up to ``reach`` pixels away, cut at the edges. Its standard error
    is the sample standard deviation of those n values over the root of n, as of values that know nothing of each
    other. Where fewer than two others are left, nothing is known: 0.
    """
    mean = _mean_of_others(values, reach, bands)
    squares = _mean_of_others(np.square(values), reach, bands)
    others = _pixels_around(values.shape, reach) - 1
    # Of n values: the mean square about the mean, over n - 1.
    variance = np.maximum(squares - np.square(mean), 0) / np.maximum(others - 1, 1)
    known: NDArray[Any] = np.maximum(mean - np.float32(errors) * np.sqrt(variance), 0)
    return np.where(others > 1, known, np.float32(0))


def _mean_of_others(values: Floats, reach: int, bands: Bands) -> Floats:
    """Means of ``(H, W)`` over the other pixels up to ``reach`` away, cut at the edges; 0 where there is none."""
    count = _pixels_around(values.shape, reach)
    mean: NDArray[Any] = (mean_around(values, reach, bands) * count - values) / np.maximum(count - 1, 1)
    return mean
