"""Rendering until a picture is good enough: rounds of samples, each assessment by the picture's own estimate.

A round is as large as the estimates so far say that it must be, but never more than a few times what has gone before:
early estimates are rough, and what is overshot is lost. Very few samples end it only where they seem far better than
what is asked for, as those of a plain scene do. All micro-images get the same samples: one that seems good already may
only not have met the light that few paths find, and would stay wrong.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.adaptive.convergence import Assessment, Assessor
from lippmann.rendering.estimate.pixel_errors import PixelErrors
from lippmann.rendering.estimate.psnr import NO_MARGIN, Estimate, Margin
from lippmann.rendering.request.render_request import RenderRequest

End = Literal["quality", "time", "samples"]

#: The fewest samples that tell an error.
FEWEST = 2
#: Samples add up to multiples of this, so that all batches get the same; the first few of them to half of it.
STEP = 8
#: The most by which one round multiplies the samples of a pixel, and the least.
MOST_GROWTH, LEAST_GROWTH = 4.0, 1.2
#: The most where the quality is likely there, but not surely.
SURER_GROWTH = 2.0
#: The promise: a quality asked for may be missed by this much, in dB, but with a probability of 2.5 %.
TOLERANCE = 1.0
#: Where a quality of the whole picture is asked for, every micro-image has at most so many dB less.
MOST_BELOW = 12.0
#: Samples per pixel at which it is given up: the noise of single precision sums comes near.
MOST_SAMPLES = 1 << 20
#: Of the time that is left, the share that a round is planned to take: rates vary.
_TIME_SHARE = 0.9


@dataclass(frozen=True)
class Goal:
    """When to stop: at the first of what is set.

    Parameters
    ----------
    quality:
        PSNR in dB that the picture's mean squared error is to reach; every micro-image then has at most ``MOST_BELOW``
        dB less.
    quality_worst:
        PSNR in dB that every micro-image is to reach.
    max_time:
        Seconds.
    spp:
        Samples per pixel; at least two, fewer tell no error.
    part:
        What a part of the picture that is assessed by itself is called.
    began:
        Reading of the clock from which ``max_time`` counts; None: when the first sample is taken.
    reserve:
        Seconds of ``max_time`` to be left for what follows.
    """

    quality: float | None = None
    quality_worst: float | None = None
    max_time: float | None = None
    spp: int | None = None
    part: str = "micro-image"
    began: float | None = None
    reserve: float = 0.0

    @property
    def has_quality(self) -> bool:
        """Whether some quality is asked for."""
        return self.quality is not None or self.quality_worst is not None

    def seconds_left(self, spent: float) -> float:
        """Of ``max_time``, which is set, what is left after so many seconds and the reserve; below 0 if it is up."""
        assert self.max_time is not None
        return self.max_time - self.reserve - spent

    def missing(self, estimate: Estimate, margin: Margin = NO_MARGIN) -> float:
        """How many dB the picture is short of the quality and a ``margin``; at most 0 if it has both.

        It has the quality where that is the likely one, and is missed by more than ``TOLERANCE`` only with a
        probability of 2.5 %.
        """
        short = [-math.inf]
        if self.quality is not None:
            has = min(estimate.psnr, estimate.psnr_low + TOLERANCE)
            short.append(self.quality + margin.whole - has)
        if self.least_worst is not None:
            has = min(estimate.worst, estimate.worst_low + TOLERANCE)
            short.append(self.least_worst + margin.worst - has)
        return max(short)

    def likely_missing(self, estimate: Estimate, margin: Margin = NO_MARGIN) -> float:
        """How many dB the likely PSNR is short, whatever its interval: that gets narrower as samples grow."""
        short = [-math.inf]
        if self.quality is not None:
            short.append(self.quality + margin.whole - estimate.psnr)
        if self.least_worst is not None:
            short.append(self.least_worst + margin.worst - estimate.worst)
        return max(short)

    @property
    def least_worst(self) -> float | None:
        """PSNR in dB that every micro-image is to reach, if there is such a bound."""
        bounds = [] if self.quality_worst is None else [self.quality_worst]
        if self.quality is not None:
            bounds.append(self.quality - MOST_BELOW)
        return max(bounds, default=None)

    def describe(self, estimate: Estimate) -> str:
        """Where the picture stands, for a progress report."""
        parts = [] if self.quality is None else [f"{estimate.psnr:.1f} of {self.quality:g} dB"]
        if self.quality_worst is not None or not parts:
            bound = "" if self.quality_worst is None else f" of {self.quality_worst:g}"
            parts.append(f"worst {self.part} {estimate.worst:.1f}{bound} dB")
        return ", ".join(parts)

    def describe_shortfall(self, estimate: Estimate) -> str:
        """What a picture lacks that ended short of the goal; no figure is rounded up to what was asked for."""
        found = []
        for what, value, low, asked in (
            ("the picture", estimate.psnr, estimate.psnr_low, self.quality),
            (f"the worst {self.part}", estimate.worst, estimate.worst_low, self.least_worst),
        ):
            if asked is None:
                continue
            if value < asked:
                found.append(f"{what} is estimated at {_floor(value):.1f} of {asked:g} dB")
            elif low < asked - TOLERANCE:
                found.append(f"{what} is likely there, but may have {_floor(low):.1f} of {asked:g} dB")
        return ", ".join(found) or "too few samples to be sure"


def _floor(value: float) -> float:
    return math.floor(10.0 * value) / 10.0


def goal_of(request: RenderRequest) -> Goal | None:
    """When to stop, where that is not a number of samples alone."""
    if not request.is_open_ended:
        return None
    return Goal(request.quality, request.quality_worst, request.max_time, request.spp)


@dataclass(frozen=True)
class Round:
    """After a round: samples per pixel, seconds since the start, and how good the picture then was."""

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
    add: Callable[[int, ProgressCallback], None],
    assessor: Assessor,
    progress: ProgressCallback = silent,
    clock: Callable[[], float] = time.perf_counter,
    probe: Callable[[], float] | None = None,
) -> Outcome:
    """Take rounds of samples by ``add`` until ``assessor`` says that ``goal`` is reached.

    ``probe`` measures the seconds of a sample per pixel by a few of them. It is asked where time is limited: without
    it the first round has two samples, however long they take.
    """
    return _AdaptiveLoop(goal, add, assessor, progress, clock, probe).run()


def missing_with_margin(goal: Goal, estimate: Estimate, samples: int, assessor: Assessor) -> float:
    """dB by which ``estimate`` is short of ``goal`` and the margin that ``assessor`` asks of so few samples."""
    return goal.missing(estimate, assessor.margin(samples))


def samples_to_trust(goal: Goal, assessment: Assessment, samples: int, assessor: Assessor) -> int:
    """Samples per pixel at which ``assessor`` is expected to be trusted, after an ``assessment`` at ``samples``.

    Doubled until the estimate should exceed ``goal`` by the margin, or no margin is needed any more; but at most so
    far as one round may go, as what very few samples say of the rest is rough.
    """
    needed = samples
    if samples < assessor.fewest and missing_with_margin(goal, assessment.estimate, samples, assessor) > 0:
        needed *= 2
    while needed < min(assessor.fewest, MOST_GROWTH * samples):
        gained = 10 * assessment.slope * math.log10(needed / samples)
        if goal.missing(assessment.estimate, assessor.margin(needed)) <= gained:
            break
        needed *= 2
    return needed


@dataclass
class _AdaptiveLoop:
    """One adaptive rendering; ``spent`` is in samples per pixel, ``rate`` in those per second."""

    goal: Goal
    add: Callable[[int, ProgressCallback], None]
    assessor: Assessor
    progress: ProgressCallback
    clock: Callable[[], float]
    probe: Callable[[], float] | None
    rounds: list[Round] = field(default_factory=list)
    spent: int = 0
    rate: float = 0.0

    def __post_init__(self) -> None:
        self._began = self.clock() if self.goal.began is None else self.goal.began
        self._most = min(self.goal.spp or MOST_SAMPLES, MOST_SAMPLES)
        self._slope = 1.0

    def run(self) -> Outcome:
        samples = self._first_round()
        while True:
            self._take(samples)
            if self.spent < FEWEST and not self._time_for(FEWEST - self.spent):
                return Outcome("time", None, self.spent, (), None)
            if self.spent < FEWEST:
                self._take(FEWEST - self.spent)
            self._take_up_to(self.assessor.first)
            assessment = self.assessor.assess(self.spent, self._room())
            self._slope = assessment.slope
            self.rounds.append(Round(self.spent, self._seconds(), assessment.estimate))
            end = self._end(assessment.estimate)
            if end is None:
                samples = self._next_round(assessment)
                end = "time" if samples < 1 else None
            if end is not None:
                return self._outcome(end, assessment)

    def _take(self, samples: int) -> None:
        started = self.clock()
        self.add(samples, self._report(samples))
        self.spent += samples
        self.rate = samples / max(self.clock() - started, 1e-6)

    def _take_up_to(self, samples: int) -> None:
        """Take what the assessor turns out to need, where a quality is asked for and there is time."""
        more = min(samples, self._most) - self.spent
        if self.goal.has_quality and more > 0 and self._time_for(more):
            self._take(more)

    def _outcome(self, end: End, assessment: Assessment) -> Outcome:
        return Outcome(end, assessment.estimate, self.spent, tuple(self.rounds), assessment.errors)

    def _seconds(self) -> float:
        return self.clock() - self._began

    def _end(self, estimate: Estimate) -> End | None:
        short = missing_with_margin(self.goal, estimate, self.spent, self.assessor)
        if self.goal.has_quality and short <= 0 and self.spent >= self.assessor.first:
            return "quality"
        if self.goal.max_time is not None and self.goal.seconds_left(self._seconds()) <= 0:
            return "time"
        return "samples" if self.spent >= self._most else None

    def _first_round(self) -> int:
        if self.goal.max_time is None:
            return min(self._most, self.assessor.first) if self.goal.has_quality else self._most
        if self.probe is None:
            return min(self._most, FEWEST)
        self.rate = 1 / max(self.probe(), 1e-9)
        # A picture has one sample of every pixel at least, whatever the time.
        return min(self._most, self.assessor.fewest, max(1, self._affordable()))

    def _next_round(self, assessment: Assessment) -> int:
        """Samples of the next round; fewer than one if there is no time for any."""
        if self.goal.has_quality and self.spent < self.assessor.fewest:
            # An estimate that is not trusted yet says little about the distance to the goal.
            wanted = float(samples_to_trust(self.goal, assessment, self.spent, self.assessor))
        else:
            wanted = max(self.spent * self._growth(assessment.estimate), self.assessor.fewest)
        step = STEP if self.spent >= STEP // 2 else STEP // 2
        total = max(step * round(wanted / step), step * (self.spent // step + 1))
        samples = min(total, self._most) - self.spent
        return samples if self.goal.max_time is None else min(samples, self._affordable())

    def _affordable(self) -> int:
        """Samples that fit the time left, assessment included."""
        left = self.goal.seconds_left(self._seconds()) - self.assessor.seconds()
        return math.floor(_TIME_SHARE * max(0.0, left) * self.rate)

    def _time_for(self, samples: int) -> bool:
        return self.goal.max_time is None or self._affordable() >= samples

    def _room(self) -> float:
        """By how much samples can still be multiplied."""
        most = float(self._most)
        if self.goal.max_time is not None:
            most = min(most, self.spent + self._affordable())
        return max(1.0, most / self.spent)

    def _growth(self, estimate: Estimate) -> float:
        """By how much samples must be multiplied, as far as one round may."""
        if not self.goal.has_quality:
            return MOST_GROWTH
        likely, sure = (
            10 ** (short / (10 * self._slope))
            for short in (self.goal.likely_missing(estimate), self.goal.missing(estimate))
        )
        # What only is not sure yet: intervals get narrower faster than pictures better.
        return min(MOST_GROWTH, max(LEAST_GROWTH, likely, min(sure, SURER_GROWTH)))

    def _report(self, coming: int) -> ProgressCallback:
        """Reports of one round as reports of all the work, as far as it can be foreseen."""
        note, total = "", float(self.spent + coming)
        if self.rounds:
            estimate = self.rounds[-1].estimate
            note = self.goal.describe(estimate)
            if self.goal.has_quality:
                total = max(total, self.spent * 10 ** (max(0.0, self.goal.missing(estimate)) / (10 * self._slope)))
            total = min(total, float(self._most))
            left = (total - self.spent) / self.rate
            if self.goal.max_time is not None:
                left = min(left, self.goal.max_time - self._seconds())
            note += f", about {max(0.0, left):.0f} s left"

        def report(inner: Progress) -> None:
            done = self.spent + coming * inner.done / max(inner.total, 1e-9)
            self.progress(Progress(inner.stage, done, max(total, done), note))

        return report
