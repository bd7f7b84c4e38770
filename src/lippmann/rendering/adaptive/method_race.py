"""Full rendering against pooled light: both live off the same samples, and what reaches the goal for less goes on.

Which that will be is reckoned from where both stand and how their errors fall. Plain noise falls with the number of
samples; what a picture of denoised, pooled light is wrong by falls more slowly, and where the scene is smooth or the
quality high it may be behind. Work is counted in rays (:mod:`lippmann.rendering.denoise.cost_model`), so that the same
seed gives the same picture.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from lippmann.rendering.adaptive.convergence import Judgement, Track
from lippmann.rendering.adaptive.stopping import LEAST_GROWTH, Goal, believed_from, short_of_belief
from lippmann.rendering.denoise.cost_model import look_cost

Way = Literal["plain", "pooled"]

#: The power of the number of samples by which the error of denoised pictures falls: 0.5 to 0.8 where it was measured.
DENOISED_SLOPE = 0.6
#: A pooled picture that lost is looked at again when samples are so many times more: a look is cheap beside them then.
ASKED_AGAIN = 4


@dataclass(frozen=True, order=True)
class _Outlook:
    """What a way promises, the better the smaller: to reach the goal, for how many rays or else how short of it."""

    misses: bool
    value: float


class Contest:
    """Judges both ways, see :class:`~lippmann.rendering.adaptive.convergence.Judge`.

    Parameters
    ----------
    goal:
        What is to be reached.
    plain, pooled:
        The tracks of both.
    rays_per_pixel:
        What the samples so far took.

    Attributes
    ----------
    why:
        What that rests on, as a sentence.
    """

    def __init__(self, goal: Goal, plain: Track, pooled: Track, rays_per_pixel: Callable[[], float]) -> None:
        self._goal = goal
        self._plain = plain
        self._pooled = pooled
        self._rays_per_pixel = rays_per_pixel
        self._closed_to = 0.0
        self._leading: Track | None = None
        self.why = "there was no time to look at pooled light"

    @property
    def leader(self) -> Way:
        """Whose picture is the better one for the goal."""
        return "pooled" if self._leading is self._pooled else "plain"

    @property
    def first(self) -> int:
        """The leader's; at first that of plain samples, which are looked at for little."""
        return (self._leading or self._plain).first

    @property
    def fewest(self) -> int:
        """The leader's; at first that of pooled light, which is believed sooner."""
        return (self._leading or self._pooled).fewest

    def margin(self, samples: int) -> float:
        """The leader's; at first that of plain samples."""
        return (self._leading or self._plain).margin(samples)

    def judge(self, samples: int, room: float) -> Judgement:
        """The leader's judgement; the pooled picture is looked at only while it may win."""
        plain = self._plain.judge(samples)
        if samples < self._closed_to and not self._is_last_chance(plain, samples, room):
            return plain
        rays = self._rays_per_pixel()
        look = look_cost(rays)
        least = believed_from(self._goal, plain, samples, self._plain)
        outlook = self._outlook(plain, rays, room, least=least / samples)
        if not outlook.misses and outlook.value <= look:
            self._lead(self._plain, "the quality is within reach of plain samples for less than pooling takes")
            return plain
        if self._goal.has_quality and samples < self._pooled.first and room > 1:
            return plain
        pooled = self._pooled.judge(samples)
        there = self._goal.has_quality and self._goal.missing(pooled.estimate) <= 0
        with_noise_out = self._outlook(pooled, rays, room, 0.0 if there else look)
        stand = f"after {samples} samples {self._value(pooled)} pooled and {self._value(plain)} plain"
        if with_noise_out < outlook:
            self._lead(self._pooled, stand)
            return pooled
        # Plain noise is surer to fall than what denoising leaves, unless few paths find the light; and where time is
        # short, none is spent on looks.
        self._closed_to = math.inf if self._goal.max_time is not None else ASKED_AGAIN * samples
        self._lead(self._plain, f"{stand}, which reaches the goal sooner" if self._goal.has_quality else stand)
        return plain

    def seconds(self) -> float:
        """What the next judgement will take, as far as that is known."""
        return self._plain.seconds() + (self._pooled.seconds() if self._closed_to < math.inf else 0.0)

    def _is_last_chance(self, plain: Judgement, samples: int, room: float) -> bool:
        """No more samples may be taken, and plain ones are not there: the better picture is wanted, whichever it is."""
        short = short_of_belief(self._goal, plain.estimate, samples, self._plain)
        return self._goal.max_time is None and room <= 1 and short > 0

    def _lead(self, track: Track, why: str) -> None:
        self._leading, self.why = track, why

    def _outlook(self, judged: Judgement, rays: float, room: float, look: float = 0.0, least: float = 1.0) -> _Outlook:
        """Rays per pixel still to be spent, or dB short of the goal when there is no room for more.

        ``least``: by how much samples have to be multiplied for the judgement to be believed.
        """
        if not self._goal.has_quality:
            # Where only a time is set, the better picture is wanted.
            return _Outlook(True, -judged.estimate.psnr - 10 * judged.slope * math.log10(room))
        likely = min(600.0, self._goal.likely_missing(judged.estimate))
        needed = max(1.0, least)
        if self._goal.missing(judged.estimate) > 0:
            needed = max(LEAST_GROWTH, least, 10 ** (likely / (10 * judged.slope)))
        if needed <= room:
            return _Outlook(False, (needed - 1) * rays + look)
        # The likely PSNR, for a picture is no worse because it knows less of its error.
        return _Outlook(True, likely - 10 * judged.slope * math.log10(room))

    def _value(self, judged: Judgement) -> str:
        if self._goal.quality is not None:
            return f"{judged.estimate.worst:.1f} dB"
        return f"{judged.estimate.psnr:.1f} dB"
