"""Goals of a render: a quality, a time, a number of samples."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lippmann.rendering.adaptive.tuning import TUNING
from lippmann.rendering.estimate.psnr import Estimate
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
        """Samples per pixel at which it is given up."""
        return min(self.spp or TUNING.most, TUNING.most)

    @property
    def least_worst(self) -> float | None:
        """PSNR in dB that every micro-image is to reach, if there is such a bound."""
        bounds = [] if self.quality_worst is None else [self.quality_worst]
        if self.quality is not None:
            bounds.append(self.quality - TUNING.most_below)
        return max(bounds, default=None)

    def seconds_left(self, spent: float) -> float:
        """What is left of ``max_time`` after so many seconds and the reserve; infinite without a limit."""
        return math.inf if self.max_time is None else self.max_time - self.reserve - spent

    def missing(self, estimate: Estimate) -> float:
        """How many dB the picture is short of the quality; at most 0 if it has it, minus infinity if none is asked."""
        short = -math.inf
        for _, value, low, asked in self._asked(estimate):
            has = min(value, low + TUNING.tolerance) if self.is_promise else value
            short = max(short, asked - has)
        return short

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
        for what, value, low, asked in self._asked(estimate):
            if value < asked:
                shortfalls.append(f"{what} is estimated at {_floor(value):.1f} of {asked:g} dB")
            elif low < asked - TUNING.tolerance:
                shortfalls.append(f"{what} is likely there, but may have {_floor(low):.1f} of {asked:g} dB")
        return ", ".join(shortfalls) or "too few samples to be sure"

    def _asked(self, estimate: Estimate) -> list[tuple[str, float, float, float]]:
        """Of the picture and of its worst part, where a quality is asked of them: its name, its PSNR, the lower end of
        the interval, and what is asked."""
        both = [
            ("the picture", estimate.psnr, estimate.psnr_low, self.quality),
            (f"the worst {self.part}", estimate.worst, estimate.worst_low, self.least_worst),
        ]
        return [(what, value, low, asked) for what, value, low, asked in both if asked is not None]


def _floor(value: float) -> float:
    return math.floor(10.0 * value) / 10.0


def goal_of(request: RenderRequest) -> Goal:
    """When a picture of this request is to stop: a default one takes of its reserve until it is clean."""
    if request.is_open_ended:
        return Goal(request.quality, request.quality_worst, request.max_time, request.spp)
    if request.spp_reserve is None:
        return Goal(spp=request.samples)
    return Goal(TUNING.clean, TUNING.clean_worst, spp=request.spp_reserve, is_promise=False)
