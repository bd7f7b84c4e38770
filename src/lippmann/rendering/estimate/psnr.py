"""PSNR of a picture with a 95 % interval, of the whole and of its worst micro-image, estimated without a reference.

The input is the squared error of each pixel, estimated from the samples themselves. Its sums over the parts of a
picture are enough, which add up over tiles. PSNR is that of :mod:`lippmann.metrics`: from the mean squared error of the
codes over all channels, in dB.

Three effects are accounted for:

- The estimates are noisy, and the error of one picture is a random variable itself. Both variances add.
- The worst micro-image is not the one with the worst estimate. Each estimate is shrunk towards its neighbours', the
  more the noisier it is (empirical Bayes). The error of the worst is then the maximum over random draws from these
  posteriors.
- Light that few paths find is missing from most pixels before it appears in any. So the share of the error that rests
  on outliers widens the interval towards larger errors.
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
from lippmann.display.micro_image_layout import lens_indices
from lippmann.display.panel import PixelWindow
from lippmann.rendering.estimate.tuning import TUNING
from lippmann.rendering.request.tuning import TUNING as REQUEST

Real = NDArray[np.float64]
Floats = NDArray[np.float32]

#: Largest share of an error that is ascribed to the blur of caustics, which is known as an upper bound only
#: (:mod:`lippmann.rendering.film.caustic_blur`).
MOST_BLUR_SHARE = 0.9


@dataclass(frozen=True, eq=False)
class PixelErrors:
    """Estimates of the squared error of each pixel's code, averaged over its channels.

    Parameters
    ----------
    values:
        ``(H, W)`` float32, unbiased; single ones may be negative.
    outliers:
        ``(H, W)`` float32 >= 0: the part of ``values`` that rests on outliers; None without outliers.
    samples:
        Of a denoised picture: the errors of the samples that it was made of.
    apart:
        Of a denoised picture, ``(H, W)`` float32 >= 0: the variance, from the difference of its halves.
    blur:
        ``(H, W)`` float32: the squared blur of caustics, as an upper bound; None without photons. Single values may be
        negative.
    """

    values: Floats
    outliers: Floats | None = None
    samples: PixelErrors | None = None
    halves_variance: Floats | None = None
    blur: Floats | None = None

    def part(self, inside: slice | tuple[slice, slice]) -> PixelErrors:
        """The errors of some pixels."""
        outliers, halves_variance, blur = (
            None if values is None else values[inside] for values in (self.outliers, self.halves_variance, self.blur)
        )
        samples = None if self.samples is None else self.samples.part(inside)
        return PixelErrors(self.values[inside], outliers, samples, halves_variance, blur)


@dataclass(frozen=True, eq=False)
class ErrorSums:
    """Sums over the pixels of each part, ``(parts,)`` each.

    ``pixels``: their number; ``values``, ``outliers``, ``halves_variance``, ``blur``: sums of the fields of
    :class:`PixelErrors`; ``squares``: sum of the squares of ``values``, less ``halves_variance``.

    ``products``: sum of the variances of the products of the halves' errors. ``values`` measure these products, except
    where the halves are the samples themselves. The product has the variance 4 s^2. Here s is the mean of
    ``halves_variance``, whose second moment is 3 s^2: four thirds of its square. It is small for smooth halves.
    """

    pixels: Real
    values: Real
    squares: Real
    outliers: Real
    halves_variance: Real
    blur: Real
    products: Real

    @classmethod
    def none(cls, parts: int, pixels: NDArray[np.generic] | int = 0) -> ErrorSums:
        """Sums of 0 for so many parts, with ``pixels`` in each."""
        return cls(np.full(parts, pixels, dtype=np.float64), *np.zeros((len(fields(cls)) - 1, parts)))

    def add(self, owner: NDArray[np.integer], errors: PixelErrors) -> None:
        """Add the errors of some pixels to the parts that ``owner`` names; ``pixels`` stays as it is."""
        owner = owner.ravel()
        values = errors.values.astype(np.float64).ravel()
        squares = np.square(values)
        self.values[:] += self._sum(owner, values)
        if errors.outliers is not None:
            self.outliers[:] += self._sum(owner, errors.outliers.astype(np.float64).ravel())
        if errors.halves_variance is not None:
            halves_variance = errors.halves_variance.astype(np.float64).ravel()
            self.halves_variance[:] += self._sum(owner, halves_variance)
            squares = np.square(values - halves_variance)
            self.products[:] += self._sum(owner, 4 / 3 * np.square(halves_variance))
        if errors.blur is not None:
            self.blur[:] += self._sum(owner, errors.blur.astype(np.float64).ravel())
        self.squares[:] += self._sum(owner, squares)

    def add_sums(self, parts: NDArray[np.generic], sums: ErrorSums) -> None:
        """Add the sums of other pixels, with their number; ``parts`` are the indices of their parts, each once."""
        for field in fields(self):
            getattr(self, field.name)[parts] += getattr(sums, field.name)

    def bound_blur_share(self, mean: float) -> float:
        """Largest share by which blur may overstate the ``mean`` error of all pixels."""
        return float(_bound_blur_share(self.blur.sum() / self.pixels.sum(), mean))

    def bound_blur_shares(self, means: Real) -> Real:
        """The same share for each part, whose mean errors are ``means``, ``(parts,)`` each."""
        return np.asarray(_bound_blur_share(self.blur / self.pixels, means))

    def _sum(self, owner: NDArray[np.integer], values: Real) -> Real:
        return np.asarray(np.bincount(owner, weights=values, minlength=len(self.pixels)), dtype=np.float64)


def _bound_blur_share(blur: Real | float, error: Real | float) -> Real | np.float64:
    share: Real | np.float64 = np.clip(blur / error, 0, MOST_BLUR_SHARE)
    return share


def select_parts(sums: ErrorSums) -> tuple[NDArray[np.intp], ErrorSums]:
    """The flat indices of the parts that have pixels, and their sums."""
    index = np.flatnonzero(sums.pixels)
    return index, ErrorSums(*(getattr(sums, field.name)[index] for field in fields(ErrorSums)))


#: The layer of a picture with the estimated squared error of each pixel's code.
ERROR_LAYER = "error"
#: Least squared error that is stated: that of a tenth of the step of 16-bit codes.
FLOOR = (0.1 / 65535) ** 2
NORMAL_95 = NormalDist().inv_cdf(0.975)


@dataclass(frozen=True)
class Estimate:
    """Estimated PSNR of a picture in dB, each value with the ends of its 95 % interval.

    ``psnr``: of all pixels; ``worst``: of the worst micro-image, which is probably lens ``worst_lens`` (column, row);
    ``by_chance``: ``psnr`` if only that part of the error counted that another seed would change, None where that is
    not known. A picture without noise has the squared error ``FLOOR``, 116 dB.
    """

    psnr: float
    psnr_low: float
    psnr_high: float
    worst: float
    worst_low: float
    worst_high: float
    worst_lens: tuple[int, int]
    by_chance: float | None = None

    def to_dict(self) -> dict[str, object]:
        """All known fields as JSON-able values, rounded to hundredths of a dB; :meth:`from_dict` reads them."""
        known = {name: value for name, value in asdict(self).items() if value is not None}
        return {name: list(v) if name == "worst_lens" else round(v, 2) for name, v in known.items()}

    @classmethod
    def from_dict(cls, plain: Mapping[str, object]) -> Estimate:
        """The estimate that :meth:`to_dict` wrote.

        Raises
        ------
        KeyError
            If a field is missing.
        """
        others = ("worst_lens", "by_chance")
        numbers = {each.name: cast("float", plain[each.name]) for each in fields(cls) if each.name not in others}
        column, row = cast("Sequence[int]", plain["worst_lens"])
        return cls(**numbers, worst_lens=(column, row), by_chance=cast("float | None", plain.get("by_chance")))

    def in_words(self, part: str = "micro-image") -> str:
        """One line for people; ``part`` names the parts: micro-images, or the views of a quilt."""
        return (
            f"{self.psnr:.1f} dB ({self.psnr_low:.1f} to {self.psnr_high:.1f}), "
            f"worst {part} {self.worst:.1f} dB ({self.worst_low:.1f} to {self.worst_high:.1f})"
        )

    def __str__(self) -> str:
        return self.in_words()

    def widen_for_mirrors(self, samples: int) -> Estimate:
        """The estimate with wider intervals, as of ``samples`` per pixel where mirrors may show small emitters.

        Few samples may all miss a mirrored emitter or its caustic, and then their variance does not reveal it. So both
        intervals are extended downwards by the largest overestimate that was measured.
        """
        if samples >= REQUEST.usual:
            return self
        whole, worst = TUNING.doubt_among_mirrors
        return replace(self, psnr_low=max(0.0, self.psnr_low - whole), worst_low=max(0.0, self.worst_low - worst))


@dataclass(frozen=True, eq=False)
class Parts:
    """The parts of a picture whose errors are estimated one by one: its micro-images, or the views of a quilt.

    ``owner`` ``(H, W)`` holds the index of every pixel's part, in row order of a grid of ``rows`` x ``columns`` parts;
    neighbours in this grid are similar. Every part has ``known`` more pixels (a number for all, or one each) outside
    the window, without error.
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
    """PSNR of a picture that is not denoised, and of its worst part; ``grid`` is the parts' rows and columns.

    The squared difference of two half-buffers estimates the squared error. For normal noise of variance s it is
    distributed as s chi^2 with one degree of freedom. Its variance is 2 s^2, that of the true squared error 2 s^2 as
    well, and its second moment 3 s^2. So each variance is two thirds of the second moment.
    """
    index, sums = select_parts(sums)
    count, squares = sums.pixels, 2 / 3 * sums.squares
    pixels, outliers = float(count.sum()), sums.outliers / count
    deviation = math.sqrt(float(squares.sum())) / pixels
    # Noise may make the mean negative; the standard deviation is then the best estimate.
    average = max(float(sums.values.sum()) / pixels, deviation, FLOOR)
    spread = NORMAL_95 * math.hypot(math.sqrt(math.log1p(2 * (deviation / average) ** 2)), TUNING.model_uncertainty)
    doubt = 1 + TUNING.outlier_doubt * min(1.0, float(sums.outliers.sum()) / (average * pixels))
    ends = average * math.exp(spread) * doubt, average * math.exp(-spread) * (1 - sums.bound_blur_share(average))

    mean = sums.values / count
    # The second moment of a single part is a noisy estimate: it is shrunk towards that of its neighbours.
    (near, squares_near), neighbours = average_neighbours(np.stack([mean, squares / count]), index, grid)
    noise = (squares + TUNING.prior_pixels * squares_near) / (count + TUNING.prior_pixels) / count
    # Means of neighbours are shrunk towards the mean of all, and each part towards its neighbours.
    around = shrink(near, np.full_like(near, average), noise / np.maximum(neighbours, 1))[0]
    expected, trust = shrink(mean, np.maximum(around, 1e-3 * average), noise)
    pessimistic = expected + TUNING.outlier_doubt * np.clip(outliers, 0, expected)
    variance, fluctuation = (np.log1p(each / np.square(expected)) for each in (trust * noise, noise))
    parts = PartErrors(index, expected, pessimistic, variance + fluctuation, sums.bound_blur_shares(expected))
    largest, without_blur = parts.draw_largest()
    model = math.exp(TUNING.model_uncertainty)
    # Shrinkage raises the estimates beside a bad part, so the lower quantile is 0.01, not 0.025.
    worst = *quantiles(largest, (0.5, 0.975)) * (1, model), quantiles(without_blur, 0.01) / model
    return make_estimate((average, *ends, *worst, average), int(index[np.argmax(expected)]), grid)


def make_estimate(errors: Sequence[float], worst: int, grid: tuple[int, int]) -> Estimate:
    """An :class:`Estimate` from seven squared errors in the order of its fields, and the index of the worst part."""
    decibels = -10 * np.log10(np.maximum(errors, FLOOR))
    whole, whole_low, whole_high, part, part_low, part_high, by_chance = (float(each) for each in decibels)
    row, column = divmod(worst, grid[1])
    return Estimate(whole, whole_low, whole_high, part, part_low, part_high, (column, row), by_chance)


@dataclass(frozen=True, eq=False)
class PartErrors:
    """Posterior squared errors of the parts with pixels, ``(parts,)`` each.

    ``index``: their numbers in the grid; ``expected``: the mean; ``pessimistic``: an upper mean, where samples may have
    missed outliers; ``variance``: of the logarithm; ``blur_share``: the share by which blur may overstate the error.
    """

    index: NDArray[np.intp]
    expected: Real
    pessimistic: Real
    variance: Real
    blur_share: Real

    @cached_property
    def candidates(self) -> NDArray[np.intp]:
        """Positions of the parts that may be the worst, the likeliest first."""
        reach = np.log(self.pessimistic) + 2.5 * np.sqrt(self.variance)
        return np.argsort(-reach)[:1024]  # bounds the memory of the draws

    def draw_largest(self) -> tuple[Real, Real]:
        """Random draws of the largest squared error of a part, and of the largest without blur, ``(draws,)`` each."""
        best = self.candidates
        random = np.random.default_rng(1)
        shape = (len(best), TUNING.draws)
        spread = np.sqrt(self.variance[best])[:, None]
        # The mean of a lognormal distribution is exp(variance / 2) times its median.
        middle = np.log(self.expected)[best][:, None] - 0.5 * np.square(spread)
        doubt = (np.log(self.pessimistic) - np.log(self.expected))[best][:, None]
        chance = np.square(random.random(TUNING.draws))
        draws = np.exp(middle + spread * random.standard_normal(shape) + doubt * chance)
        return draws.max(axis=0), (draws * (1 - self.blur_share[best])[:, None]).max(axis=0)


def shrink(measured: Real, around: Real, noise: Real) -> tuple[Real, Real]:
    """Empirical Bayes: expected squared errors of parts, and the weights of their measurements, 0 to 1.

    Each ``measured`` value, with variance ``noise``, is shrunk towards the prior mean ``around``. The prior variance is
    relative to ``around``, and estimated as a median over all parts, which a few exceptional parts do not move: the
    median of squared normal values is 0.455 of their variance. Parts with a very small ``around`` are left out of it.

    A part that is worse by more than three standard deviations gets a prior variance of its own: it shows something
    else than its neighbours. A part that is better does not: its few pixels may have missed what its neighbours met.
    """
    is_clear = around > 0.25 * around.mean()
    beyond = (np.square(measured - around) / 0.455 - noise)[is_clear] / np.square(around[is_clear])
    usual = max(0.02, float(quantiles(beyond, 0.5))) * np.square(around)
    other = np.where(measured > around, np.square(measured - around) - 9 * noise, 0.0)
    between = np.maximum(usual, other)
    trust = between / (between + noise)
    return np.maximum(around + trust * (measured - around), 1e-3 * around.mean()), trust


def quantiles(values: Real, shares: Sequence[float] | float) -> Real:
    """Quantiles of ``values (n,)`` as by ``np.quantile``, which would load all of NumPy's masked arrays."""
    return np.asarray(np.interp(np.multiply(shares, len(values) - 1), np.arange(len(values)), np.sort(values)))


def average_neighbours(values: Real, index: NDArray[np.intp], grid: tuple[int, int]) -> tuple[Real, Real]:
    """Means of ``(n, parts)`` values over the up to eight neighbours of each part in the grid, and their number.

    A part without neighbours has its own value.
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
