"""A picture whose noise is taken out, and that still knows how good it is.

Each half of the samples is denoised by itself, and the picture is the mean of the two. The network is shown the second
one upside down: what it gets wrong of itself is not the same in both then, and the mean is nearer to the truth.

A denoised half knows nothing of the other, noisy half, which therefore can judge it: for denoised halves D(a) and D(b)
of noisy ones a and b, the mean of (a - D(a)) (b - D(b)) is that of the product of the errors of D(a) and D(b), what
they have wrong in common. The squared error of their mean is that and a quarter of (D(a) - D(b))^2, what they differ
by.

Where a denoised half is judged to be worse than its samples, they take its place
(:mod:`lippmann.rendering.denoise.noisy_blend`), so that with ever more samples the picture comes to be what they show,
whatever a denoiser does. The other half has a say in that, but none of its pixels in its own place, so that it can
still judge.

Outlines in front of the background are made sharper first, by the rays of the guides
(:mod:`lippmann.rendering.denoise.outlines`): each half by half of them, so that what these get wrong is told, too.

Errors are small and the curve of the codes is taken as straight, but for pixels that the denoiser made far brighter
than the samples show, as it does beside emitters: where that is beyond white, the curve is cut off, and in the dark it
is steep. There the step of the code from what the samples show counts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Transfer, coding_slope, encode
from lippmann.rendering.denoise.noisy_blend import mean_around, weigh_samples
from lippmann.rendering.denoise.outlines import exchange_coverage
from lippmann.rendering.denoise.tuning import TUNING
from lippmann.rendering.estimate.pixel_errors import PixelErrors
from lippmann.rendering.estimate.tuning import TUNING as ESTIMATE
from lippmann.rendering.film.wavefront import Coverage
from lippmann.runtime.row_threads import Bands

if TYPE_CHECKING:
    from lippmann.rendering.film.batched_picture import BatchedPicture

Floats = NDArray[np.float32]
#: A clean picture from a noisy one of so many samples; and whether that is to be turned, see
#: :func:`~lippmann.rendering.denoise.oidn.denoise`.
Denoise = Callable[[Floats, int, bool], Floats]


class Denoised:
    """The pictures of ``renderer`` after ``denoise``; see the head of this module.

    Parameters
    ----------
    renderer:
        The samples, from two streams that know nothing of each other.
    denoise:
        From a noisy ``(H, W, 3)`` linear picture to a clean one, turned for the second half.
    transfer:
        How values become codes; errors are measured between codes.
    threads:
        CPU threads.
    coverage:
        By either half of the rays of the denoiser's guides; None where it is not known.
    """

    def __init__(
        self,
        renderer: BatchedPicture,
        denoise: Denoise,
        transfer: Transfer,
        threads: int = 1,
        coverage: Callable[[], tuple[Coverage, Coverage] | None] | None = None,
    ) -> None:
        self._renderer = renderer
        self._denoise = denoise
        self._coverage = coverage
        self._transfer: Transfer = transfer
        self._threads = threads
        #: What the picture shows of the halves as they were traced, and of the clean ones.
        self._halves: tuple[tuple[Floats, Floats], tuple[Floats, Floats]] | None = None
        self._samples_of_halves = 0

    def picture(self) -> Floats:
        """``(H, W, 3)`` float32 linear RGB."""
        return remove_excess(self._mean(), self._renderer.excess())

    def squared_error(self) -> PixelErrors:
        """Squared error of every pixel's code, as the halves judge each other."""
        noisy, clean = self._clean_halves()
        slope = self._slope(noisy)
        apart: Floats = (np.float32(0.25) * np.square(slope * (clean[0] - clean[1]))).mean(axis=2)
        left = [slope * (half - smooth) for half, smooth in zip(noisy, clean, strict=True)]
        common = (left[0] * left[1]).mean(axis=2)
        limit = TUNING.hidden * max(1.0, TUNING.of_samples / self._renderer.samples)
        hidden = np.maximum(np.abs(left[0]), np.abs(left[1])).max(axis=2) > limit
        common[hidden] = np.float32(ESTIMATE.outlier_ratio) * apart[hidden]
        samples = self._renderer.squared_error()
        if samples.blur is not None:
            common += samples.blur
        if self._renderer.samples < ESTIMATE.outliers_told_from:
            # Any hit may be.
            samples = replace(samples, outliers=np.float32(TUNING.untold_outliers) * np.maximum(samples.values, 0))
        return PixelErrors(common + apart, None, samples, apart, samples.blur)

    def _mean(self) -> Floats:
        if self._renderer.samples < 2:
            # There are no halves, and nothing is known of the error.
            return self._clean_picture()
        _, (first, second) = self._clean_halves()
        mean: Floats = np.float32(0.5) * (first + second)
        return mean

    def _clean_picture(self) -> Floats:
        noisy, coverage = self._renderer.traced_picture(), self._coverages()
        if coverage is not None:
            (paths, further), (more_paths, more_further) = coverage
            noisy = exchange_coverage(noisy, paths + more_paths, further + more_further, threads=self._threads)
        return self._renderer.shown(clean_light(noisy, self._renderer.seen(), self._denoise, self._renderer.samples))

    def _clean_halves(self) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        if self._halves is None or self._samples_of_halves != self._renderer.samples:
            self._samples_of_halves = self._renderer.samples
            traced, seen = self._noisy_halves(), self._renderer.seen_halves() or (None, None)
            first, second = (
                self._renderer.shown(
                    clean_light(traced[k], seen[k], self._denoise, self._renderer.samples, turned=k == 1)
                )
                for k in (0, 1)
            )
            noisy = self._renderer.shown(traced[0]), self._renderer.shown(traced[1])
            own = weigh_samples(noisy, (first, second), self._transfer, threads=self._threads)
            self._halves = noisy, (first + own * (noisy[0] - first), second + own * (noisy[1] - second))
        return self._halves

    def _noisy_halves(self) -> tuple[Floats, Floats]:
        """What is traced of the halves, outlines by all rays."""
        halves, coverage = self._renderer.traced_halves(), self._coverages()
        if coverage is None:
            return halves
        threads = self._threads
        first, second = (
            exchange_coverage(half, *both, threads=threads) for half, both in zip(halves, coverage, strict=True)
        )
        return first, second

    def _coverages(self) -> list[tuple[Coverage, Coverage]] | None:
        """Of each half by its paths, and by its rays of the guides; None where either is not known."""
        paths = self._renderer.coverage_halves()
        further = None if paths is None or self._coverage is None else self._coverage()
        return None if paths is None or further is None else list(zip(paths, further, strict=True))

    def _slope(self, noisy: tuple[Floats, Floats]) -> Floats:
        """By how much a pixel's code differs from that of the truth, per linear difference between the two."""
        picture, transfer = self._mean(), self._transfer
        slope = coding_slope(picture, transfer)
        shown = np.float32(0.5) * (noisy[0] + noisy[1])
        scatter = np.abs(noisy[0] - noisy[1]).mean(axis=2)
        nearby = mean_around(scatter, 1, Bands(self._threads))[..., None]
        truth = np.where(picture > 1, np.minimum(shown, 1), shown + np.float32(TUNING.far_above) * nearby)
        far = picture - truth > 1e-4  # smaller steps are as good as a slope, and hold rounding
        low, high = truth[far], picture[far]
        slope[far] = (encode(high, transfer) - encode(low, transfer)) / (high - low)
        return slope


def clean_light(noisy: Floats, seen: Floats | None, denoise: Denoise, samples: int, turned: bool = False) -> Floats:
    """What was traced without its noise, but for light that goes past the denoiser.

    Seen light, where the renderer keeps it apart, has hardly any noise, and highlights that a denoiser takes for such:
    it goes past the network and past what is shared. So does, at its pixels, other light as far as it is far beyond
    white: the skirt of a narrow lobe is not sharp, and shows enough of a mirrored emitter for the network to make the
    pixels beside it white, too.

    Elsewhere the network is shown nothing that is far beyond white: it would make the pixels around one path white that
    has happened upon an emitter. A pixel that is nearly as bright all the same after it is as bright as its samples.

    Parameters
    ----------
    noisy:
        ``(H, W, 3)`` linear.
    seen:
        What of it is seen light; None where that is not known.
    denoise, samples, turned:
        From a noisy picture to a clean one; see :data:`Denoise`.
    """
    limit = np.float32(TUNING.far_beyond_white)
    past = np.float32(0) if seen is None else np.where(seen > limit, np.maximum(noisy - limit, seen), seen)
    rest = noisy if seen is None else noisy - past
    clean = denoise(np.minimum(rest, limit), samples, turned) + past
    if (rest > limit).any():
        clean += np.where(clean - past >= np.float32(0.75) * limit, np.maximum(rest - limit, 0), np.float32(0))
    return clean


def remove_excess(picture: Floats, excess: Floats | None) -> Floats:
    """``picture`` without what of it rests on single chains of seen light, not below 0.

    The error stays that of the mean of the halves, which is larger as a rule.
    """
    return picture if excess is None else np.maximum(picture - excess, np.float32(0))
