"""Squared errors of what a panel shows, pooled over the picture or kept apart by micro-image.

Errors are taken between *coded* values in [0, 1]: what the display is driven with, so that a step means about the same
to the eye in the dark and in the light. Each picture is coded by its own transfer (the sRGB curve, or none where the
values are display codes already), as its files are; the values are not rounded to whole codes.
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
from lippmann.image import Picture
from lippmann.image.micro_images import lens_indices, row_blocks
from lippmann.image.stored_values import Values

Real = NDArray[np.float64]
Scalar = TypeVar("Scalar", bound=np.generic)
Float = TypeVar("Float", np.float32, np.float64)

#: The share of micro-images that may be worse than the low percentile that is reported.
LOW_PERCENTILE = 0.01


def psnr(mean_squared_error: float, peak: float = 1.0) -> float:
    """Peak signal-to-noise ratio in dB, ``10 log10(peak^2 / mean_squared_error)``; infinite if there is no error."""
    return math.inf if mean_squared_error == 0 else 10 * math.log10(peak * peak / mean_squared_error)


def coded(image: Picture, rows: tuple[int, int] | None = None) -> Real:
    """Coded values in [0, 1] of the rows ``first`` to before ``last`` (all if None), ``(rows, W, 3)`` float64."""
    first, last = rows or (0, image.display.panel.height)
    return coded_values(image.held_rows(first, last), image.provenance.transfer)


def coded_values(values: Values, transfer: Transfer) -> Real:
    """Coded values in [0, 1] of linear ones, or of codes of 8 or 16 bits, float64; same shape."""
    if values.dtype.kind == "u":
        return looked_up(values, _coded_levels(values.dtype, transfer))
    return np.asarray(encode(values.astype(np.float64), transfer))


@lru_cache(maxsize=4)
def _coded_levels(dtype: np.dtype[np.generic], transfer: Transfer) -> Real:
    """The coded values of all codes of a type."""
    return coded_values(linear_levels(dtype, transfer), transfer)


def looked_up(codes: Values, levels: NDArray[Scalar]) -> NDArray[Scalar]:
    """``levels[codes]``: for pictures of codes a small part of the time that the curve takes."""
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
        errors[slice(*rows)] = squared_differences(coded(reference, rows), coded(test, rows))
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
    """The micro-image that a ``share`` of them, itself included, is not better than; 0 gives the worst.

    The nearest-rank percentile: of n micro-images in the order of their PSNR the one in place ``ceil(share n)``, the
    first in place 1, so that it is always one that can be looked at. ``means`` and ``counts`` are those of
    :func:`micro_image_means` of squared errors.
    """
    lenses = np.flatnonzero(counts)
    # A stable order: of equally bad ones the first counts.
    order = lenses[np.argsort(-means.ravel()[lenses], kind="stable")]
    place = max(1, math.ceil(share * len(order))) - 1
    row, column = divmod(int(order[place]), means.shape[1])
    return MicroImage(column, row, int(counts[row, column]), psnr(float(means[row, column])))
