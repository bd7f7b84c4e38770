"""The loop of a picture with a goal: trace, denoise, estimate, decide, until the estimate reaches the goal.

A round is as large as the estimates so far say that it must be, but never more than a few times the samples before:
early estimates are rough, and what is overshot is lost. Very few samples end it only where they seem far better than
what is asked for. All micro-images get the same samples: one that seems good already may only not have met the light
that few paths find, and would stay wrong.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.adaptive.goal import Goal
from lippmann.rendering.adaptive.tuning import TUNING
from lippmann.rendering.estimate.pixel_errors import PixelErrors
from lippmann.rendering.estimate.psnr import Estimate, PictureEstimator

if TYPE_CHECKING:
    from lippmann.rendering.denoise.dual_buffer import Denoised
    from lippmann.rendering.film.sample_batches import FullInBatches

End = Literal["quality", "time", "samples"]

#: The fewest samples that tell an error.
FEWEST = 2
#: Samples per pixel at which it is given up: the noise of single precision sums comes near.
MOST_SAMPLES = 1 << 20


@dataclass(frozen=True)
class Costs:
    """What the schedule is to know of a picture beside its estimates.

    Parameters
    ----------
    first:
        Fewest samples per pixel at which an assessment is worth its cost.
    slope:
        Expected power of the sample count by which the squared error falls.
    assessment:
        Seconds of an assessment before any was made.
    """

    first: int
    slope: float = 1.0
    assessment: float = 0.0


@dataclass(frozen=True)
class Round:
    """After a round: samples per pixel, seconds since the start, and the estimate of the picture."""

    samples: int
    seconds: float
    estimate: Estimate


@dataclass(frozen=True)
class Outcome:
    """How the rendering ended: ``quality`` reached, ``time`` up, or ``samples`` spent.

    ``estimate`` is the last one, ``errors`` are those of the pixels that it stands on; both are None where the time was
    up after a single sample, which tells no error.
    """

    end: End
    estimate: Estimate | None
    samples: int
    rounds: tuple[Round, ...]
    errors: PixelErrors | None


def reach(
    goal: Goal,
    sampler: FullInBatches,
    picture: FullInBatches | Denoised,
    estimator: PictureEstimator,
    costs: Costs,
    progress: ProgressCallback = silent,
    clock: Callable[[], float] = time.perf_counter,
) -> Outcome:
    """Take rounds of samples until ``picture`` reaches ``goal`` by ``estimator``.

    Where time is limited ``sampler`` probes first how long a sample takes.
    """
    schedule = _Schedule(goal, estimator, costs, progress, clock)
    samples = schedule.first_round(sampler)
    while True:
        sampler.add(samples, schedule.report(samples))
        schedule.count(samples)
        if schedule.spent < FEWEST:
            if not schedule.has_time_for(FEWEST - schedule.spent):
                return Outcome("time", None, schedule.spent, (), None)
            samples = FEWEST - schedule.spent
            continue
        started = clock()
        errors = picture.squared_error()
        estimate = estimator.estimate(errors)
        schedule.note(estimate, clock() - started)
        end, samples = schedule.decide(estimate)
        if end is not None:
            return Outcome(end, estimate, schedule.spent, tuple(schedule.rounds), errors)


class _Schedule:
    """Sizes of rounds, from what the goal asks for and what the rounds before took and gave.

    Attributes
    ----------
    spent:
        Samples per pixel so far.
    rounds:
        What came of them.
    """

    def __init__(
        self,
        goal: Goal,
        estimator: PictureEstimator,
        costs: Costs,
        progress: ProgressCallback,
        clock: Callable[[], float],
    ) -> None:
        self.spent = 0
        self.rounds: list[Round] = []
        self._goal = goal
        self._estimator = estimator
        self._first = costs.first
        self._fewest = max(estimator.fewest, costs.first)
        self._expected_slope = costs.slope
        self._assessment = costs.assessment
        self._progress = progress
        self._clock = clock
        self._began = clock() if goal.began is None else goal.began
        self._round_began = self._began
        self._most = min(goal.spp or MOST_SAMPLES, MOST_SAMPLES)
        #: Samples per second.
        self._rate = 0.0

    def first_round(self, sampler: FullInBatches) -> int:
        """Samples of the first round; one at least, whatever the time."""
        if self._goal.max_time is None:
            samples = self._first if self._goal.has_quality else self._most
        else:
            self._rate = 1 / max(sampler.probe(), 1e-9)
            samples = min(self._fewest, max(1, self._affordable()))
        self._round_began = self._clock()
        return min(self._most, samples)

    def count(self, samples: int) -> None:
        """Note that so many samples were taken just now."""
        self.spent += samples
        self._rate = samples / max(self._clock() - self._round_began, 1e-6)

    def note(self, estimate: Estimate, seconds: float) -> None:
        """Note what the picture is estimated at, and how long that took."""
        self._assessment = seconds
        self.rounds.append(Round(self.spent, self._seconds(), estimate))

    def decide(self, estimate: Estimate) -> tuple[End | None, int]:
        """Whether and why the picture is done; else samples of the next round."""
        end = self._end(estimate)
        if end is not None:
            return end, 0
        samples = self._next_round(estimate)
        self._round_began = self._clock()
        return (None, samples) if samples >= 1 else ("time", 0)

    def has_time_for(self, samples: int) -> bool:
        """Whether the time left holds so many samples and an assessment."""
        self._round_began = self._clock()
        return self._goal.max_time is None or self._affordable() >= samples

    def report(self, coming: int) -> ProgressCallback:
        """Reports of one round as reports of all the work, as far as it can be foreseen."""
        note, total = "", float(self.spent + coming)
        if self.rounds:
            estimate = self.rounds[-1].estimate
            note = self._goal.describe(estimate)
            if self._goal.has_quality:
                total = max(total, self.spent * self._factor_for(max(0.0, self._goal.missing(estimate))))
            total = min(total, float(self._most))
            left = (total - self.spent) / self._rate
            if self._goal.max_time is not None:
                left = min(left, self._goal.max_time - self._seconds())
            note += f", about {max(0.0, left):.0f} s left"

        def report(inner: Progress) -> None:
            done = self.spent + coming * inner.done / max(inner.total, 1e-9)
            self._progress(Progress(inner.stage, done, max(total, done), note))

        return report

    def _end(self, estimate: Estimate) -> End | None:
        if self._goal.has_quality and self.spent >= self._first and self._missing_at(self.spent, estimate) <= 0:
            return "quality"
        if self._goal.max_time is not None and self._goal.seconds_left(self._seconds()) <= 0:
            return "time"
        return "samples" if self.spent >= self._most else None

    def _next_round(self, estimate: Estimate) -> int:
        """Samples of the next round; fewer than one if there is no time for any."""
        if self._goal.has_quality and self.spent < self._fewest:
            # An estimate that is not trusted yet says little about the distance to the goal.
            target = float(self._samples_to_trust(estimate))
        else:
            target = max(self.spent * self._growth(estimate), self._fewest)
        step = TUNING.step if self.spent >= TUNING.step // 2 else TUNING.step // 2
        total = max(step * round(target / step), step * (self.spent // step + 1))
        samples = min(total, self._most) - self.spent
        return samples if self._goal.max_time is None else min(samples, self._affordable())

    def _samples_to_trust(self, estimate: Estimate) -> int:
        """Samples per pixel at which the estimate is expected to exceed the goal by the margin, or to need none.

        No more than one round may take: what very few samples say of the rest is rough.
        """
        needed = 2 * self.spent
        while needed < min(self._fewest, TUNING.most_growth * self.spent):
            gained = 10 * self._slope() * math.log10(needed / self.spent)
            if self._missing_at(needed, estimate) <= gained:
                break
            needed *= 2
        return needed

    def _growth(self, estimate: Estimate) -> float:
        """By how much samples must be multiplied, as far as one round may."""
        if not self._goal.has_quality:
            return TUNING.most_growth
        likely = self._factor_for(self._goal.likely_missing(estimate))
        sure = self._factor_for(self._goal.missing(estimate))
        # Only the interval is too wide: it gets narrower faster than pictures better.
        return min(TUNING.most_growth, max(TUNING.least_growth, likely, min(sure, TUNING.surer_growth)))

    def _missing_at(self, samples: int, estimate: Estimate) -> float:
        """dB by which an estimate is short of the goal and of the margin asked of so few samples."""
        return self._goal.missing(estimate, self._estimator.margin(samples))

    def _factor_for(self, decibels: float) -> float:
        """Factor on the samples that gains so many dB."""
        return float(10 ** (decibels / (10 * self._slope())))

    def _slope(self) -> float:
        """Expected power, half corrected by the last two rounds: a biased picture converges more slowly than noise."""
        if len(self.rounds) < 2:
            return self._expected_slope
        before, now = self.rounds[-2:]
        measured = (now.estimate.psnr - before.estimate.psnr) / (10 * math.log10(now.samples / before.samples))
        low, high = TUNING.slope_range
        return min(high, max(low, 0.5 * self._expected_slope + 0.5 * measured))

    def _affordable(self) -> int:
        """Samples that fit the time left, an assessment included."""
        left = self._goal.seconds_left(self._seconds()) - self._assessment
        return math.floor(TUNING.time_share * max(0.0, left) * self._rate)

    def _seconds(self) -> float:
        return self._clock() - self._began
