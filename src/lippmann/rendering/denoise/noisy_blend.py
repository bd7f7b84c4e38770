"""Inverse-MSE blend of the denoised and the noisy value of each pixel.

A denoiser has a bias: it removes stripes that look like noise, or detail behind water. The bias stays however many
samples there are, while the noise falls. The best mean of two independent estimates with squared errors E (denoised)
and V (noisy) gives the noisy one the weight E / (E + V). Both are estimated, E with the other half-buffer. Such blends
converge (A. Firmino, J. R. Frisvad, H. W. Jensen, *Progressive Denoising of Monte Carlo Rendered Images*, Computer
Graphics Forum 41(2), 2022). There a network chooses the weight; here it follows from local means of the estimates.

The estimates of single pixels are too noisy. E is soft-thresholded at its standard error, so that few and noisy samples
change nothing. It is averaged over a small and a large neighbourhood: the small one may miss a firefly by chance, the
large one averages the error of an edge away. The weight is the geometric mean of both, so 0 where either is 0.

The mean leaves the pixel itself out (cross-fitting): else a pixel whose two halves agree by chance would get a large
weight, and the other half would no longer be independent of the result.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Coding, coding_slope
from lippmann.rendering.denoise.tuning import TUNING
from lippmann.runtime.row_threads import Bands

Floats = NDArray[np.float32]
Halves = tuple[Floats, Floats]


def weigh_samples(noisy: Halves, clean: Halves, coding: Coding, *, threads: int) -> Floats:
    """Weight of the noisy value of each pixel against the denoised one, ``(H, W, 1)`` in [0, 1].

    Parameters
    ----------
    noisy, clean:
        Two independent half-buffers, and each of them denoised; ``(H, W, 3)`` linear.
    coding:
        How values become codes; errors are measured between codes.
    threads:
        CPU threads; the result does not depend on them.
    """
    bands = Bands(threads)
    noise, error = np.empty((2, *noisy[0].shape[:2]), dtype=np.float32)

    def measure_rows(start: int, end: int) -> None:
        band = slice(start, end)
        a, b, clean_a, clean_b = (half[band] for half in (*noisy, *clean))
        noise[band], error[band] = _estimate_noise_and_error(a, b, clean_a, clean_b, coding)

    bands.lines(measure_rows, len(noise))
    share = np.ones_like(noise)
    for reach in TUNING.reaches:
        of_noise = np.maximum(mean_around(noise, reach, bands), 0)
        known = leave_one_out_mean(error, reach, bands)
        share *= known / (known + of_noise + np.float32(1e-12))  # 0 where there is neither noise nor error
    return np.asarray(np.sqrt(share)[..., None])


def _estimate_noise_and_error(
    a: Floats, b: Floats, clean_a: Floats, clean_b: Floats, coding: Coding
) -> tuple[Floats, Floats]:
    """Unbiased estimates of the squared errors, in codes, of a noisy and of a denoised half, ``(H, W)``.

    Codes are clipped at white only for their slope, as an error beyond white reaches the pixels around.
    """
    weight = np.square(coding_slope(np.clip(np.float32(0.5) * (clean_a + clean_b), 0, 1), coding)) / 6
    scatter = np.square(a - b)
    error = np.square(clean_a - b) + np.square(clean_b - a) - scatter
    return np.einsum("hwc,hwc->hw", weight, scatter), np.einsum("hwc,hwc->hw", weight, error)


def mean_around(values: Floats, reach: int, bands: Bands) -> Floats:
    """Means of ``(H, W)`` over the square of pixels up to ``reach`` away, cut at the edges."""
    padded = np.pad(values, reach)
    count = _count_pixels_around(values.shape, reach)
    mean = np.empty_like(values)

    def mean_rows(start: int, end: int) -> None:
        columns = _sum_windows(padded[start : end + 2 * reach], 2 * reach + 1)
        mean[start:end] = _sum_windows(columns.T, 2 * reach + 1).T / count[start:end]

    bands.lines(mean_rows, len(values))
    return mean


def _sum_windows(values: Floats, size: int) -> Floats:
    """Sums down each column over all windows of ``size`` rows.

    Windows are composed of windows of 1, 2, 4, ... rows. Unlike in a running sum nothing is subtracted, so a large
    value leaves no rounding error behind.
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


def _count_pixels_around(shape: tuple[int, ...], reach: int) -> Floats:
    """``(H, W)``: number of pixels in the window around each, itself included."""
    rows, columns = (
        np.minimum(place + reach, len(place) - 1) - np.maximum(place - reach, 0) + 1 for place in map(np.arange, shape)
    )
    return np.outer(rows, columns).astype(np.float32)


def leave_one_out_mean(values: Floats, reach: int, bands: Bands, errors: float = 1.0) -> Floats:
    """Leave-one-out local mean, soft-thresholded at ``errors`` of its own standard errors (>= 0), ``(H, W)``.

    The mean of a pixel is that of the others up to ``reach`` pixels away, cut at the edges. Its standard error
    is that of n independent values: their sample standard deviation over the root of n. Where fewer than two others
    are left, nothing is known: 0.
    """
    mean = _average_others(values, reach, bands)
    squares = _average_others(np.square(values), reach, bands)
    others = _count_pixels_around(values.shape, reach) - 1
    # Of n values: the mean square about the mean, over n - 1.
    variance = np.maximum(squares - np.square(mean), 0) / np.maximum(others - 1, 1)
    known: NDArray[Any] = np.maximum(mean - np.float32(errors) * np.sqrt(variance), 0)
    return np.where(others > 1, known, np.float32(0))


def _average_others(values: Floats, reach: int, bands: Bands) -> Floats:
    """Means of ``(H, W)`` over the other pixels up to ``reach`` away, cut at the edges; 0 where there is none."""
    count = _count_pixels_around(values.shape, reach)
    mean: NDArray[Any] = (mean_around(values, reach, bands) * count - values) / np.maximum(count - 1, 1)
    return mean
