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
    a, b = (np.atleast_3d(np.asarray(picture, dtype=np.float64)) for picture in (reference, test))
    present = None if mask is None or mask.all() else mask[..., None].astype(np.float64)
    weights = 1.0 if present is None else _filtered(present)
    if present is not None:
        a, b = a * present, b * present
    # Where no pixel of a window exists the weight is 0; such windows are not centred on a pixel and drop out below.
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_a, mean_b = _filtered(a) / weights, _filtered(b) / weights
        variance_a = _filtered(a * a) / weights - mean_a * mean_a
        variance_b = _filtered(b * b) / weights - mean_b * mean_b
        covariance = _filtered(a * b) / weights - mean_a * mean_b
        c1, c2 = K1 * K1, K2 * K2
        similarity = ((2 * mean_a * mean_b + c1) * (2 * covariance + c2)) / (
            (mean_a * mean_a + mean_b * mean_b + c1) * (variance_a + variance_b + c2)
        )
    if present is None:
        return float(similarity.mean())
    centred = _inside(present[..., 0]) > 0
    return float(similarity[centred].mean()) if centred.any() else float("nan")


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


def _window(length: int) -> Real:
    """Gaussian weights that sum to one, as many as fit ``length`` pixels."""
    size = min(WINDOW, length - 1 + length % 2)
    places = np.arange(size) - size // 2
    weights: Real = np.exp(-0.5 * (places / SIGMA) ** 2)
    weights /= weights.sum()
    return weights


def _filtered(picture: Real) -> Real:
    """Weighted means over all windows that lie inside ``(H, W, channels)``."""
    for axis in (0, 1):
        weights = _window(picture.shape[axis])
        places = picture.shape[axis] - len(weights) + 1
        total = np.zeros(tuple(places if a == axis else n for a, n in enumerate(picture.shape)))
        for shift, weight in enumerate(weights):
            part = slice(shift, shift + places)
            total += weight * (picture[part] if axis == 0 else picture[:, part])
        picture = total
    return picture


def _inside(picture: Real) -> Real:
    """The part of ``(H, W)`` that the centres of those windows cover."""
    margins = [len(_window(length)) // 2 for length in picture.shape]
    return picture[tuple(slice(margin, length - margin) for margin, length in zip(margins, picture.shape, strict=True))]
