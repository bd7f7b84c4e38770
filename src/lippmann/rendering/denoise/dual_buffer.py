"""Denoising of half-buffers, with an estimate of the error that remains.

Each half-buffer is denoised by itself, and the picture is the mean of the two. The network gets the second one rotated
by 180 degrees, so that its own errors differ between the halves and partly cancel in the mean.

The noisy half-buffers a and b are independent, so each can judge the other's denoised version D(b), D(a). The mean of
(a - D(a)) (b - D(b)) is an unbiased estimate of the product of the errors of D(a) and D(b): their common error. The
squared error of the mean of both is this common error plus a quarter of (D(a) - D(b))^2.

Where a denoised half is estimated to be worse than its samples, these replace it in part
(:mod:`lippmann.rendering.denoise.noisy_blend`). So the picture converges to the mean of the samples whatever the
denoiser does. The weight of a pixel is estimated from the other half leaving this pixel out, so the other half stays
independent of it.

Before denoising, outlines in front of the background are improved by the coverage of the guides' rays
(:func:`correct_coverage`). Each half uses one half of these rays, so that their error is estimated, too.

Errors are those between codes. The denoised halves are compared as codes. The samples are too noisy for that: what they
say of the bias is converted by the slope of the curve. This fails for pixels that the denoiser made far brighter than
the samples, as it does beside emitters: beyond white the curve is clipped, and in the dark it is steep. There the
finite difference between the codes is used. The curve bends, so the code of a noisy picture is too low in the mean even
where its light is right. The jackknife of two halves (Quenouille 1956) estimates this bias: the mean of the halves'
codes less the code of their mean. It matters where light is rare, as that of small emitters in curved mirrors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Coding, coding_chord, encode, encode_with_slope, over_channels
from lippmann.rendering.denoise.noisy_blend import mean_around, weigh_samples
from lippmann.rendering.denoise.tuning import TUNING
from lippmann.rendering.estimate.psnr import PixelErrors
from lippmann.rendering.estimate.tuning import TUNING as ESTIMATE
from lippmann.rendering.film.wavefront import Coverage
from lippmann.rendering.request.tuning import TUNING as REQUEST
from lippmann.runtime.open_image_denoise import keep_filters
from lippmann.runtime.row_threads import Bands

if TYPE_CHECKING:
    from lippmann.rendering.film.batched_picture import BatchedPicture

Floats = NDArray[np.float32]
#: Least total weight of the eight pixels around for a colour; a pixel that is half covered has more.
_LEAST_WEIGHT = 0.05
#: Places of the pixels around one in a square of nine.
_AROUND = [step for step in np.ndindex(3, 3) if step != (1, 1)]
#: Denoises a picture, given its samples per pixel and whether the network gets it rotated, see
#: :func:`~lippmann.rendering.denoise.oidn.denoise`.
Denoise = Callable[[Floats, int, bool], Floats]


class DenoisedPicture:
    """The denoised picture of a renderer's samples; see the module.

    Parameters
    ----------
    samples:
        The samples, in two independent streams.
    denoise:
        Denoises an ``(H, W, 3)`` linear picture.
    coding:
        How values become codes; errors are measured between codes.
    threads:
        CPU threads.
    coverage:
        Returns the coverage by each half of the feature buffers' rays; None, or returns None, where it is not known.
    """

    def __init__(
        self,
        samples: BatchedPicture,
        denoise: Denoise,
        coding: Coding,
        threads: int = 1,
        coverage: Callable[[], tuple[Coverage, Coverage] | None] | None = None,
    ) -> None:
        self._samples = samples
        self._denoise = denoise
        self._coverage = coverage
        self._coding: Coding = coding
        self._threads = threads
        #: The noisy and the blended half-buffers, in display pixels.
        self._halves: tuple[tuple[Floats, Floats], tuple[Floats, Floats]] | None = None
        self._samples_of_halves = 0

    def picture(self) -> Floats:
        """``(H, W, 3)`` float32 linear RGB."""
        return remove_excess(self._blend_halves(), self._samples.excess())

    def squared_error(self) -> PixelErrors:
        """Squared error of every pixel's code, estimated from the two halves."""
        noisy, clean = self._clean_halves()
        first, second = (encode(half, self._coding) for half in clean)
        halves_variance: Floats = over_channels(np.add, np.square(first - second)) * np.float32(1 / 12)
        picture = self._blend_halves()
        codes, slope = encode_with_slope(picture, self._coding)
        bend = codes - np.float32(0.5) * (first + second)
        slope = self._replace_by_secants(slope, picture, noisy)
        left = [slope * (half - smooth) + bend for half, smooth in zip(noisy, clean, strict=True)]
        common = over_channels(np.add, left[0] * left[1]) * np.float32(1 / 3)
        limit = TUNING.hidden * max(1.0, REQUEST.usual / self._samples.samples)
        hidden = over_channels(np.maximum, np.maximum(np.abs(left[0]), np.abs(left[1]))) > limit
        common[hidden] = np.float32(ESTIMATE.outlier_ratio) * halves_variance[hidden]
        of_samples = self._samples.squared_error()
        if of_samples.blur is not None:
            common += of_samples.blur
        if self._samples.samples < REQUEST.fewest:
            # Too few batches to find outliers: part of the error is assumed to rest on them.
            share = np.float32(TUNING.assumed_outliers)
            of_samples = replace(of_samples, outliers=share * np.maximum(of_samples.values, 0))
        return PixelErrors(common + halves_variance, None, of_samples, halves_variance, of_samples.blur)

    def _blend_halves(self) -> Floats:
        if self._samples.samples < 2:
            # A single sample makes no half-buffers and no error estimate.
            return self._clean_picture()
        _, (first, second) = self._clean_halves()
        mean: Floats = np.float32(0.5) * (first + second)
        return mean

    def _clean_picture(self) -> Floats:
        noisy, coverage = self._samples.average_samples(), self._pair_coverages()
        if coverage is not None:
            (paths, further), (more_paths, more_further) = coverage
            noisy = correct_coverage(noisy, paths + more_paths, further + more_further, threads=self._threads)
        return self._samples.to_display(
            denoise_light(noisy, self._samples.specular(), self._denoise, self._samples.samples)
        )

    def _clean_halves(self) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        if self._halves is None or self._samples_of_halves != self._samples.samples:
            self._samples_of_halves = self._samples.samples
            traced, specular = self._average_noisy_halves(), self._samples.specular_halves() or (None, None)
            with keep_filters():
                first, second = (
                    self._samples.to_display(
                        denoise_light(traced[k], specular[k], self._denoise, self._samples.samples, rotated=k == 1)
                    )
                    for k in (0, 1)
                )
            noisy = self._samples.to_display(traced[0]), self._samples.to_display(traced[1])
            own = weigh_samples(noisy, (first, second), self._coding, threads=self._threads)
            self._halves = noisy, (first + own * (noisy[0] - first), second + own * (noisy[1] - second))
        return self._halves

    def _average_noisy_halves(self) -> tuple[Floats, Floats]:
        """The noisy half-buffers, with the coverage of all rays at outlines."""
        halves, coverage = self._samples.average_halves(), self._pair_coverages()
        if coverage is None:
            return halves
        threads = self._threads
        first, second = (
            correct_coverage(half, *both, threads=threads) for half, both in zip(halves, coverage, strict=True)
        )
        return first, second

    def _pair_coverages(self) -> list[tuple[Coverage, Coverage]] | None:
        """Coverage of each half-buffer by its paths, and by its feature rays; None where either is not known."""
        paths = self._samples.coverage_halves()
        further = None if paths is None or self._coverage is None else self._coverage()
        return None if paths is None or further is None else list(zip(paths, further, strict=True))

    def _replace_by_secants(self, slope: Floats, picture: Floats, noisy: tuple[Floats, Floats]) -> Floats:
        """The curve's ``slope``, but the finite difference of codes at pixels far brighter than their samples."""
        coding = self._coding
        displayed = np.float32(0.5) * (noisy[0] + noisy[1])
        scatter = over_channels(np.add, np.abs(noisy[0] - noisy[1])) * np.float32(1 / 3)
        nearby = mean_around(scatter, 1, Bands(self._threads))[..., None]
        truth = displayed + np.float32(TUNING.far_above) * nearby
        if coding == "pbr-neutral":
            # A tone map mixes colours, so they keep their proportions; and it clips nothing.
            far = over_channels(np.logical_or, truth < picture)
            high = picture[far]
            share = np.divide(truth[far], high, out=np.ones_like(high), where=high > 0)
            low = high * np.clip(share, 0, 1).min(axis=1, keepdims=True)
        else:
            truth = np.where(picture > 1, np.minimum(displayed, 1), truth)
            far = truth < picture
            low, high = truth[far], picture[far]
        slope[far] = coding_chord(low, high, coding)
        return slope


def denoise_light(
    noisy: Floats, specular: Floats | None, denoise: Denoise, samples: int, rotated: bool = False
) -> Floats:
    """The denoised picture; specular light and very bright light bypass the denoiser.

    Specular light has hardly any noise, and the denoiser takes its highlights for noise. So where the renderer
    separates it, it bypasses both the network and light sharing. At pixels with bright specular light, other light
    beyond ``far_beyond_white`` bypasses them, too: the tail of a narrow lobe is not sharp, and the network would spread
    a mirrored emitter from it to the pixels beside.

    Elsewhere the network's input is clamped at ``far_beyond_white``: it would spread a single path that hit an emitter
    over the pixels around. Where its output is at least half as bright (for fireflies: a fifth), that
    part is added again.

    Parameters
    ----------
    noisy:
        ``(H, W, 3)`` linear.
    specular:
        Its specular light; None where it is not separated.
    denoise, samples, turned:
        See :data:`Denoise`.
    """
    limit = np.float32(TUNING.far_beyond_white)
    past = (
        np.float32(0) if specular is None else np.where(specular > limit, np.maximum(noisy - limit, specular), specular)
    )
    # Subtracted twice: beside the network each copy of the picture counts.
    clean = denoise(np.minimum(noisy - past, limit), samples, rotated) + past
    rest = noisy - past
    if (rest > limit).any():
        clean += np.where(clean - past >= limit / 2, np.maximum(rest - limit, 0), np.float32(0))
    return clean


def remove_excess(picture: Floats, excess: Floats | None) -> Floats:
    """``picture`` minus the excess of specular chains, at least 0.

    The error estimate stays that of the mean of the halves, which is larger as a rule.
    """
    return picture if excess is None else np.maximum(picture - excess, np.float32(0))


def correct_coverage(pixels: Floats, paths: Coverage, further: Coverage, *, threads: int = 1) -> Floats:
    """``pixels (H, W, 3)``, linear, with the coverage of all rays at outlines in front of the background.

    There the coverage of a pixel with few samples is noisy, and a denoiser cannot know the right one. The difference
    between the coverage by all rays and by the paths alone is multiplied by the difference between the colours of
    surface and background, as estimated from the pixels around, and added. This is a control variate: both coverages
    have the same expectation, and the colours come from other pixels, so the expectation of the pixel does not change.

    Parameters
    ----------
    paths:
        Coverage by the samples of ``pixels``.
    further:
        Coverage by further, independent rays through the same pixels.
    threads:
        CPU threads; the result does not depend on them.

    Returns
    -------
    ndarray
        ``(H, W, 3)`` float32, not negative where it differs; ``pixels`` where the coverages agree, and where no pixel
        around is of one side.
    """
    lacking = (paths + further).share - paths.share
    rows, columns = np.nonzero(over_channels(np.logical_or, lacking))
    if not len(rows):
        return pixels
    result = pixels.astype(np.float32)
    # One coverage for all colours, also where sub-pixels have rays of their own.
    covered = over_channels(np.add, paths.share.astype(np.float64)) / paths.share.shape[2]
    # Colours are averaged with the fourth power of the coverage as weight: mixed pixels hardly count.
    of_surface, behind = (np.pad(np.square(np.square(share)), 1) for share in (covered, 1 - covered))
    colors = np.pad(pixels, ((1, 1), (1, 1), (0, 0)))

    def exchange(first: int, last: int) -> None:
        here = rows[first:last], columns[first:last]
        front_weight, front = _color_around(colors, of_surface, here)
        back_weight, back = _color_around(colors, behind, here)
        is_known = np.minimum(front_weight, back_weight) >= _LEAST_WEIGHT
        exchanged = np.maximum(0, result[here] + lacking[here] * (front - back))
        result[here] = np.where(is_known[:, None], exchanged, result[here])

    Bands(threads).pixels(exchange, len(rows))
    return result


def _color_around(
    colors: Floats, weights: NDArray[np.float64], here: tuple[NDArray[np.intp], NDArray[np.intp]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Total weight ``(N,)`` and mean colour ``(N, 3)`` of one side over the eight pixels around each of ``here``.

    ``colors`` and ``weights`` are those of the picture, padded by one pixel.
    """
    total = np.zeros(len(here[0]))
    within, color, square = np.zeros((3, len(total), 3))
    for down, right in _AROUND:
        there = here[0] + down, here[1] + right
        weight, value = weights[there], colors[there].astype(np.float64)
        total += weight
        within += weight[:, None] * np.minimum(value, 1)
        color += weight[:, None] * value
        square += weight[:, None] * np.square(value)
    each = np.maximum(total, _LEAST_WEIGHT)[:, None]
    # Values beyond white are clipped, so that one highlight does not set the colour of its side. A side that is far
    # beyond white in all its pixels keeps the mean minus one standard deviation.
    mean = color / each
    deviation = np.sqrt(np.maximum(square / each - np.square(mean), 0))
    return total, np.maximum(within / each, mean - deviation)
