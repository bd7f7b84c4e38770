"""Goals of a render: a quality, a time, a number of samples."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lippmann.rendering.adaptive.tuning import TUNING
from lippmann.rendering.estimate.psnr import NO_MARGIN, Estimate, Margin
from lippmann.rendering.request.render_request import RenderRequest


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

    @property
    def is_modest(self) -> bool:
        """Whether no more is asked for than a default picture has anyway."""
        return self.quality is not None and self.quality_worst is None and self.quality <= TUNING.modest_quality

    def seconds_left(self, spent: float) -> float:
        """Of ``max_time``, which is set, what is left after so many seconds and the reserve; below 0 if it is up."""
        assert self.max_time is not None
        return self.max_time - self.reserve - spent

    def missing(self, estimate: Estimate, margin: Margin = NO_MARGIN) -> float:
        """How many dB the picture is short of the quality and a ``margin``; at most 0 if it has both.

        It has the quality where that is the likely one, and is missed by more than ``TUNING.tolerance`` only with a
        probability of 2.5 %.
        """
        short = [-math.inf]
        if self.quality is not None:
            has = min(estimate.psnr, estimate.psnr_low + TUNING.tolerance)
            short.append(self.quality + margin.whole - has)
        if self.least_worst is not None:
            has = min(estimate.worst, estimate.worst_low + TUNING.tolerance)
            short.append(self.least_worst + margin.worst - has)
        return max(short)

    def likely_missing(self, estimate: Estimate) -> float:
        """How many dB the likely PSNR is short, whatever its interval: that gets narrower as samples grow."""
        short = [-math.inf]
        if self.quality is not None:
            short.append(self.quality - estimate.psnr)
        if self.least_worst is not None:
            short.append(self.least_worst - estimate.worst)
        return max(short)

    @property
    def least_worst(self) -> float | None:
        """PSNR in dB that every micro-image is to reach, if there is such a bound."""
        bounds = [] if self.quality_worst is None else [self.quality_worst]
        if self.quality is not None:
            bounds.append(self.quality - TUNING.most_below)
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
        shortfalls = []
        for what, value, low, asked in (
            ("the picture", estimate.psnr, estimate.psnr_low, self.quality),
            (f"the worst {self.part}", estimate.worst, estimate.worst_low, self.least_worst),
        ):
            if asked is None:
                continue
            if value < asked:
                shortfalls.append(f"{what} is estimated at {_floor(value):.1f} of {asked:g} dB")
            elif low < asked - TUNING.tolerance:
                shortfalls.append(f"{what} is likely there, but may have {_floor(low):.1f} of {asked:g} dB")
        return ", ".join(shortfalls) or "too few samples to be sure"


def _floor(value: float) -> float:
    return math.floor(10.0 * value) / 10.0


def goal_of(request: RenderRequest) -> Goal:
    """When a picture of this request is to stop."""
    return Goal(request.quality, request.quality_worst, request.max_time, request.spp)
