"""How good a picture is by its own account: PSNR with a 95 % interval, of the whole and of its worst micro-image.

It starts from estimates of each pixel's squared error that come out of the rendering itself; no reference is needed.
PSNR is that of :mod:`lippmann.metrics`: the codes' mean squared error over all channels, in dB.

Three things stand between the estimates and a statement about a micro-image:

- The estimates are noisy, and so is the error itself: a picture's error is one draw of what the rendering could have
  done. Both add to the interval.
- The worst of many is not the one with the worst estimate. Each micro-image's estimate is drawn towards what its
  neighbours say, as far as its own noise asks for (empirical Bayes), then pictures that fit are drawn
  at random, and the worst of each is looked at.
- Light that few paths find is missing from most pixels before it shows in any. Errors that rest on outliers widen the
  interval to the worse side.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.display.pixel_window import PixelWindow
from lippmann.image.micro_images import lens_indices, row_blocks
from lippmann.rendering.estimate.pixel_errors import ErrorSums, NoiseShares, PixelErrors, parts_with_pixels

Real = NDArray[np.float64]
Floats = NDArray[np.float32]

#: The layer of a picture with the estimated squared error of each pixel's code.
ERROR_LAYER = "error"


@dataclass(frozen=True)
class Estimate:
    """A picture's PSNR in dB by its own account, each with the ends of its 95 % interval.

    ``psnr``: of all pixels; ``worst``: of the worst micro-image, which is probably lens ``worst_lens`` (column, row). A
    picture without any noise at all has the PSNR ``CEILING``.
    """

    psnr: float
    psnr_low: float
    psnr_high: float
    worst: float
    worst_low: float
    worst_high: float
    worst_lens: tuple[int, int]

    def to_dict(self) -> dict[str, object]:
        """All fields as JSON-able values, rounded to hundredths of a dB; :meth:`from_dict` reads them."""
        plain = asdict(self)
        return {name: list(v) if name == "worst_lens" else round(v, 2) for name, v in plain.items()}

    @classmethod
    def from_dict(cls, plain: Mapping[str, object]) -> Estimate:
        """What :meth:`to_dict` wrote.

        Raises
        ------
        KeyError
            If a field is missing.
        """
        numbers = {field.name: cast("float", plain[field.name]) for field in fields(cls) if field.name != "worst_lens"}
        column, row = cast("Sequence[int]", plain["worst_lens"])
        return cls(**numbers, worst_lens=(column, row))

    def in_words(self, part: str = "micro-image") -> str:
        """One line for people; ``part`` is what a part of the picture that is judged by itself is called."""
        return (
            f"{self.psnr:.1f} dB ({self.psnr_low:.1f} to {self.psnr_high:.1f}), "
            f"worst {part} {self.worst:.1f} dB ({self.worst_low:.1f} to {self.worst_high:.1f})"
        )

    def __str__(self) -> str:
        return self.in_words()


#: PSNR in dB beyond which nothing is told apart: a tenth of the step of 16-bit codes.
CEILING = 116.0
#: What curve and clipping leave of bias, as a share of the error; measured, see ``benchmarks/estimate_coverage.py``.
MODEL_UNCERTAINTY = 0.08
#: By how much more than what outliers show the error may be: measured where they are most of it.
OUTLIER_DOUBT = 0.8
#: In dB, for half the samples of which estimates are trusted. On scenes that are hard to judge, those of 4 were up to
#: 6.7 dB too good, those of 8 up to 3.6.
MARGIN_OF_HALF = 4.0
#: Where sharp surfaces may mirror emitters, as photons show: the samples at which a plain picture may first be trusted,
#: and with fewer of which the worst micro-image must be better by so many dB. All samples may have missed an emitter
#: that is mirrored in a few pixels; then the statement was up to 7.7 dB above what is true.
FIRST_AMONG_MIRRORS, FEWEST_AMONG_MIRRORS, WORST_AMONG_MIRRORS = 8, 16, 8.0
#: Micro-images that may be the worst are drawn this many times.
DRAWS = 2000
#: Pixels' worth of belief that a lens is as noisy as its neighbours.
LEAN = 64.0
NORMAL_95 = 1.96
_FLOOR = 10 ** (-CEILING / 10)


@dataclass(frozen=True)
class Margin:
    """dB by which an estimate must exceed what is asked for: of the ``whole`` picture, and of its ``worst`` part."""

    whole: float = 0.0
    worst: float = 0.0


NO_MARGIN = Margin()
#: In dB, with fewer samples than are trusted where sharp surfaces may mirror emitters, and with fewer than a plain
#: picture's first: on scenes made for that statements were up to 2.5 dB too good for the picture with either, and up to
#: 3.8 dB for small-balls; for its worst micro-image up to 5.2 dB with few, and more than 5 dB in 2 of 160 with others.
AMONG_MIRRORS, FEW_AMONG_MIRRORS = Margin(2.0, 5.0), Margin(5.0, 7.0)


@dataclass(frozen=True, eq=False)
class Parts:
    """What a picture is judged by, part by part: its micro-images, or the views of a quilt.

    ``owner`` ``(H, W)`` holds the flat index of every pixel's part in a grid of ``rows`` x ``columns`` of them, in
    which neighbours are alike. Every part has ``known`` more pixels (a number for all, or one each), that are not here
    and hold no error.
    """

    owner: NDArray[np.integer]
    rows: int
    columns: int
    known: int | NDArray[np.intp] = 0

    @classmethod
    def micro_images(cls, display: Display, window: PixelWindow | None = None) -> Parts:
        """The micro-images of a display, of which only the pixels in ``window`` may hold an error."""
        grid = display.lens_grid
        owner = lens_indices(display)
        if window is None:
            return cls(owner, grid.rows, grid.columns)
        inside = owner[window.slices]
        whole, part = (np.bincount(each.ravel(), minlength=grid.rows * grid.columns) for each in (owner, inside))
        return cls(inside, grid.rows, grid.columns, whole - part)

    @classmethod
    def views(cls, columns: int, rows: int, size: tuple[int, int], known: int = 0) -> Parts:
        """The views of a quilt, which lie in a row from the leftmost camera to the rightmost; ``size`` in pixels."""
        numbers = np.arange(columns * rows, dtype=np.int32).reshape(rows, columns)[::-1]
        width, height = size
        return cls(np.repeat(np.repeat(numbers, height, axis=0), width, axis=1), 1, columns * rows, known)


class PictureEstimator:
    """Estimates for pictures of one display, or of whatever has these parts; whose a pixel is is found once.

    Attributes
    ----------
    first, fewest:
        Samples of a pixel with which an estimate first tells something, and with fewer of which it is too rough to be
        trusted by one who asks for a quality, unless it is better than that by :meth:`margin`.
    """

    first, fewest = 4, 16
    _is_among_mirrors = False

    def __init__(self, of: Display | Parts) -> None:
        parts = Parts.micro_images(of) if isinstance(of, Display) else of
        self._rows, self._columns = parts.rows, parts.columns
        self._owner = parts.owner.ravel()
        self._pixels = np.bincount(self._owner, minlength=parts.rows * parts.columns) + parts.known

    def expect_mirrors(self) -> None:
        """Trust later: sharp surfaces may mirror emitters."""
        self.first, self.fewest = FIRST_AMONG_MIRRORS, FEWEST_AMONG_MIRRORS
        self._is_among_mirrors = True

    def margin(self, samples: int) -> Margin:
        """By how many dB the estimate of a picture of ``samples`` must be better than what is asked for."""
        of_few = margin_of_few(samples, self.fewest)
        mirrored = self._is_among_mirrors and samples < self.fewest
        return Margin(of_few, max(of_few, WORST_AMONG_MIRRORS) if mirrored else of_few)

    def estimate(self, errors: PixelErrors) -> Estimate:
        """PSNR of the whole and of the worst micro-image."""
        return estimate_of_sums(self._sums(errors), (self._rows, self._columns), errors.noise)

    def _sums(self, errors: PixelErrors) -> ErrorSums:
        lenses = len(self._pixels)
        sums = ErrorSums.none(lenses, self._pixels)
        height, width = errors.values.shape
        # Block by block: double precision of a whole panel would take gigabytes.
        for first, last in row_blocks(height, width):
            sums.add(self._owner[first * width : last * width], errors.part(slice(first, last)))
        return sums


def margin_among_mirrors(samples: int) -> Margin:
    """dB by which statements of ``samples`` may be too good where sharp surfaces may mirror emitters."""
    if samples >= FEWEST_AMONG_MIRRORS:
        return NO_MARGIN
    return AMONG_MIRRORS if samples >= FIRST_AMONG_MIRRORS else FEW_AMONG_MIRRORS


def stated_among_mirrors(estimate: Estimate, samples: int) -> Estimate:
    """What is stated of a picture of ``samples`` where sharp surfaces may mirror emitters.

    All of few samples may have missed an emitter in a mirror, or a place that shines by way of one, and nothing in them
    tells: both intervals reach down as much farther as such statements were found to be too good.
    """
    doubt = margin_among_mirrors(samples)
    return replace(
        estimate,
        psnr_low=max(0.0, estimate.psnr_low - doubt.whole),
        worst_low=max(0.0, estimate.worst_low - doubt.worst),
    )


def margin_of_few(samples: int, fewest: int) -> float:
    """dB by which plain pictures of ``samples`` must exceed what is asked for, where ``fewest`` are trusted."""
    return MARGIN_OF_HALF * max(0.0, math.log2(fewest / samples))


def estimate_of_sums(sums: ErrorSums, grid: tuple[int, int], noise: NoiseShares) -> Estimate:
    """PSNR of the whole and of the worst of the parts, which lie in a ``grid`` of rows and columns."""
    psnr = _whole(sums, noise)
    lenses = _lenses(sums, grid, noise)
    draws = lenses.draws()
    less = draws * (1 - parts_with_pixels(sums)[1].shares_less()[lenses.candidates, None])
    likely, worse = np.quantile(draws.max(axis=0), (0.5, 0.975))
    # Lenses that are worse pull their neighbours, so the better side goes farther than 0.025.
    worst = psnr_of(np.array([likely, worse, np.quantile(less.max(axis=0), 0.01)]))
    model = 10 * math.log10(1 + MODEL_UNCERTAINTY)
    row, column = divmod(int(lenses.index[np.argmax(lenses.expected)]), grid[1])
    return Estimate(
        *psnr,
        worst=float(worst[0]),
        worst_low=float(worst[1]) - model,
        worst_high=float(worst[2]) + model,
        worst_lens=(column, row),
    )


@dataclass(frozen=True, eq=False)
class PartErrors:
    """Micro-images with pixels: their flat ``index``, the ``expected`` squared error, that ``doubted``, log variances.

    ``variance`` is that of the logarithm of the expected error, ``fluctuation`` that of the true about the expected.
    """

    index: NDArray[np.intp]
    expected: Real
    doubted: Real
    variance: Real
    fluctuation: Real

    @cached_property
    def candidates(self) -> NDArray[np.intp]:
        """The places of those that may be the worst."""
        reach = np.log(self.doubted) + 2.5 * np.sqrt(self.variance + self.fluctuation)
        return np.argsort(-reach)[:1024]  # of very many only so many can be the worst

    def draws(self) -> Real:
        """``(candidates, draws)``: true squared errors of the :attr:`candidates`."""
        best = self.candidates
        random = np.random.default_rng(1)
        shape = (len(best), DRAWS)
        spread = np.sqrt(self.variance[best] + self.fluctuation[best])[:, None]
        # The logarithm of a lognormal's mean lies above its median's by half the variance.
        middle = np.log(self.expected)[best][:, None] - 0.5 * np.square(spread)
        doubt = (np.log(self.doubted) - np.log(self.expected))[best][:, None]
        drawn: Real = np.exp(middle + spread * random.standard_normal(shape) + doubt * np.square(random.random(DRAWS)))
        return drawn


def _lenses(sums: ErrorSums, grid: tuple[int, int], noise: NoiseShares) -> PartErrors:
    """Micro-images whose noisy means are drawn towards their neighbours', and those towards the mean of all."""
    index, sums = parts_with_pixels(sums)
    count = sums.pixels
    mean, outliers = sums.values / count, sums.outliers / count
    average = likely_mean(sums, noise)
    # The mean square of one lens is noisy itself, so it leans on that of its neighbours.
    nearby, neighbours = neighbourhood(np.stack([mean, sums.squares / count]), index, grid)
    square = (sums.squares + LEAN * nearby[1]) / (count + LEAN)
    of_estimate, of_picture = noise.estimate * square / count, noise.picture * square / count

    of_nearby = of_estimate / np.maximum(neighbours, 1)
    everywhere = np.full_like(mean, average)
    trust = _spread(nearby[0], everywhere, of_nearby, 1.0)
    trust = trust / (trust + of_nearby / average**2)
    around = np.maximum(average + trust * (nearby[0] - average), 1e-3 * average)

    telling = around > 0.25 * average
    usual = _spread(mean[telling], around[telling], of_estimate[telling], 1.0) * np.square(around)
    # Where a lens is worse by more than three deviations of its noise, it is no accident but another sight. A lens that
    # seems better may have had luck: of few pixels and samples, none may have met what the others met.
    other = np.where(mean > around, np.square(mean - around) - 9 * of_estimate, 0.0)
    between = np.maximum(usual, other)
    trust = between / (between + of_estimate)
    expected = np.maximum(around + trust * (mean - around), 1e-3 * average)
    doubted = expected + OUTLIER_DOUBT * np.clip(outliers, 0, expected)
    variance, fluctuation = (np.log1p(v / np.square(expected)) for v in (trust * of_estimate, of_picture))
    return PartErrors(index, expected, doubted, variance, fluctuation)


def _spread(values: Real, about: Real, noise: Real, default: float) -> float:
    """Relative variance of ``values`` about what is expected, beyond their ``noise``.

    By the median, as a few differ from all: that of squared normal values is 0.455 of their variance.
    """
    if not len(values):
        return default
    return max(0.02, float(np.median((np.square(values - about) / 0.455 - noise) / np.square(about))))


def neighbourhood(values: Real, index: NDArray[np.intp], grid: tuple[int, int]) -> tuple[Real, Real]:
    """Means of ``(n, lenses)`` values over the up to eight lenses around each, and how many these are.

    A lens without neighbours is its own.
    """
    known = np.zeros((len(values) + 1, grid[0] * grid[1]))
    known[:-1, index], known[-1, index] = values, 1
    array = known.reshape(-1, *grid)
    wide = np.pad(array, ((0, 0), (1, 1), (1, 1)))
    total = -array
    for a, b in np.ndindex(3, 3):
        total += wide[:, a : a + grid[0], b : b + grid[1]]
    of_lenses = total.reshape(len(known), -1)[:, index]
    number = of_lenses[-1]
    return np.where(number > 0, of_lenses[:-1] / np.maximum(number, 1), values), number


def likely_mean(sums: ErrorSums, noise: NoiseShares) -> float:
    """Mean squared error of all pixels, as likely as any that is not negative: the mean of a normal law cut at 0.

    That differs from the plain mean only where it is hardly larger than its own deviation, or below zero.
    """
    pixels = float(sums.pixels.sum())
    deviation = math.sqrt(noise.estimate * float(sums.squares.sum())) / pixels
    return max(cut_at_zero(float(sums.values.sum()) / pixels, deviation), _FLOOR)


def cut_at_zero(mean: float, deviation: float) -> float:
    """The mean of what is measured as ``mean`` with a normal ``deviation`` and cannot be negative."""
    if deviation <= 0:
        return max(mean, 0.0)
    z = mean / deviation
    if z < -20:
        # There the quotient below is 0 / 0; its limit is -z + 1 / -z.
        return deviation / -z
    above = 0.5 * math.erfc(-z / math.sqrt(2))
    return mean + deviation * math.exp(-0.5 * z * z) / (math.sqrt(2 * math.pi) * above)


def _whole(sums: ErrorSums, noise: NoiseShares) -> tuple[float, float, float]:
    """PSNR of all pixels and the ends of its interval."""
    pixels, mean = float(sums.pixels.sum()), likely_mean(sums, noise)
    deviation = math.sqrt((noise.estimate + noise.picture) * float(sums.squares.sum()))
    relative = deviation / (mean * pixels)
    spread = NORMAL_95 * math.sqrt(math.log1p(relative**2) + MODEL_UNCERTAINTY**2)
    doubt = 1 + OUTLIER_DOUBT * min(1.0, float(sums.outliers.sum()) / (mean * pixels))
    ends = mean * math.exp(spread) * doubt, mean * math.exp(-spread) * (1 - sums.share_less(mean))
    low, high = (float(end) for end in psnr_of(np.array(ends)))
    return float(psnr_of(np.array(mean))), low, high


def psnr_of(squared_error: Real) -> Real:
    return np.asarray(-10 * np.log10(np.maximum(squared_error, _FLOOR)))
