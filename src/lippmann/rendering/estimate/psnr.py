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
from statistics import NormalDist
from typing import cast

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.display.pixel_window import PixelWindow
from lippmann.image.micro_images import lens_indices
from lippmann.rendering.estimate.pixel_errors import ErrorSums, parts_with_pixels
from lippmann.rendering.estimate.tuning import TUNING

Real = NDArray[np.float64]

#: The layer of a picture with the estimated squared error of each pixel's code.
ERROR_LAYER = "error"
#: PSNR in dB beyond which nothing is told apart: a tenth of the step of 16-bit codes.
CEILING = 116.0
NORMAL_95 = NormalDist().inv_cdf(0.975)
_FLOOR = 10 ** (-CEILING / 10)


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

    def among_mirrors(self, samples: int) -> Estimate:
        """The same of a picture of ``samples`` in which sharp surfaces may mirror emitters.

        All of few samples may have missed an emitter in a mirror, or a place that shines by way of one, and nothing in
        them tells: both intervals reach down as much farther as such statements were found to be too good.
        """
        if samples >= TUNING.few_samples:
            return self
        whole, worst = TUNING.doubt_among_mirrors
        return replace(self, psnr_low=max(0.0, self.psnr_low - whole), worst_low=max(0.0, self.worst_low - worst))


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


def estimate_plain(sums: ErrorSums, grid: tuple[int, int]) -> Estimate:
    """PSNR of the whole and of the worst of the parts, which lie in a ``grid`` of rows and columns.

    The square of the difference of two halves of a picture estimates its error. For normal noise of variance s it is
    distributed as chi^2 with one degree of freedom: its own variance is 2 s^2, that of the true error 2 s^2 as well,
    and its mean square 3 s^2. So either varies by two thirds of the mean square.
    """
    index, sums = parts_with_pixels(sums)
    count, squares = sums.pixels, 2 / 3 * sums.squares
    pixels, outliers = float(count.sum()), sums.outliers / count
    deviation = math.sqrt(float(squares.sum())) / pixels
    # Noise may bring the mean below zero, which tells as much as its deviation does.
    average = max(float(sums.values.sum()) / pixels, deviation, _FLOOR)
    spread = NORMAL_95 * math.hypot(math.sqrt(math.log1p(2 * (deviation / average) ** 2)), TUNING.model_uncertainty)
    doubt = 1 + TUNING.outlier_doubt * min(1.0, float(sums.outliers.sum()) / (average * pixels))
    ends = average * math.exp(spread) * doubt, average * math.exp(-spread) * (1 - sums.share_less(average))

    mean = sums.values / count
    # The mean square of one part is noisy itself, so it leans on that of its neighbours.
    (near, squares_near), neighbours = neighbourhood(np.stack([mean, squares / count]), index, grid)
    noise = (squares + TUNING.lean * squares_near) / (count + TUNING.lean) / count
    # What neighbours say is drawn to the mean of all, and what a part says to that.
    around = shrink(near, np.full_like(near, average), noise / np.maximum(neighbours, 1))[0]
    expected, trust = shrink(mean, np.maximum(around, 1e-3 * average), noise)
    doubted = expected + TUNING.outlier_doubt * np.clip(outliers, 0, expected)
    variance, fluctuation = (np.log1p(each / np.square(expected)) for each in (trust * noise, noise))
    parts = PartErrors(index, expected, doubted, variance + fluctuation)
    draws = parts.draws()
    less = draws * (1 - sums.shares_less()[parts.candidates, None])
    model = math.exp(TUNING.model_uncertainty)
    # Parts that are worse pull their neighbours, so the better side goes farther than 0.025.
    worst = *np.quantile(draws.max(axis=0), (0.5, 0.975)) * (1, model), np.quantile(less.max(axis=0), 0.01) / model
    return make_estimate((average, *ends, *worst), int(index[np.argmax(expected)]), grid)


def make_estimate(errors: Sequence[float], worst: int, grid: tuple[int, int]) -> Estimate:
    """From the six squared errors in the order of the fields, and the flat index of the worst part."""
    decibels = -10 * np.log10(np.maximum(errors, _FLOOR))
    whole, whole_low, whole_high, part, part_low, part_high = (float(each) for each in decibels)
    row, column = divmod(worst, grid[1])
    return Estimate(whole, whole_low, whole_high, part, part_low, part_high, (column, row))


@dataclass(frozen=True, eq=False)
class PartErrors:
    """Parts with pixels: ``index``, ``expected`` squared error, that ``doubted``, ``variance`` of its logarithm."""

    index: NDArray[np.intp]
    expected: Real
    doubted: Real
    variance: Real

    @cached_property
    def candidates(self) -> NDArray[np.intp]:
        """The places of those that may be the worst."""
        reach = np.log(self.doubted) + 2.5 * np.sqrt(self.variance)
        return np.argsort(-reach)[:1024]  # of very many only so many can be the worst

    def draws(self) -> Real:
        """``(candidates, draws)``: true squared errors of the :attr:`candidates`."""
        best = self.candidates
        random = np.random.default_rng(1)
        shape = (len(best), TUNING.draws)
        spread = np.sqrt(self.variance[best])[:, None]
        # The logarithm of a lognormal's mean lies above its median's by half the variance.
        middle = np.log(self.expected)[best][:, None] - 0.5 * np.square(spread)
        doubt = (np.log(self.doubted) - np.log(self.expected))[best][:, None]
        chance = np.square(random.random(TUNING.draws))
        return np.asarray(np.exp(middle + spread * random.standard_normal(shape) + doubt * chance))


def shrink(measured: Real, around: Real, noise: Real) -> tuple[Real, Real]:
    """Expected errors of parts by empirical Bayes, and how far the measurement is trusted, 0 to 1.

    What is ``measured`` with a variance of ``noise`` is drawn towards what lies ``around``, the more the less parts
    differ from that beyond their noise: by the median, as a few differ from all. That of squared normal values is 0.455
    of their variance. Where next to nothing lies ``around``, relative differences tell nothing.

    Where a part is worse by more than three deviations of its noise, it is no accident but another sight. A part that
    seems better may have had luck: of few pixels and samples, none may have met what the others met.
    """
    telling = around > 0.25 * around.mean()
    beyond = (np.square(measured - around) / 0.455 - noise)[telling] / np.square(around[telling])
    usual = max(0.02, float(np.median(beyond))) * np.square(around)
    other = np.where(measured > around, np.square(measured - around) - 9 * noise, 0.0)
    between = np.maximum(usual, other)
    trust = between / (between + noise)
    return np.maximum(around + trust * (measured - around), 1e-3 * around.mean()), trust


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
