"""How good a growing picture is, round by round, and how its error will go on falling."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from lippmann.rendering.estimate.pixel_errors import PixelErrors
from lippmann.rendering.estimate.psnr import Estimate, PictureEstimator

#: The power of the number of samples by which plain noise falls.
PLAIN_SLOPE = 1.0
#: Powers that two noisy estimates are believed to show.
LEAST_SLOPE, MOST_SLOPE = 0.3, 1.2


@dataclass(frozen=True)
class Judgement:
    """A picture's errors, what they say, and the power of the number of samples by which they are falling."""

    errors: PixelErrors
    estimate: Estimate
    slope: float


class Judge(Protocol):
    """Says after every round how good the picture is."""

    @property
    def first(self) -> int:
        """Samples of a pixel with fewer of which its word tells nothing, or is not worth what it takes.

        That may come to be known only when there are some.
        """
        ...

    @property
    def fewest(self) -> int:
        """Samples of a pixel with fewer of which its word is believed only beyond :meth:`margin`."""
        ...

    def margin(self, samples: int) -> float:
        """By how many dB a picture of ``samples`` must seem better than what is asked for, to be believed."""
        ...

    def judge(self, samples: int, room: float) -> Judgement:
        """The picture after ``samples`` per pixel, which may yet grow to ``room`` times as many."""
        ...

    def seconds(self) -> float:
        """What the next judgement will take, as far as that is known."""
        ...


class SelfJudging(Protocol):
    """A picture that knows its error."""

    def squared_error(self) -> PixelErrors: ...


class Track:
    """One way of making a picture, judged from round to round.

    Parameters
    ----------
    picture, estimator:
        What is judged, and by whom.
    slope:
        The power of the number of samples by which its error is expected to fall.
    seconds:
        What a judgement takes before any was made.
    dear:
        Says whether a judgement takes more than all samples so far; then the first one waits.
    """

    def __init__(
        self,
        picture: SelfJudging,
        estimator: PictureEstimator,
        slope: float = PLAIN_SLOPE,
        seconds: float = 0.0,
        dear: Callable[[], bool] = lambda: False,
    ) -> None:
        self._picture = picture
        self._estimator = estimator
        self._expected = slope
        self._seconds = seconds
        self._dear = dear
        self._rounds: list[tuple[int, Estimate]] = []

    @property
    def first(self) -> int:
        """As the estimator says; twice as many while judging is dear, as it may have to be done again."""
        return self._estimator.first * (2 if self._dear() else 1)

    @property
    def fewest(self) -> int:
        """As the estimator says, but at least the first."""
        return max(self._estimator.fewest, self.first)

    def margin(self, samples: int) -> float:
        """As the estimator says."""
        return self._estimator.margin(samples)

    def judge(self, samples: int, room: float = 1.0) -> Judgement:
        """See :class:`Judge`; whatever room there is, this is the picture."""
        del room
        started = time.perf_counter()
        errors = self._picture.squared_error()
        estimate = self._estimator.estimate(errors)
        self._seconds = time.perf_counter() - started
        self._rounds.append((samples, estimate))
        return Judgement(errors, estimate, self.slope)

    def seconds(self) -> float:
        """Those of the last judgement."""
        return self._seconds

    @property
    def slope(self) -> float:
        """What is expected, half corrected by the last two rounds: a renderer with bias gains less than noise would."""
        if len(self._rounds) < 2:
            return self._expected
        (before, old), (now, new) = self._rounds[-2:]
        shown = (new.psnr - old.psnr) / (10 * math.log10(now / before))
        return min(MOST_SLOPE, max(LEAST_SLOPE, 0.5 * self._expected + 0.5 * shown))
