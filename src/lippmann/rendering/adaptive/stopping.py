"""The loop of a picture: trace, denoise, estimate, decide, until the goal is reached.

A round brings the samples to as many as the estimate says are needed, but to no more than a few times those before:
early estimates are rough, and what is overshot is lost. A default picture that lacks less than the least round is done,
so that pictures that look alike, such as the key frames of a film, get much the same samples. All micro-images get the
same samples: one that seems good already may only not have met the light that few paths find, and would stay wrong.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from lippmann.options.quality import MOST_SAMPLES
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.adaptive.tuning import TUNING
from lippmann.rendering.estimate.denoised_psnr import PictureEstimator
from lippmann.rendering.estimate.psnr import Estimate, PixelErrors
from lippmann.rendering.film.batched_picture import STREAMS
from lippmann.rendering.request.render_request import RenderRequest

if TYPE_CHECKING:
    from lippmann.rendering.denoise.dual_buffer import DenoisedPicture
    from lippmann.rendering.film.sample_batches import BatchedRender


@dataclass(frozen=True)
class Goal:
    """When to stop: at the first of what is set.

    Parameters
    ----------
    quality:
        PSNR in dB that the picture's mean squared error is to reach; every micro-image then has at most
        ``TUNING.most_below`` dB less.
    quality_worst:
        PSNR in dB that every micro-image is to reach.
    max_time:
        Seconds.
    spp:
        Samples per pixel; at least two, fewer tell no error.
    is_promise:
        Whether a user asked for the quality: it is then missed by more than ``TUNING.tolerance`` with a probability of
        2.5 % only. Else the likely value counts.
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
    is_promise: bool = True
    part: str = "micro-image"
    began: float | None = None
    reserve: float = 0.0

    @property
    def has_quality(self) -> bool:
        """Whether some quality is to be reached."""
        return self.quality is not None or self.quality_worst is not None

    @property
    def most(self) -> int:
        """Most samples per pixel, with which rendering stops short of the goal."""
        return self.spp or MOST_SAMPLES

    @property
    def least_worst(self) -> float | None:
        """PSNR in dB that the worst micro-image must reach; None for no bound."""
        bounds = [] if self.quality_worst is None else [self.quality_worst]
        if self.quality is not None:
            bounds.append(self.quality - TUNING.most_below)
        return max(bounds, default=None)

    def seconds_left(self, spent: float) -> float:
        """Seconds of ``max_time`` that remain after ``spent`` and the reserve; infinite without a limit."""
        return math.inf if self.max_time is None else self.max_time - self.reserve - spent

    def measure_shortfall(self, estimate: Estimate) -> float:
        """PSNR in dB that the picture lacks: at most 0 at the goal, minus infinity without a quality."""
        short = -math.inf
        for _, value, low, asked in self._list_requirements(estimate):
            has = min(value, low + TUNING.tolerance) if self.is_promise else value
            short = max(short, asked - has)
        return short

    def describe(self, estimate: Estimate) -> str:
        """Estimated PSNR beside the goal, for a progress report."""
        parts = [] if self.quality is None else [f"{estimate.psnr:.1f} dB, goal {self.quality:g} dB"]
        if self.quality_worst is not None or not parts:
            goal = "" if self.quality_worst is None else f", goal {self.quality_worst:g} dB"
            parts.append(f"worst {self.part} {estimate.worst:.1f} dB{goal}")
        return ", ".join(parts)

    def describe_shortfall(self, estimate: Estimate) -> str:
        """The shortfall of a picture that ended before the goal; no figure is rounded up to the goal."""
        shortfalls = []
        for what, value, low, asked in self._list_requirements(estimate):
            if value < asked:
                shortfalls.append(f"{what} is estimated at {_floor(value):.1f} dB, goal {asked:g} dB")
            elif low < asked - TUNING.tolerance:
                shortfalls.append(f"{what} is likely at the goal of {asked:g} dB, but may have {_floor(low):.1f} dB")
        return ", ".join(shortfalls) or "too few samples to be sure"

    def _list_requirements(self, estimate: Estimate) -> list[tuple[str, float, float, float]]:
        """Name, PSNR, lower end of its interval and required PSNR: of the picture and of its worst part, as far as a
        quality is asked of them."""
        both = [
            ("the picture", estimate.psnr, estimate.psnr_low, self.quality),
            (f"the worst {self.part}", estimate.worst, estimate.worst_low, self.least_worst),
        ]
        return [(what, value, low, asked) for what, value, low, asked in both if asked is not None]


def _floor(value: float) -> float:
    return math.floor(10.0 * value) / 10.0


def make_goal(request: RenderRequest) -> Goal:
    """The goal of a request. A default picture takes samples of its reserve until its estimated PSNR is good enough."""
    if request.is_open_ended:
        return Goal(request.quality, request.quality_worst, request.max_time, request.spp)
    if request.spp_reserve is None:
        return Goal(spp=request.samples)
    return Goal(TUNING.clean, spp=request.spp_reserve, is_promise=False)


@dataclass(frozen=True)
class Outcome:
    """How the rendering ended: ``quality`` reached, ``time`` up, or ``samples`` spent.

    ``estimate`` is the last one, ``errors`` are those of the pixels that it stands on; both are None where the time was
    up after a single sample, which tells no error.
    """

    end: Literal["quality", "time", "samples"]
    estimate: Estimate | None = None
    errors: PixelErrors | None = None


def sample_until(
    goal: Goal,
    sampler: BatchedRender,
    picture: BatchedRender | DenoisedPicture,
    estimator: PictureEstimator,
    *,
    first: int,
    slope: float = 1.0,
    assessment: float = 0.0,
    progress: ProgressCallback = silent,
    clock: Callable[[], float] = time.perf_counter,
) -> Outcome:
    """Take rounds of samples until ``picture`` reaches ``goal`` by ``estimator``.

    Parameters
    ----------
    first:
        Samples per pixel of the first round. With a time limit a round of a single sample comes first, to measure how
        long a sample takes.
    slope:
        Expected power of the sample count by which the squared error falls.
    assessment:
        Expected seconds of denoising and of an estimate, until they have been measured.
    """
    began = clock() if goal.began is None else goal.began
    first, note, seconds, expected = min(first, goal.most), "", 0.0, 0.0
    samples = first if goal.max_time is None else 1
    while True:
        sampler.add(samples, _report_all(progress, sampler.samples, samples, expected, note, seconds))
        left = goal.seconds_left(clock() - began)
        if sampler.samples < first:
            samples = min(first - sampler.samples, _count_affordable(left - assessment, sampler))
            if samples >= 1:
                continue
            if sampler.samples == 1:
                return Outcome("time")
        started = clock()
        errors = picture.squared_error()
        estimate = estimator.estimate(errors, sampler.samples)
        assessment = clock() - started
        left = goal.seconds_left(clock() - began)
        shortfall = goal.measure_shortfall(estimate)
        growth = 10 ** (min(shortfall, 100.0) / (10 * slope)) if goal.has_quality else math.inf
        if growth <= (1.0 if goal.is_promise else TUNING.least_growth):
            return Outcome("quality", estimate, errors)
        if sampler.samples >= goal.most:
            return Outcome("samples", estimate, errors)
        needed = _choose_total(sampler.samples, growth)
        samples = min(needed, goal.most) - sampler.samples
        samples = min(samples, _count_affordable(left - assessment, sampler))
        if samples < 1:
            return Outcome("time", estimate, errors)
        if goal.has_quality:
            expected = min(goal.most, sampler.samples * growth)
        seconds = min(left, (expected - sampler.samples) * _time_sample(sampler) if expected else left)
        note = goal.describe(estimate)


def _choose_total(samples: int, growth: float) -> int:
    """Samples per pixel after the next round, which asks for ``growth`` times as many, within its limits.

    An even number, so that both streams get the same.
    """
    target = samples * min(TUNING.most_growth, max(TUNING.least_growth, growth))
    return STREAMS * math.ceil(target / STREAMS)


def _count_affordable(seconds: float, sampler: BatchedRender) -> int:
    """Samples per pixel that are taken within a share of ``seconds``."""
    most = TUNING.time_share * max(0.0, seconds) / max(_time_sample(sampler), 1e-9)
    return math.floor(min(most, MOST_SAMPLES))


def _time_sample(sampler: BatchedRender) -> float:
    """Seconds of one sample of every pixel, without compilation."""
    return sampler.seconds_trace / max(sampler.samples, 1)


def _report_all(
    progress: ProgressCallback, done: int, coming: int, expected: float, note: str, seconds: float
) -> ProgressCallback:
    """A round of ``coming`` samples after ``done``, reported as part of ``expected`` samples; ``seconds`` are left."""
    total = max(expected, float(done + coming))

    def report(inner: Progress) -> None:
        now = done + coming * inner.done / max(inner.total, 1e-9)
        left = f", about {max(0.0, seconds * (total - now) / (total - done)):.0f} s left" if note else ""
        progress(Progress(inner.stage, now, max(total, now), note + left))

    return report
