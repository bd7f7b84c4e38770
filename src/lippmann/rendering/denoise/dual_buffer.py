"""A picture whose noise is taken out, and that still knows how good it is.

Each half of the samples is denoised by itself, and the picture is the mean of the two. The network is shown the second
one upside down: what it gets wrong of itself is not the same in both then, and the mean is nearer to the truth.

A denoised half knows nothing of the other, noisy half, which therefore can judge it: for denoised halves D(a) and D(b)
of noisy ones a and b, the mean of (a - D(a)) (b - D(b)) is that of the product of the errors of D(a) and D(b), what
they have wrong in common. The squared error of their mean is that and a quarter of (D(a) - D(b))^2, what they differ
by.

Seen light, and what is far beyond white, goes past the denoiser (:mod:`lippmann.rendering.denoise.light_apart`). What
of it rests on single chains the picture leaves out, while its error is that of the mean of the halves, which is larger
as a rule.

Micro-images may share the light of a denoised half, and it keeps its own where that is judged to be better
(:mod:`lippmann.rendering.denoise.unshared_blend`). Where what comes of that is judged to be worse than its samples,
they take its place (:mod:`lippmann.rendering.denoise.noisy_blend`), so that with ever more samples the picture comes to
be what they show, whatever a denoiser does. The other half has a say in both, but none of its pixels in its own place,
so that it can still judge.

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
from lippmann.rendering.denoise.light_apart import clean_light, remove_excess
from lippmann.rendering.denoise.local_statistics import mean_around
from lippmann.rendering.denoise.noisy_blend import weigh_samples
from lippmann.rendering.denoise.outlines import exchange_coverage
from lippmann.rendering.denoise.unshared_blend import own_light
from lippmann.rendering.estimate.bias_posterior import OUTLIER_RATIO
from lippmann.rendering.estimate.jackknife import OUTLIERS_TOLD_FROM
from lippmann.rendering.estimate.pixel_errors import CROSS_NOISE, PixelErrors
from lippmann.rendering.film.coverage import Coverage
from lippmann.runtime.row_threads import Bands

if TYPE_CHECKING:
    from lippmann.rendering.film.batched_picture import BatchedPicture

Floats = NDArray[np.float32]
#: Of the halves' mean difference nearby: a pixel that is brighter than its samples by more is so by no accident.
FAR_ABOVE = 4.0
#: Samples that are farther off, in codes, than any error is by so many times hide what is wrong in their pixel, and few
#: of them what is wrong in the picture: there the ratio of outliers is taken. With 4 some pictures are flattered.
DROWNED = 8.0
#: With fewer samples a single one is farther off, and more likely all there is of its light: less is left out then.
MANY = 16
#: Share of the samples' error that is taken to rest on outliers where too few batches tell them.
UNTOLD_OUTLIERS = 0.25
#: A clean picture from a noisy one; and whether that is to be turned, see
#: :func:`~lippmann.rendering.denoise.oidn.denoise`.
Denoise = Callable[[Floats, bool], Floats]
Share = Callable[[Floats], Floats]


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
    share:
        From a clean picture to one whose parts share their light; None where they do not.
    coverage:
        By either half of the rays of the denoiser's guides; None where it is not known.
    """

    def __init__(
        self,
        renderer: BatchedPicture,
        denoise: Denoise,
        transfer: Transfer,
        threads: int = 1,
        share: Share | None = None,
        coverage: Callable[[], tuple[Coverage, Coverage] | None] | None = None,
    ) -> None:
        self._renderer = renderer
        self._denoise = denoise
        self._share = share
        self._coverage = coverage
        self._transfer: Transfer = transfer
        self._threads = threads
        #: What is traced of the halves, and what comes of them.
        self._noisy: tuple[Floats, Floats] | None = None
        self._cleaned: tuple[Floats, Floats] | None = None
        self._cleaned_samples = 0

    def picture(self) -> Floats:
        """``(H, W, 3)`` float32 linear RGB."""
        return remove_excess(self._mean(), self._renderer.excess())

    def _mean(self) -> Floats:
        if self._renderer.samples < 2:
            # There are no halves, and nothing is known of the error.
            return self._clean_picture()
        first, second = self._clean_halves()
        mean: Floats = np.float32(0.5) * (first + second)
        return mean

    def squared_error(self) -> PixelErrors:
        """Squared error of every pixel's code, as the halves judge each other."""
        clean = self._clean_halves()
        noisy = self._shown_halves()
        slope = self._slope(noisy)
        apart = _apart(clean, slope)
        left = [slope * (half - smooth) for half, smooth in zip(noisy, clean, strict=True)]
        common = (left[0] * left[1]).mean(axis=2)
        limit = DROWNED * max(1.0, MANY / self._renderer.samples)
        drowned = np.maximum(np.abs(left[0]), np.abs(left[1])).max(axis=2) > limit
        common[drowned] = np.float32(OUTLIER_RATIO) * apart[drowned]
        samples = self._renderer.squared_error()
        if samples.blur is not None:
            common += samples.blur
        if self._renderer.samples < OUTLIERS_TOLD_FROM:
            # Any hit may be.
            samples = replace(samples, outliers=np.float32(UNTOLD_OUTLIERS) * np.maximum(samples.values, 0))
        outliers = self._seen_outliers(samples, slope)
        return PixelErrors(common + apart, outliers, CROSS_NOISE, samples, apart, samples.blur)

    def _seen_outliers(self, samples: PixelErrors, slope: Floats) -> Floats | None:
        """What of ``apart`` rests on outliers of seen light: what one half has met of it, and the other has not.

        No denoiser brings them together, and what neither has met is in no difference. What the picture leaves out of
        them is wrong in it no more.
        """
        seen, excess = self._renderer.seen_halves(), self._renderer.excess()
        if seen is None or excess is None or samples.outliers is None:
            return None
        # Excess is that of the mean, and one half's as a rule.
        left = np.maximum(np.abs(self._renderer.shown(seen[0] - seen[1])) - 2 * excess, np.float32(0))
        apart: Floats = (np.float32(0.25) * np.square(slope * left)).mean(axis=2)
        return np.minimum(apart, samples.outliers)

    def _clean_halves(self) -> tuple[Floats, Floats]:
        if self._cleaned is None or self._cleaned_samples != self._renderer.samples:
            self._cleaned_samples = self._renderer.samples
            self._noisy = self._noisy_halves()
            clean = self._best_of_halves()
            noisy = self._shown_halves()
            own = weigh_samples(noisy, clean, self._transfer, threads=self._threads)
            self._cleaned = clean[0] + own * (noisy[0] - clean[0]), clean[1] + own * (noisy[1] - clean[1])
        return self._cleaned

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

    def _shown_halves(self) -> tuple[Floats, Floats]:
        """What the picture shows of the noisy halves."""
        assert self._noisy is not None
        first, second = (self._renderer.shown(half) for half in self._noisy)
        return first, second

    def _clean_picture(self) -> Floats:
        noisy, coverage = self._renderer.traced_picture(), self._coverages()
        if coverage is not None:
            (paths, further), (more_paths, more_further) = coverage
            noisy = exchange_coverage(noisy, paths + more_paths, further + more_further, threads=self._threads)
        return self._cleaned_and_shared(noisy, self._renderer.seen())[-1]

    def _best_of_halves(self) -> tuple[Floats, Floats]:
        """The halves without their noise, shared where that is better."""
        first, second = self._versions()
        if self._share is None:
            return first[0], second[0]
        clean, shared, noisy = (first[0], second[0]), (first[1], second[1]), self._shown_halves()
        own = own_light(noisy, clean, shared, self._transfer, threads=self._threads)
        return shared[0] + own * (clean[0] - shared[0]), shared[1] + own * (clean[1] - shared[1])

    def _versions(self) -> tuple[list[Floats], list[Floats]]:
        """Of each half what :meth:`_cleaned_and_shared` gives."""
        assert self._noisy is not None
        noisy, seen = self._noisy, self._renderer.seen_halves() or (None, None)
        return self._cleaned_and_shared(noisy[0], seen[0]), self._cleaned_and_shared(noisy[1], seen[1], turned=True)

    def _cleaned_and_shared(self, noisy: Floats, seen: Floats | None, turned: bool = False) -> list[Floats]:
        """What the picture shows of what was traced without noise; and, where light is shared, of that with shared
        light."""
        versions = clean_light(noisy, seen, lambda rest: self._denoise(rest, turned), self._share)
        return [self._renderer.shown(version) for version in versions]

    def _slope(self, noisy: tuple[Floats, Floats]) -> Floats:
        """By how much a pixel's code differs from that of the truth, per linear difference between the two."""
        picture, transfer = self._mean(), self._transfer
        slope = coding_slope(picture, transfer)
        shown = np.float32(0.5) * (noisy[0] + noisy[1])
        scatter = np.abs(noisy[0] - noisy[1]).mean(axis=2)
        bands = Bands(self._threads)
        nearby = mean_around(scatter, 1, bands)[..., None]
        apart = shown + np.float32(FAR_ABOVE) * nearby
        truth = np.where(picture > 1, np.minimum(shown, 1), apart)
        far = picture - truth > 1e-4  # smaller steps are as good as a slope, and hold rounding
        low, high = truth[far], picture[far]
        slope[far] = (encode(high, transfer) - encode(low, transfer)) / (high - low)
        return slope


def _apart(halves: tuple[Floats, Floats], slope: Floats) -> Floats:
    """Squared error of the mean of two halves by what they differ."""
    apart: Floats = (np.float32(0.25) * np.square(slope * (halves[0] - halves[1]))).mean(axis=2)
    return apart
