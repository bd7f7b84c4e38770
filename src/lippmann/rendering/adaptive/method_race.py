"""Full rendering against pooled light, both made of the same samples: the one that reaches the goal for less work wins.

The winner is predicted from the present errors of both and the rates at which they fall. Plain noise falls with the
number of samples; the error of denoised, pooled light falls more slowly, and where the scene is smooth or the quality
high it may be larger. Work is counted in rays (:mod:`lippmann.rendering.denoise.cost_model`), so that the same
seed gives the same picture.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from lippmann.rendering.adaptive.convergence import Assessment, ErrorTrack
from lippmann.rendering.adaptive.stopping import LEAST_GROWTH, Goal, missing_with_margin, samples_to_trust
from lippmann.rendering.denoise.cost_model import look_cost
from lippmann.rendering.estimate.psnr import Margin

Way = Literal["plain", "pooled"]

#: The power of the number of samples by which the error of denoised pictures falls: 0.5 to 0.8 where it was measured.
DENOISED_SLOPE = 0.6
#: A pooled picture that lost is assessed again at so many times the samples, which cost far more than that then.
ASKED_AGAIN = 4
#: By so much, at most, have samples to be multiplied where only the interval is too wide.
MOST_TO_BE_SURE = 3.0
#: In dB: by no more do pooled pictures of very few samples exceed what these state, as a rule. With 2 samples 22 of the
#: 24 of ``benchmarks/goals.py`` do so by 3 to 12 dB for sure, the others by 14 and 19.
MOST_GAINED = 12.5
#: The same on lenses of at least ``WIDE_LENS`` pixels across, which share more light: 5 to 22 dB with 2 samples. Where
#: samples are cheap, a look that is lost costs more than those that it may save: less is hoped for there.
MOST_GAINED_WIDE, MOST_GAINED_WIDE_AND_DEAR, WIDE_LENS = 15.0, 20.0, 32


@dataclass(frozen=True, order=True)
class _Outlook:
    """Prediction for one method, the smaller the better: whether it misses the goal; its rays, or dB it is short."""

    misses: bool
    value: float


class MethodRace:
    """Assesses both methods, see :class:`~lippmann.rendering.adaptive.convergence.Assessor`.

    Parameters
    ----------
    goal:
        The goal of both.
    plain, pooled:
        Error tracks of both.
    rays_per_pixel:
        Rays per pixel that the samples so far took.
    most_gained:
        In dB: by how much pooled pictures of very few samples exceed plain ones at most, as a rule.

    Attributes
    ----------
    reason:
        Why the leader leads, as a sentence.
    """

    def __init__(
        self,
        goal: Goal,
        plain: ErrorTrack,
        pooled: ErrorTrack,
        rays_per_pixel: Callable[[], float],
        most_gained: float = MOST_GAINED,
    ) -> None:
        self._goal = goal
        self._plain = plain
        self._pooled = pooled
        self._rays_per_pixel = rays_per_pixel
        self._most_gained = most_gained
        self._closed_to = 0.0
        self._leading: ErrorTrack | None = None
        self.reason = "there was no time to assess pooled light"

    @property
    def leader(self) -> Way:
        """The method whose picture suits the goal better."""
        return "pooled" if self._leading is self._pooled else "plain"

    @property
    def first(self) -> int:
        """The leader's; at first that of the method that may be assessed sooner."""
        return self._leading.first if self._leading else min(self._plain.first, self._pooled.first)

    @property
    def fewest(self) -> int:
        """The leader's; at first that of pooled light, which is trusted sooner."""
        return (self._leading or self._pooled).fewest

    def margin(self, samples: int) -> Margin:
        """The leader's; at first that of plain samples."""
        return (self._leading or self._plain).margin(samples)

    def assess(self, samples: int, room: float) -> Assessment:
        """The leader's assessment; the pooled picture is assessed only while it may win."""
        plain = self._plain.assess(samples)
        if samples < self._closed_to and not self._is_last_chance(plain, samples, room):
            return plain
        rays = self._rays_per_pixel()
        look = look_cost(rays)
        least = samples_to_trust(self._goal, plain, samples, self._plain)
        outlook = self._outlook(plain, rays, room, least=least / samples)
        if not outlook.misses and outlook.value <= look:
            self._lead(self._plain, "the quality is within reach of plain samples for less than pooling takes")
            return plain
        if self._goal.has_quality and room > 1 and self._is_too_early(plain, samples):
            return plain
        pooled = self._pooled.assess(samples)
        there = missing_with_margin(self._goal, pooled.estimate, samples, self._pooled) <= 0
        least = samples_to_trust(self._goal, pooled, samples, self._pooled)
        with_noise_out = self._outlook(
            pooled, rays, room, 0.0 if self._goal.has_quality and there else look, least / samples
        )
        stand = f"after {samples} samples {self._value(pooled)} pooled and {self._value(plain)} plain"
        if with_noise_out < outlook:
            self._lead(self._pooled, stand)
            return pooled
        # Plain noise falls more reliably than the error left by denoising, unless few paths find the light. A picture
        # that lacks nothing but the margin is assessed again when none is asked for.
        lacks_margin = self._goal.has_quality and self._goal.missing(pooled.estimate) <= 0
        self._closed_to = 0.0 if lacks_margin else ASKED_AGAIN * samples
        self._lead(self._plain, f"{stand}, which reaches the goal sooner" if self._goal.has_quality else stand)
        return plain

    def seconds(self) -> float:
        """Expected seconds of the next assessment: the last one is of both pictures."""
        return self._plain.seconds() + self._pooled.seconds()

    def _is_too_early(self, plain: Assessment, samples: int) -> bool:
        """Whether a look at the pooled picture would be lost, by its cost or by how far plain samples are off."""
        if samples < self._pooled.first:
            return True
        if samples >= self._plain.first:
            return False
        return self._goal.likely_missing(plain.estimate, self._pooled.margin(samples)) > self._most_gained

    def _is_last_chance(self, plain: Assessment, samples: int, room: float) -> bool:
        """Whether plain samples miss the goal and no more may be taken: the better of both pictures is wanted then."""
        short = missing_with_margin(self._goal, plain.estimate, samples, self._plain)
        return room < LEAST_GROWTH and short > 0

    def _lead(self, track: ErrorTrack, reason: str) -> None:
        self._leading, self.reason = track, reason

    def _outlook(
        self, assessment: Assessment, rays: float, room: float, look: float = 0.0, least: float = 1.0
    ) -> _Outlook:
        """Rays per pixel still to be spent, or dB short of the goal when there is no room for more.

        ``least``: by how much samples have to be multiplied for the assessment to be trusted.
        """
        if not self._goal.has_quality:
            # Where only a time is set, the better picture is wanted.
            return _Outlook(True, -assessment.estimate.psnr - 10 * assessment.slope * math.log10(room))
        likely = min(600.0, self._goal.likely_missing(assessment.estimate))
        needed = max(1.0, least)
        missing = self._goal.missing(assessment.estimate)
        if missing > 0:
            there, sure = (10 ** (short / (10 * assessment.slope)) for short in (likely, min(600.0, missing)))
            # Intervals get narrower faster than pictures better.
            needed = max(LEAST_GROWTH, least, there, min(sure, MOST_TO_BE_SURE))
        if needed <= room:
            return _Outlook(False, (needed - 1) * rays + look)
        # The likely PSNR: a wider interval makes a picture no worse.
        return _Outlook(True, likely - 10 * assessment.slope * math.log10(room))

    def _value(self, assessment: Assessment) -> str:
        if self._goal.quality is None and self._goal.quality_worst is not None:
            return f"{assessment.estimate.worst:.1f} dB"
        return f"{assessment.estimate.psnr:.1f} dB"
