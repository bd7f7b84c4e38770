"""The quality figures of the 2014 paper, its equations (1) to (4), under its own names.

They are computed from 8-bit display codes, 0 to 255, for one micro-image (lens) at a time, over all its pixels and
channels:

- :func:`paper_rmse`, equation (1). The paper calls it RMSE, but it has no root: it is the *mean squared error*. Its own
  numbers say so: 13.5795 gives 36.802 dB. The name is kept, the formula is the paper's;
- :func:`paper_psnr` of that value: ``10 log10(255^2 / paper_rmse)``;
- the averages of both over the lenses. The mean of the PSNR is not the PSNR of the mean error: it is never lower, and
  it hides a single bad lens among good ones.

A micro-image without any error has no finite PSNR, and the paper does not say how it enters the average. Here the
average goes over the other micro-images, which can only lower it; the number of those left out is stated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lippmann.color.transfer import Transfer, linear_levels, quantize
from lippmann.image.stored_values import Values
from lippmann.metrics.mse_psnr import look_up_codes, psnr

Real = NDArray[np.float64]

#: The largest 8-bit code.
PEAK = 255.0


def paper_rmse(reference: ArrayLike, test: ArrayLike) -> float:
    """Equation (1) of the paper, for 8-bit codes of one micro-image: the mean of the squared differences, no root."""
    difference = np.asarray(reference, dtype=np.float64) - np.asarray(test, dtype=np.float64)
    return float(np.square(difference).mean())


def paper_psnr(rmse: float) -> float:
    """The paper's PSNR in dB of its ``rmse`` (a mean squared error of 8-bit codes); infinite for 0."""
    return psnr(rmse, PEAK)


@dataclass(frozen=True, eq=False)
class PaperFigures:
    """The paper's figures of a whole picture.

    Parameters
    ----------
    rmse:
        ``(lens_rows, lens_cols)``: :func:`paper_rmse` of every micro-image; NaN where a lens has no pixel.
    """

    rmse: Real

    @property
    def psnr(self) -> Real:
        """``(lens_rows, lens_cols)``: :func:`paper_psnr` of every micro-image in dB; infinite for one without error."""
        values = [math.nan if math.isnan(rmse) else paper_psnr(rmse) for rmse in self.rmse.ravel().tolist()]
        return np.array(values).reshape(self.rmse.shape)

    @property
    def unchanged(self) -> int:
        """How many micro-images are without error; they have no part in :attr:`mean_psnr`."""
        return int(np.count_nonzero(self.rmse == 0))

    @property
    def mean_rmse(self) -> float:
        """:attr:`rmse` averaged over all micro-images."""
        return float(np.nanmean(self.rmse))

    @property
    def mean_psnr(self) -> float:
        """The PSNR in dB averaged over the micro-images that have an error; infinite if none has."""
        values = self.psnr
        finite = values[np.isfinite(values)]
        return float(finite.mean()) if finite.size else math.inf


def paper_codes(values: Values, transfer: Transfer) -> NDArray[np.float32]:
    """8-bit codes of linear values, or of codes of 8 or 16 bits, as numbers that can be subtracted; same shape."""
    if values.dtype.kind == "u":
        return look_up_codes(values, _paper_levels(values.dtype, transfer))
    return quantize(values.astype(np.float32, copy=False), 8, transfer).astype(np.float32)


@lru_cache(maxsize=4)
def _paper_levels(dtype: np.dtype[np.generic], transfer: Transfer) -> NDArray[np.float32]:
    """The 8-bit codes of all codes of a type."""
    return paper_codes(linear_levels(dtype, transfer), transfer)
