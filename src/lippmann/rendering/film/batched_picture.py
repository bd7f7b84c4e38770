"""A picture as sums and counts of several batches of samples, with its half-buffers and its error estimate."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Coding, coding_slope
from lippmann.errors import UsageError
from lippmann.rendering.estimate.jackknife import error_of_batches
from lippmann.rendering.estimate.psnr import PixelErrors
from lippmann.rendering.film.memory_model import Run
from lippmann.rendering.film.wavefront import Coverage

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
        #: Samples that each batch has of every pixel.
        self._taken = [0] * batches
        # Plain and denoised pictures of the same samples both ask for their errors.
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
        return self.displayed(self.traced_picture())

    def traced_picture(self) -> Floats:
        """:meth:`picture` with all that is traced of it, see :meth:`displayed`."""
        return self._mean(self._sums)

    def traced_halves(self) -> tuple[Floats, Floats]:
        """Half-buffers A and B: the means of either stream, of all that is traced."""
        per_stream = self._batches_of_stream
        return self._means([self._sums[s * per_stream : (s + 1) * per_stream].sum(axis=0) for s in range(STREAMS)])

    def specular_halves(self) -> tuple[Floats, Floats] | None:
        """The specular light in :meth:`traced_halves`; None where it is not kept."""
        return None if self._specular is None else self._means(list(self._specular))

    def specular(self) -> Floats | None:
        """The specular light in :meth:`traced_picture`; None where it is not kept."""
        return None if self._specular is None else self._mean(self._specular)

    def coverage_halves(self) -> tuple[Coverage, Coverage] | None:
        """Coverage of either half-buffer; None where it is not kept."""
        if self._covered is None:
            return None
        first, second = map(Coverage, self._means(list(self._covered)), self._per_stream())
        return first, second

    def excess(self) -> Floats | None:
        """The light of :meth:`picture` above the clamp on its specular chains; None where it is not kept."""
        return None if self._excess is None else self.displayed(self._mean(self._excess))

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
        """The expected squared error of every pixel's code, see
        :func:`lippmann.rendering.estimate.jackknife.error_of_batches`.

        Raises
        ------
        UsageError
            If there are fewer than two samples per pixel.
        """
        if self.samples < STREAMS:
            raise UsageError("one sample per pixel does not tell its own error", rule="two or more do")
        if self._errors is None:
            error, outliers = error_of_batches(self.displayed(self._sums), self._taken, self._coding)
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
        blur: Floats = (np.square(slope) * self.displayed(self._blur_after(self.samples))).mean(axis=-1)
        return blur

    def displayed(self, values: Floats) -> Floats:
        """The display's pixels from traced values ``(..., W, 3)``."""
        return values

    def _keep(self, run: Run, sums: dict[str, Floats]) -> None:
        """Add the sums of a run (:func:`~lippmann.rendering.film.wavefront.sum_samples`) to its batches."""
        per_stream = self._batches_of_stream
        pixels = slice(run.first, run.last)
        for place, batch in enumerate(run.batches):
            kept = {
                "radiance": (self._sums, batch),
                "specular": (self._specular, batch // per_stream),
                "excess": (self._excess, 0),
                "covered": (self._covered, batch // per_stream),
            }
            for name, part in sums.items():
                total, at = kept[name]
                assert total is not None
                total[at, pixels] += part[:, place]
