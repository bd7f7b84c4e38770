"""Squared errors of two pictures of a panel, pooled over the picture or by micro-image.

Errors are differences of *coded* values in [0, 1], which drive the display: equal steps look about equal in the dark
and in the light. Each picture is coded by its own transfer, as its files are: the sRGB curve, or none if its values are
display codes already. Values are not rounded to whole codes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lippmann.color.transfer import Transfer, encode, linear_levels
from lippmann.display import Display
from lippmann.display.micro_image_layout import lens_indices, row_blocks
from lippmann.image import Picture
from lippmann.image.stored_values import Values

Real = NDArray[np.float64]
Scalar = TypeVar("Scalar", bound=np.generic)
Float = TypeVar("Float", np.float32, np.float64)

#: The share of micro-images that may be worse than the low percentile that is reported.
LOW_PERCENTILE = 0.01


def psnr(mean_squared_error: float, peak: float = 1.0) -> float:
    """Peak signal-to-noise ratio in dB, ``10 log10(peak^2 / mean_squared_error)``; infinite if there is no error."""
    return math.inf if mean_squared_error == 0 else 10 * math.log10(peak * peak / mean_squared_error)


def encode_rows(image: Picture, rows: tuple[int, int] | None = None) -> Real:
    """Coded values in [0, 1] of the rows ``first`` to before ``last`` (all if None), ``(rows, W, 3)`` float64."""
    first, last = rows or (0, image.display.panel.height)
    return coded_values(image.held_rows(first, last), image.provenance.transfer)


def coded_values(values: Values, transfer: Transfer) -> Real:
    """Coded values in [0, 1] of linear ones, or of codes of 8 or 16 bits, float64; same shape."""
    if values.dtype.kind == "u":
        return look_up_codes(values, _coded_levels(values.dtype, transfer))
    return np.asarray(encode(values.astype(np.float64), transfer))


@lru_cache(maxsize=4)
def _coded_levels(dtype: np.dtype[np.generic], transfer: Transfer) -> Real:
    """The coded values of all codes of a type."""
    return coded_values(linear_levels(dtype, transfer), transfer)


def look_up_codes(codes: Values, levels: NDArray[Scalar]) -> NDArray[Scalar]:
    """``levels[codes]``: much faster than the curve."""
    from lippmann.metrics import kernels

    values = np.empty(codes.shape, dtype=levels.dtype)
    kernels.look_up(np.ascontiguousarray(codes).reshape(-1), levels, values.reshape(-1))
    return values


def squared_differences(a: NDArray[Float], b: NDArray[Float]) -> Real:
    """``(...)``: squared differences of ``(..., channels)`` values, averaged over the channels."""
    difference = a - b
    sums: Real = np.einsum("...c,...c->...", difference, difference).astype(np.float64)
    sums /= difference.shape[-1]
    return sums


def squared_errors(reference: Picture, test: Picture) -> Real:
    """``(H, W)``: the squared difference of the coded values of each pixel, averaged over its three channels."""
    height, width = reference.display.panel.height, reference.display.panel.width
    errors = np.empty((height, width))
    for rows in row_blocks(height, width):
        errors[slice(*rows)] = squared_differences(encode_rows(reference, rows), encode_rows(test, rows))
    return errors


def micro_image_means(values: ArrayLike, display: Display) -> tuple[Real, NDArray[np.intp]]:
    """The mean of ``(H, W)`` values over each micro-image, and how many pixels it has.

    Returns
    -------
    ``(lens_rows, lens_cols)`` means, NaN where a lens has no pixel (corners of slanted and hexagonal arrays), and
    counts. All layouts; every pixel counts once, whether its lens is whole or cut by the panel's edge.
    """
    grid = display.lens_grid
    owner = lens_indices(display).ravel()
    lenses = grid.rows * grid.columns
    counts = np.bincount(owner, minlength=lenses)
    sums = np.bincount(owner, weights=np.asarray(values, dtype=np.float64).ravel(), minlength=lenses)
    means = np.full(lenses, np.nan)
    np.divide(sums, counts, out=means, where=counts > 0)
    return means.reshape(grid.rows, grid.columns), counts.reshape(grid.rows, grid.columns)


@dataclass(frozen=True)
class MicroImage:
    """One micro-image and its PSNR in dB: of lens ``(column, row)``, with ``pixels`` pixels."""

    column: int
    row: int
    pixels: int
    psnr: float


def low_percentile(means: Real, counts: NDArray[np.intp], share: float) -> MicroImage:
    """Micro-image at a low percentile of PSNR, by the nearest-rank method.

    Parameters
    ----------
    means, counts:
        ``(lens_rows, lens_cols)``: mean squared errors and pixels, see :func:`micro_image_means`.
    share:
        Share of the micro-images that are not better, 0 to 1; 0 gives the worst. Of n micro-images in the order of
        their PSNR, the result is number ``ceil(share n)``, counted from 1.
    """
    lenses = np.flatnonzero(counts)
    # A stable order: of equally bad ones the first counts.
    order = lenses[np.argsort(-means.ravel()[lenses], kind="stable")]
    place = max(1, math.ceil(share * len(order))) - 1
    row, column = divmod(int(order[place]), means.shape[1])
    return MicroImage(column, row, int(counts[row, column]), psnr(float(means[row, column])))
