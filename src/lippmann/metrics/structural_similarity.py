"""Structural similarity of views.

Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli: *Image quality assessment: from error visibility to structural
similarity*, IEEE Transactions on Image Processing 13(4), 2004. With their constants: a Gaussian window of 11 x 11
pixels and standard deviation 1.5 with weights that sum to one, K1 = 0.01, K2 = 0.03, values in [0, 1]; window places
that lie wholly inside the picture. Colour pictures: the mean over the three channels.

SSIM judges a picture by the neighbourhood of each pixel. Neighbours on the panel are different directions, so it is
the views (one pixel of every lens) that are judged, one by one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]

WINDOW = 11
SIGMA = 1.5
K1, K2 = 0.01, 0.03


def ssim(reference: ArrayLike, test: ArrayLike, mask: Flags | None = None) -> float:
    """Mean SSIM of two pictures ``(H, W)`` or ``(H, W, channels)`` with values in [0, 1]; 1 for equal ones.

    Parameters
    ----------
    mask:
        ``(H, W)``: which pixels exist. The others weigh nothing in the windows that they fall into, and no window is
        centred on them. None: all exist.

    Notes
    -----
    Along an axis shorter than the window, the window is cut to the largest odd number of pixels that fits.

    Returns
    -------
    float
        In [-1, 1]; NaN if ``mask`` leaves no window.
    """
    a, b = (np.atleast_3d(np.asarray(picture)) for picture in (reference, test))
    height, width = a.shape[:2]
    if mask is not None and mask.all():
        mask = None
    if mask is not None:
        a, b = (np.where(mask[..., None], picture, 0.0) for picture in (a, b))
    total, count = similarity_sum(a, b, mask, (window_weights(height), window_weights(width)))
    return total / count if count else float("nan")


def similarity_sum(
    a: NDArray[np.generic], b: NDArray[np.generic], mask: Flags | None, windows: tuple[Real, Real]
) -> tuple[float, int]:
    """The sum of SSIM over the windows of pictures ``(H, W, channels)``, and of how many values: see :func:`ssim`.

    Pictures are zero where nothing exists. ``windows`` are the weights of a window's rows and columns, see
    :func:`window_weights`.
    """
    a, b = (np.asarray(picture, np.float64) for picture in (a, b))
    mean_a, mean_b, squares, products = (_average_windows(each, windows) for each in (a, b, a * a + b * b, a * b))
    centred = None
    if mask is not None:
        # Missing values weigh nothing. A window without any weight is not centred on a value and does not count.
        centred = mask[_centres(mask, windows)]
        weights = np.where(centred, _average_windows(mask.astype(np.float64), windows), 1.0)[..., None]
        mean_a, mean_b, squares, products = (each / weights for each in (mean_a, mean_b, squares, products))
    similarity = similarity_of_moments(mean_a, mean_b, squares, products)
    values = similarity if centred is None else similarity[centred]
    return float(values.sum()), values.size


def similarity_of_moments(mean_a: Real, mean_b: Real, squares: Real, products: Real) -> Real:
    """SSIM from the means of a and b, of a^2 + b^2 and of a b over a window; Wang et al. 2004, eq. 13."""
    # Both variances are needed as a sum only.
    both, alike = mean_a * mean_a + mean_b * mean_b, 2 * mean_a * mean_b
    similarity: Real = ((alike + K1 * K1) * (2 * products - alike + K2 * K2)) / (
        (both + K1 * K1) * (squares - both + K2 * K2)
    )
    return similarity


def _average_windows(values: Real, windows: tuple[Real, Real]) -> Real:
    """Weighted means over the windows that lie inside ``(H, W, ...)``."""
    from scipy.ndimage import correlate1d

    for axis, weights in enumerate(windows):
        margin = len(weights) // 2
        inside = [slice(None)] * values.ndim
        inside[axis] = slice(margin, values.shape[axis] - margin)
        values = correlate1d(values, weights, axis=axis, mode="constant")[tuple(inside)]
    return values


@dataclass(frozen=True, eq=False)
class ViewSimilarity:
    """SSIM of every view.

    Parameters
    ----------
    values:
        ``(ny, nx)``: :func:`ssim` of view ``(ky, kx)``; NaN for a view without a window.
    exact:
        Whether the views are a permutation of the pixels; else they are resampled (nearest pixel).
    """

    values: Real
    exact: bool

    @property
    def mean(self) -> float:
        """Mean over the views."""
        return float(np.nanmean(self.values))

    @property
    def worst(self) -> tuple[int, int]:
        """``(ky, kx)`` of the view with the least similarity."""
        ky, kx = divmod(int(np.nanargmin(self.values)), self.values.shape[1])
        return ky, kx


def window_weights(length: int) -> Real:
    """Gaussian weights that sum to one, as many as fit ``length`` pixels."""
    size = min(WINDOW, length - 1 + length % 2)
    places = np.arange(size) - size // 2
    weights: Real = np.exp(-0.5 * (places / SIGMA) ** 2)
    weights /= weights.sum()
    return weights


def _centres(mask: Flags, windows: tuple[Real, Real]) -> tuple[slice, ...]:
    """The part of ``(H, W)`` that the centres of those windows cover."""
    margins = [len(weights) // 2 for weights in windows]
    return tuple(slice(margin, length - margin) for margin, length in zip(margins, mask.shape, strict=True))
