"""A picture as sums and counts of several batches of samples, with its half-buffers and its error by a jackknife.

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

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Coding, coding_slope
from lippmann.device.kernel_ops import encode, upload
from lippmann.device.types import Bool, Color3f, Float
from lippmann.errors import UsageError
from lippmann.rendering.estimate.psnr import PixelErrors
from lippmann.rendering.estimate.tuning import TUNING
from lippmann.rendering.film.memory_model import BatchWavefront
from lippmann.rendering.film.wavefront import Coverage
from lippmann.rendering.request.tuning import TUNING as REQUEST

Floats = NDArray[np.float32]

#: Independent sample streams. Two are enough to compare, and keep the best stratification.
STREAMS = 2


class BatchedPicture:
    """Sums of the samples of each batch.

    Parameters
    ----------
    batches:
        Number of batches, a multiple of ``STREAMS``.
    shape:
        Height and width of the traced picture.
    channels:
        1, or 3 where each pixel has samples of its sub-pixels.
    coding:
        How values become codes; errors are measured between codes.
    keeps_specular, keeps_coverage:
        Whether specular light and coverage are kept, too.
    blur_after:
        Squared bias of each traced pixel by the blur of caustics, ``(H, W, 3)`` linear, from the number of samples;
        None without photons.
    """

    def __init__(
        self,
        batches: int,
        shape: tuple[int, int],
        channels: int,
        coding: Coding,
        *,
        keeps_specular: bool,
        keeps_coverage: bool,
        blur_after: Callable[[int], Floats] | None,
    ) -> None:
        pixels = shape[0] * shape[1]
        self._shape, self._coding = shape, coding
        self._sums = np.zeros((batches, pixels, 3), dtype=np.float32)
        self._specular = np.zeros((STREAMS, pixels, 3), dtype=np.float32) if keeps_specular else None
        self._excess = np.zeros((1, pixels, 3), dtype=np.float32) if keeps_specular else None
        self._covered = np.zeros((STREAMS, pixels, channels), dtype=np.float32) if keeps_coverage else None
        #: Samples per pixel of each batch.
        self._taken = [0] * batches
        # Cached: the plain and the denoised picture both ask for it.
        self._errors: PixelErrors | None = None
        self._blur_after = blur_after

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of what is rendered."""
        return self._shape

    @property
    def samples(self) -> int:
        """Samples per pixel so far."""
        return sum(self._taken)

    @property
    def batches(self) -> int:
        """Number of batches."""
        return len(self._taken)

    @property
    def _batches_of_stream(self) -> int:
        return self.batches // STREAMS

    def picture(self) -> Floats:
        """``(H, W, 3)`` float32: the mean of all samples, linear; black where there are none."""
        return self.to_display(self.average_samples())

    def average_samples(self) -> Floats:
        """``(H, W, 3)``: the mean of all samples of traced pixels, before :meth:`to_display`."""
        return self._mean(self._sums)

    def average_halves(self) -> tuple[Floats, Floats]:
        """Half-buffers A and B: the mean of each stream, of traced pixels."""
        per_stream = self._batches_of_stream
        return self._means([self._sums[s * per_stream : (s + 1) * per_stream].sum(axis=0) for s in range(STREAMS)])

    def specular_halves(self) -> tuple[Floats, Floats] | None:
        """The specular light in :meth:`average_halves`; None where it is not kept."""
        return None if self._specular is None else self._means(list(self._specular))

    def specular(self) -> Floats | None:
        """The specular light in :meth:`average_samples`; None where it is not kept."""
        return None if self._specular is None else self._mean(self._specular)

    def coverage_halves(self) -> tuple[Coverage, Coverage] | None:
        """Coverage of either half-buffer; None where it is not kept."""
        if self._covered is None:
            return None
        first, second = map(Coverage, self._means(list(self._covered)), self._per_stream())
        return first, second

    def excess(self) -> Floats | None:
        """The light of :meth:`picture` above the clamp on its specular chains; None where it is not kept."""
        return None if self._excess is None else self.to_display(self._mean(self._excess))

    def _mean(self, sums: Floats) -> Floats:
        """Mean of all samples from partial ``sums``."""
        total: Floats = sums.sum(axis=0)
        total *= np.float32(1 / max(1, self.samples))
        return total.reshape(*self.shape, 3)

    def _means(self, sums: Sequence[Floats]) -> tuple[Floats, Floats]:
        """Means of each stream from its ``sums``."""
        first, second = (
            (total * np.float32(1 / max(1, n))).reshape(*self.shape, -1)
            for total, n in zip(sums, self._per_stream(), strict=True)
        )
        return first, second

    def _per_stream(self) -> list[int]:
        """Samples per pixel of each stream."""
        each = self._batches_of_stream
        return [sum(self._taken[s * each : (s + 1) * each]) for s in range(STREAMS)]

    def squared_error(self) -> PixelErrors:
        """The expected squared error of every pixel's code, see :func:`estimate_batch_errors`.

        Raises
        ------
        UsageError
            If there are fewer than two samples per pixel.
        """
        if self.samples < STREAMS:
            raise UsageError("one sample per pixel does not tell its own error", rule="two or more do")
        if self._errors is None:
            error, outliers = estimate_batch_errors(self.to_display(self._sums), self._taken, self._coding)
            shape = self.shape[0], -1
            error = error.reshape(shape)
            blur = self.squared_blur()
            if blur is not None:
                error += blur
            self._errors = PixelErrors(error, outliers.reshape(shape), blur=blur)
        return self._errors

    def squared_blur(self) -> Floats | None:
        """``(H, W)``: squared bias of the codes by the blur of caustics; None without photons.

        See :class:`lippmann.rendering.film.caustic_blur.SquaredBlur`.
        """
        if self._blur_after is None:
            return None
        slope = coding_slope(self.picture(), self._coding)
        blur: Floats = (np.square(slope) * self.to_display(self._blur_after(self.samples))).mean(axis=-1)
        return blur

    def to_display(self, values: Floats) -> Floats:
        """The display's pixels from traced values ``(..., W, 3)``."""
        return values

    def _sums_of(self, run: BatchWavefront) -> dict[str, list[Floats]]:
        """The sums of a run's pixels by name, one for each of its batches."""
        streams = [batch // self._batches_of_stream for batch in run.batches]
        sums = {
            "radiance": (self._sums, run.batches),
            "specular": (self._specular, streams),
            "excess": (self._excess, [0] * len(streams)),
            "covered": (self._covered, streams),
        }
        return {
            name: [part[k, run.first : run.last] for k in at] for name, (part, at) in sums.items() if part is not None
        }


def estimate_batch_errors(sums: Floats, taken: Sequence[int], coding: Coding) -> tuple[Floats, Floats]:
    """Estimated squared error of the code of each pixel's mean, averaged over the three channels.

    Parameters
    ----------
    sums:
        ``(batches, pixels, 3)``: linear sums of the samples. The first half of the batches comes from one stream of
        samples, the second half from another. ``batches`` is a power of two.
    taken:
        How many samples each batch has of every pixel; each stream has at least one.
    coding:
        How values become codes.

    Returns
    -------
    ``(pixels,)`` errors, and the part of each that rests on outliers, at least 0. Errors are unbiased unless bright
    hits are rare; single ones are noisy and may be negative.
    """
    pixels, of_stream = sums.shape[1], np.reshape(taken, (STREAMS, -1))
    number = of_stream.shape[1]
    while number > 1 and not of_stream[:, number // 2 : number].any():
        number //= 2  # the first batches hold all samples where these are few
    streams = sums.reshape(*of_stream.shape, pixels, 3)[:, :number]
    # Opaque to the compiler, so that every round runs the same kernel.
    counts = [dr.opaque(mi.Float, count) for count in of_stream[:, :number].ravel().tolist()]
    error, outliers = np.empty(pixels, dtype=np.float32), np.empty(pixels, dtype=np.float32)
    step = 1 << 18  # pixels worked on at a time
    for first in range(0, pixels, step):
        part = slice(first, min(first + step, pixels))
        # From one table of all batches; transposing it would make its size a constant of the kernel.
        table, size = upload(streams[:, :, part]), part.stop - first
        index = dr.arange(mi.UInt32, size)
        values = [dr.gather(mi.Color3f, table, index + dr.opaque(mi.UInt32, k * size)) for k in range(len(counts))]
        of_part = _Batches(values, counts, coding)
        variance, alone = of_part.estimate_jackknife()
        result = variance + of_part.correct_stratification()
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

    def estimate_jackknife(self) -> tuple[Float, Float]:
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

    def correct_stratification(self) -> Float:
        """Squared difference between the two streams, less the mean one between halves that mix both streams."""
        streams, _ = self._difference(range(len(self.sums) // 2))
        mixed, number = mi.Float(0), mi.Float(0)
        for split in _mix_halves(len(self.sums)):
            difference, known = self._difference(split)
            mixed += difference
            number += dr.select(known, mi.Float(1), mi.Float(0))
        filled = sum((dr.select(count > 0, mi.Float(1), mi.Float(0)) for count in self.counts), mi.Float(0))
        # In linear light the jackknife equals the mean squared difference of halves, over (batches - 1) orthogonal ways
        # to halve the batches, of which the two streams are one. The weight is such that the jackknife and this value
        # add up to the squared difference of the streams.
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


def _mix_halves(batches: int) -> list[tuple[int, ...]]:
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
