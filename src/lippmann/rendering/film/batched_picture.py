"""A picture whose samples are kept in batches: their sums, how many they are, and what follows from both.

Pixels that are worth it may have more samples than others, but as many in each batch.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Transfer, coding_slope
from lippmann.errors import UsageError
from lippmann.rendering.estimate.jackknife import error_of_batches
from lippmann.rendering.estimate.pixel_errors import OWN_NOISE, PixelErrors
from lippmann.rendering.film.coverage import Coverage
from lippmann.rendering.film.wavefront_plan import Run

Floats = NDArray[np.float32]

#: Independent sample streams: two are the fewest that can be compared, and cost the least evenness.
STREAMS = 2


class BatchedPicture:
    """Sums of the samples of each batch.

    Parameters
    ----------
    batches:
        How many, a multiple of ``STREAMS``.
    shape:
        Height and width of what is traced.
    channels:
        1, or 3 where each pixel has samples of its sub-pixels.
    transfer:
        How values become codes; errors are measured between codes.
    keeps_seen, keeps_coverage, keeps_rays:
        Whether seen light, coverage, and the rays of each pixel are kept, too.
    blur_after:
        What blur adds to the squared error of each traced pixel ``(H, W, 3)``, linear, after so many samples; None
        where there is none.
    """

    def __init__(
        self,
        batches: int,
        shape: tuple[int, int],
        channels: int,
        transfer: Transfer,
        *,
        keeps_seen: bool,
        keeps_coverage: bool,
        keeps_rays: bool,
        blur_after: Callable[[int], Floats | None],
    ) -> None:
        pixels = shape[0] * shape[1]
        self._shape, self._channels, self._transfer = shape, channels, transfer
        self._sums = np.zeros((batches, pixels, 3), dtype=np.float32)
        self._seen = np.zeros((STREAMS, pixels, 3), dtype=np.float32) if keeps_seen else None
        self._excess = np.zeros((1, pixels, 3), dtype=np.float32) if keeps_seen else None
        self._covered = np.zeros((STREAMS, pixels, channels), dtype=np.float32) if keeps_coverage else None
        #: Samples that each batch has of every pixel; how many more of single ones, and of all on the average.
        self._taken = [0] * batches
        self._further = np.zeros(pixels, dtype=np.uint32)
        self._further_mean = 0
        #: Rays of each pixel, where it is told what else differs from pixel to pixel.
        self._rays_of_pixels = np.zeros(pixels, dtype=np.float32) if keeps_rays else None
        # Plain and denoised pictures of the same samples both ask for their errors.
        self._errors: PixelErrors | None = None
        self._blur_after = blur_after

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of what is rendered."""
        return self._shape

    @property
    def samples(self) -> int:
        """Samples that each pixel has had, on the average."""
        return sum(self._taken) + self._further_mean

    @property
    def batches(self) -> int:
        """Samples of single pixels come in multiples of this."""
        return len(self._taken)

    @property
    def _batches_of_stream(self) -> int:
        return self.batches // STREAMS

    def samples_of_pixels(self) -> NDArray[np.uint32]:
        """``(H, W)``: samples that each pixel of the picture has had."""
        return self.of_picture(self._counts(sum(self._taken), self.batches)).astype(np.uint32)

    def rays_of_sample(self) -> Floats:
        """``(H, W)``: rays that a sample of each pixel takes, as its samples so far show; 1 where they do not."""
        counts = np.maximum(1, self._counts(sum(self._taken), self.batches) * self._channels)
        rays = np.float32(0) if self._rays_of_pixels is None else self._rays_of_pixels
        return self.of_picture(np.maximum(1, rays / counts))

    def of_picture(self, values: Floats) -> Floats:
        """``(H, W)`` of ``(pixels,)`` of what is traced."""
        return values.reshape(self.shape)

    def traced(self, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Of pixels ``(H, W)`` of the picture those of what is traced."""
        return chosen

    def picture(self) -> Floats:
        """``(H, W, 3)`` float32: the mean of all samples, linear; black where there are none."""
        return self.shown(self.traced_picture())

    def traced_picture(self) -> Floats:
        """:meth:`picture` with all that is traced of it, see :meth:`shown`."""
        return self._mean(self._sums)

    def traced_halves(self) -> tuple[Floats, Floats]:
        """The means of either stream's samples, with all that is traced; they know nothing of each other."""
        per_stream = self._batches_of_stream
        return self._means([self._sums[s * per_stream : (s + 1) * per_stream].sum(axis=0) for s in range(STREAMS)])

    def seen_halves(self) -> tuple[Floats, Floats] | None:
        """What of :meth:`traced_halves` is seen light; None where that is not told, or not kept."""
        return None if self._seen is None else self._means(list(self._seen))

    def seen(self) -> Floats | None:
        """What of :meth:`traced_picture` is seen light; None where that is not told, or not kept."""
        return None if self._seen is None else self._mean(self._seen)

    def coverage_halves(self) -> tuple[Coverage, Coverage] | None:
        """As the samples of either of :meth:`traced_halves` tell it; None where it is not told, or not kept."""
        if self._covered is None:
            return None
        shares, counts = self._means(list(self._covered)), self._per_stream()
        if not self._further_mean:
            return Coverage(shares[0], counts[0]), Coverage(shares[1], counts[1])
        further = (self._batches_of_stream * self._further).reshape(*self.shape, 1)
        return Coverage(shares[0], counts[0] + further), Coverage(shares[1], counts[1] + further)

    def excess(self) -> Floats | None:
        """What of :meth:`picture` rests on single chains of seen light, see
        :mod:`lippmann.rendering.transport.seen_light`; None where that is not told, or not kept."""
        return None if self._excess is None else self.shown(self._mean(self._excess))

    def _mean(self, sums: Floats) -> Floats:
        """Of all samples, whose sums lie in several parts."""
        total: Floats = sums.sum(axis=0)
        total *= self._weights(sum(self._taken), self.batches)
        return total.reshape(*self.shape, 3)

    def _weights(self, of_all: int, batches: int) -> Floats | np.float32:
        """Of a sample in each pixel's mean ``(pixels, 1)`` over so many batches; one number where all have as many."""
        if not self._further_mean:
            return np.float32(1 / max(1, of_all))
        return np.reciprocal(np.maximum(1, self._counts(of_all, batches)))[:, None]

    def _counts(self, of_all: int, batches: int) -> Floats:
        """``(pixels,)``: samples in so many batches that together have ``of_all`` of every pixel."""
        counts: Floats = of_all + batches * self._further.astype(np.float32)
        return counts

    def _means(self, sums: Sequence[Floats]) -> tuple[Floats, Floats]:
        """Of the sums of each stream."""
        each = self._batches_of_stream
        parts = [
            (total * self._weights(n, each)).reshape(*self.shape, -1)
            for total, n in zip(sums, self._per_stream(), strict=True)
        ]
        return parts[0], parts[1]

    def _per_stream(self) -> list[int]:
        """Samples of every pixel that each stream has had."""
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
            further = None
            if self._further_mean:
                further = self.of_picture(self._further.astype(np.float32))
            error, outliers = error_of_batches(self.shown(self._sums), self._taken, self._transfer, further)
            shape = self.shape[0], -1
            error = error.reshape(shape)
            blur = self.squared_blur()
            if blur is not None:
                error += blur
            self._errors = PixelErrors(error, outliers.reshape(shape), OWN_NOISE, blur=blur)
        return self._errors

    def squared_blur(self) -> Floats | None:
        """``(H, W)``: what the blur of caustics adds to the squared errors of the codes; None where there is none.

        See :class:`lippmann.rendering.film.caustic_blur.SquaredBlur`.
        """
        linear = self._blur_after(self.samples)
        if linear is None:
            return None
        slope = coding_slope(self.picture(), self._transfer)
        blur: Floats = (np.square(slope) * self.shown(linear)).mean(axis=-1)
        return blur

    def shown(self, values: Floats) -> Floats:
        """Of values ``(..., W, 3)`` of what is traced those that the picture shows."""
        return values

    def _keep(self, run: Run, sums: dict[str, Floats], chosen: NDArray[np.uint32] | None = None) -> None:
        """Add to its batches what :func:`~lippmann.rendering.film.wavefront.sums_of` gives for a run: of all pixels, or
        of those with the numbers ``chosen``.
        """
        per_stream = self._batches_of_stream
        pixels = slice(run.first, run.last) if chosen is None else chosen[run.first : run.last]
        rays = sums.pop("rays", None)
        if self._rays_of_pixels is not None and rays is not None:
            self._rays_of_pixels[pixels] += rays
        for place, batch in enumerate(run.batches):
            kept = {
                "radiance": (self._sums, batch),
                "seen": (self._seen, batch // per_stream),
                "excess": (self._excess, 0),
                "covered": (self._covered, batch // per_stream),
            }
            for name, part in sums.items():
                total, at = kept[name]
                assert total is not None
                total[at, pixels] += part[:, place]
