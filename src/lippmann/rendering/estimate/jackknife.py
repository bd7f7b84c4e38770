"""Squared error of each pixel of a picture, by a jackknife over its batches of samples.

Errors are those between codes, as :mod:`lippmann.metrics.mse_psnr` measures them. Noise is in linear light, and the
transfer curve bends and clips it. Two terms are added:

- The jackknife (Quenouille 1956, Tukey 1958): the variance of the *code* of the mean when any one batch is left out.
  The mean without a batch is nearly as good as the mean itself, so curve and clipping act on both alike.
- A correction for stratified samples, whose batches within one stream are negatively correlated: the squared difference
  between the means of the two streams, less that between halves that mix both streams.

Where single samples decide (a firefly in one batch), the pixels that were *not* hit are wrong, too, and their own
samples do not reveal it. This part of the error is returned apart as *outliers*.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Coding
from lippmann.device.kernel_ops import encode, upload
from lippmann.device.types import Bool, Color3f, Float
from lippmann.rendering.estimate.tuning import TUNING
from lippmann.rendering.request.tuning import TUNING as REQUEST

Floats = NDArray[np.float32]


def error_of_batches(sums: Floats, taken: Sequence[int], coding: Coding) -> tuple[Floats, Floats]:
    """Estimated squared error of the code of each pixel's mean, averaged over the three channels.

    Parameters
    ----------
    sums:
        ``(batches, pixels, 3)``: linear sums of the samples. The first half of the batches comes from one stream of
        samples, the second half from another.
    taken:
        How many samples each batch has of every pixel; each stream has at least one.
    coding:
        How values become codes.

    Returns
    -------
    ``(pixels,)`` errors, and the part of each that rests on outliers, at least 0. Errors are unbiased unless bright
    hits are rare; single ones are noisy and may be negative.
    """
    pixels = sums.shape[1]
    # Opaque to the compiler, so that every round runs the same kernel.
    counts = [dr.opaque(mi.Float, number) for number in taken]
    error, outliers = np.empty(pixels, dtype=np.float32), np.empty(pixels, dtype=np.float32)
    step = 1 << 18  # pixels worked on at a time
    for first in range(0, pixels, step):
        part = slice(first, min(first + step, pixels))
        # All at once, and not from a picture turned over, whose size the kernel would hold.
        table, size = upload(sums[:, part]), part.stop - first
        index = dr.arange(mi.UInt32, size)
        values = [dr.gather(mi.Color3f, table, index + dr.opaque(mi.UInt32, k * size)) for k in range(len(sums))]
        of_part = _Batches(values, counts, coding)
        jackknife, alone = of_part.jackknife()
        result = jackknife + of_part.evenness()
        dr.eval(result, alone)
        error[part], outliers[part] = np.array(result), np.array(alone)
    return error, outliers


@dataclass
class _Batches:
    """Sums (``mi.Color3f``) and counts (``mi.Float``) of all batches of some pixels."""

    sums: list[Color3f]
    counts: list[Float]
    coding: Coding

    def __post_init__(self) -> None:
        self.total = sum(self.sums[1:], self.sums[0])
        self.count = sum(self.counts[1:], self.counts[0])

    def jackknife(self) -> tuple[Float, Float]:
        """Jackknife estimate of the squared error, and the part of it that rests on outliers."""
        without = [
            encode((self.total - value) / dr.maximum(self.count - count, 1), self.coding)
            for value, count in zip(self.sums, self.counts, strict=True)
        ]
        # Empty batches do not count.
        present = [dr.select(count > 0, mi.Float(1), mi.Float(0)) for count in self.counts]
        weight = sum(present[1:], present[0])
        mean = sum((code * p for code, p in zip(without, present, strict=True)), mi.Color3f(0)) / weight
        moves = [dr.square(code - mean) * p for code, p in zip(without, present, strict=True)]
        error, spread, largest = mi.Float(0), mi.Float(0), mi.Float(0)
        for move, count in zip(moves, self.counts, strict=True):
            size = dr.sum(move) / 3
            error += size * (self.count - count) / self.count
            spread += size
            largest = dr.maximum(largest, size)
        decides = largest > TUNING.outlier_share * (weight - 1) / weight * spread
        decides &= largest > TUNING.outlier_step**2 / 3
        decides &= weight >= REQUEST.fewest
        return error, dr.select(decides, error, 0)

    def evenness(self) -> Float:
        """Squared difference between the two streams, less the mean of that between halves that mix both."""
        streams, _ = self._difference(range(len(self.sums) // 2))
        mixed, number = mi.Float(0), mi.Float(0)
        for split in _mixed_halves(len(self.sums)):
            difference, known = self._difference(split)
            mixed += difference
            number += dr.select(known, mi.Float(1), mi.Float(0))
        filled = sum((dr.select(count > 0, mi.Float(1), mi.Float(0)) for count in self.counts), mi.Float(0))
        # In linear light the jackknife is the mean over (batches - 1) orthogonal ways to halve the batches, one of them
        # by streams. With this weight, jackknife and evenness add up to the squared difference of the streams.
        weight = (filled - 2) / dr.maximum(filled - 1, 1)
        return dr.select(number > 0, weight * (streams - mixed / dr.maximum(number, 1)), 0)

    def _difference(self, members: Sequence[int]) -> tuple[Float, Bool]:
        """Squared error of the mean by the difference between ``members`` and the others; 0, False if one is empty."""
        some = sum((self.sums[k] for k in members), mi.Color3f(0))
        number = sum((self.counts[k] for k in members), mi.Float(0))
        rest = self.count - number
        known = (number > 0) & (rest > 0)
        a = encode(some / dr.maximum(number, 1), self.coding)
        b = encode((self.total - some) / dr.maximum(rest, 1), self.coding)
        size = dr.sum(dr.square(a - b)) / 3 * number * rest / dr.square(self.count)
        return dr.select(known, size, 0), known


def _mixed_halves(batches: int) -> list[tuple[int, ...]]:
    """Halves of the batches with equal parts of both streams, orthogonal to each other (Walsh functions)."""
    if batches == 2:
        return []
    streams = [k >= batches // 2 for k in range(batches)]
    halves = []
    for pattern in range(1, batches):
        half = tuple(k for k in range(batches) if bin(pattern & k).count("1") % 2 == 0)
        if len({streams[k] for k in half}) == 2:
            halves.append(half)
    # More of them hardly reduce the variance.
    return halves[:3]
