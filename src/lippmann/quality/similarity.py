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

from lippmann.image import IntegralImage
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.quality.metrics import coded

Real = NDArray[np.float64]

WINDOW = 11
SIGMA = 1.5
K1, K2 = 0.01, 0.03

#: Values of one picture that are worked on at a time.
_BLOCK = 1 << 15


def ssim(reference: ArrayLike, test: ArrayLike, mask: NDArray[np.bool_] | None = None) -> float:
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
    present = None if mask is None or mask.all() else mask
    height, width = a.shape[:2]
    windows = window_weights(height), window_weights(width)
    # Rows are taken a few at a time, so that what is computed of them stays in the processor's cache.
    step = max(3 * WINDOW, _BLOCK // a[0].size)
    total, count = 0.0, 0
    for first in range(0, height - len(windows[0]) + 1, step):
        rows = slice(first, first + step + len(windows[0]) - 1)
        values = similarities(a[rows], b[rows], None if present is None else present[rows], windows)
        total, count = total + float(values.sum()), count + values.size
    return total / count if count else float("nan")


def similarities(a: Real, b: Real, mask: NDArray[np.bool_] | None, windows: tuple[Real, Real]) -> Real:
    """SSIM of every window of ``(H, W, channels)``; with a mask of those that are centred on a pixel that exists."""
    a, b = a.astype(np.float64), b.astype(np.float64)
    weights: Real | float = 1.0
    if mask is not None:
        present = mask[..., None].astype(np.float64)
        a, b, weights = a * present, b * present, _filtered(present, windows)
    # Where no pixel of a window exists its weight is 0; such a window is not centred on a pixel and drops out below.
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_a, mean_b = _filtered(a, windows) / weights, _filtered(b, windows) / weights
        # Both variances are needed as a sum only.
        variances = _filtered(a * a + b * b, windows) / weights - mean_a * mean_a - mean_b * mean_b
        covariance = _filtered(a * b, windows) / weights - mean_a * mean_b
        c1, c2 = K1 * K1, K2 * K2
        similarity = ((2 * mean_a * mean_b + c1) * (2 * covariance + c2)) / (
            (mean_a * mean_a + mean_b * mean_b + c1) * (variances + c2)
        )
    return similarity if mask is None else similarity[_centres(mask, windows)]


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


def view_similarity(
    reference: IntegralImage, test: IntegralImage, progress: ProgressCallback = silent
) -> ViewSimilarity:
    """SSIM of the views of two pictures of one display, on coded values."""
    (a, mask), (b, _) = (picture.with_pixels(coded(picture)).views_and_mask() for picture in (reference, test))
    ny, nx = a.shape[:2]
    values = np.empty((ny, nx))
    for k in range(ny * nx):
        view = divmod(k, nx)
        progress(Progress("compare", k, ny * nx))
        values[view] = ssim(a[view], b[view], mask[view])
    return ViewSimilarity(values, reference.views_are_exact)


def window_weights(length: int) -> Real:
    """Gaussian weights that sum to one, as many as fit ``length`` pixels."""
    size = min(WINDOW, length - 1 + length % 2)
    places = np.arange(size) - size // 2
    weights: Real = np.exp(-0.5 * (places / SIGMA) ** 2)
    weights /= weights.sum()
    return weights


def _filtered(picture: Real, windows: tuple[Real, Real]) -> Real:
    """Weighted means over all windows that lie inside ``(H, W, channels)``."""
    for axis, weights in enumerate(windows):
        last = len(weights) - 1
        places = picture.shape[axis] - last
        parts = [slice(shift, shift + places) for shift in range(last + 1)]
        at = [picture[part] if axis == 0 else picture[:, part] for part in parts]
        total = at[last // 2] * weights[last // 2]
        # The weights are the same on both sides of the middle.
        for shift in range(last // 2):
            total += (at[shift] + at[last - shift]) * weights[shift]
        picture = total
    return picture


def _centres(mask: NDArray[np.bool_], windows: tuple[Real, Real]) -> NDArray[np.bool_]:
    """The part of ``(H, W)`` that the centres of those windows cover."""
    margins = [len(weights) // 2 for weights in windows]
    return mask[tuple(slice(margin, length - margin) for margin, length in zip(margins, mask.shape, strict=True))]
