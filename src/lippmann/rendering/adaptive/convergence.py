"""Estimated error of a picture after each round of samples, and the rate at which it converges."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from lippmann.rendering.estimate.pixel_errors import PixelErrors
from lippmann.rendering.estimate.psnr import Estimate, Margin, PictureEstimator

#: Power of the number of samples by which the squared error of Monte Carlo noise falls.
PLAIN_SLOPE = 1.0
#: Samples per pixel after which a first assessment waits no longer for its cost.
LONGEST_WAIT = 8
#: Range of powers taken from two noisy estimates.
MIN_SLOPE, MAX_SLOPE = 0.3, 1.2


@dataclass(frozen=True)
class Assessment:
    """Squared errors of the pixels, the estimated PSNR, and the power of the sample count by which they fall."""

    errors: PixelErrors
    estimate: Estimate
    slope: float


class Assessor(Protocol):
    """Estimates the error of a picture after each round of samples."""

    @property
    def first(self) -> int:
        """Fewest samples per pixel at which an assessment is worth its cost; may change once some are traced."""
        ...

    @property
    def fewest(self) -> int:
        """Samples per pixel below which an estimate counts only beyond :meth:`margin`."""
        ...

    def margin(self, samples: int) -> Margin:
        """dB by which the estimate of so few ``samples`` per pixel must exceed the quality asked for."""
        ...

    def assess(self, samples: int, room: float) -> Assessment:
        """Assess the picture after ``samples`` per pixel, which may still grow to ``room`` times as many."""
        ...

    def seconds(self) -> float:
        """Expected seconds of the next assessment."""
        ...


class HasSquaredError(Protocol):
    """A picture that estimates the squared error of its pixels."""

    def squared_error(self) -> PixelErrors: ...


class ErrorTrack:
    """Assessments of one kind of picture from round to round.

    Parameters
    ----------
    picture, estimator:
        What is assessed, and by which estimator.
    slope:
        Power of the sample count by which its squared error is expected to fall.
    seconds:
        Cost of an assessment before any was made.
    worth_from:
        Samples per pixel that cost as much as an assessment, 0 where that is not known; the first one waits for these.
    """

    def __init__(
        self,
        picture: HasSquaredError,
        estimator: PictureEstimator,
        slope: float = PLAIN_SLOPE,
        seconds: float = 0.0,
        worth_from: Callable[[], float] = lambda: 0.0,
    ) -> None:
        self._picture = picture
        self._estimator = estimator
        self._expected = slope
        self._seconds = seconds
        self._worth_from = worth_from
        self._rounds: list[tuple[int, Estimate]] = []

    @property
    def first(self) -> int:
        """The estimator's; doubled while an assessment, which may have to be repeated, costs more than the samples."""
        first, most = self._estimator.first, max(self._estimator.first, LONGEST_WAIT)
        while first < most and first < self._worth_from():
            first *= 2
        return first

    @property
    def fewest(self) -> int:
        """The estimator's, but at least :attr:`first`."""
        return max(self._estimator.fewest, self.first)

    def margin(self, samples: int) -> Margin:
        """The estimator's."""
        return self._estimator.margin(samples)

    def assess(self, samples: int, room: float = 1.0) -> Assessment:
        """See :class:`Assessor`; the room does not matter to a single picture."""
        del room
        started = time.perf_counter()
        errors = self._picture.squared_error()
        estimate = self._estimator.estimate(errors)
        self._seconds = time.perf_counter() - started
        self._rounds.append((samples, estimate))
        return Assessment(errors, estimate, self.slope)

    def seconds(self) -> float:
        """Seconds of the last assessment."""
        return self._seconds

    @property
    def slope(self) -> float:
        """Expected power, half corrected by the last two rounds: a biased picture converges more slowly than noise."""
        if len(self._rounds) < 2:
            return self._expected
        (before, old), (now, new) = self._rounds[-2:]
        shown = (new.psnr - old.psnr) / (10 * math.log10(now / before))
        return min(MAX_SLOPE, max(MIN_SLOPE, 0.5 * self._expected + 0.5 * shown))
