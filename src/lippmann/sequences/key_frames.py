"""Key frames: every fourth frame of a film has half-buffers, which tell its error and how many samples are needed.

The half-buffers of a frame are denoised separately, so that each measures the error of the other. Their mean has 0.3 to
0.7 dB less than a frame whose samples are one stream, denoised together (``docs/research/films.md``). So the frames
after a key frame have no half-buffers. They take three quarters of its samples, and the estimate of their error follows
from the key frame's and from how much noise the denoiser took from either: an object may turn to a noisier side.

Where nothing but a camera moves, and where the display is at rest, frames take a key frame's light
(:mod:`lippmann.sequences.key_light`). Then only every 32nd frame has halves. Every second frame of a moving camera, and
every fourth before a display at rest, passes on the light that it took.

Which frames are key frames follows from their numbers, so that a frame is the same whether it is rendered alone or with
all others. A frame after a cut has halves itself. So has every fourth frame that shows another view than its key frame,
as in a fast flight.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple, cast

from lippmann.display import Display
from lippmann.image.metadata import Provenance
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.sequences.cuts import Moment, is_cut
from lippmann.sequences.flicker import Figures
from lippmann.sequences.kept_light import KeptLight
from lippmann.sequences.key_light import KeyLight
from lippmann.sequences.tuning import TUNING

if TYPE_CHECKING:
    from lippmann.rendering.methods import Job, Traced


class Key(NamedTuple):
    """A key frame, and how it was made."""

    moment: Moment
    made: Provenance


class KeyFrames:
    """The key frames of one sequence.

    Parameters
    ----------
    display:
        The display.
    moment:
        Returns a frame by its number.
    render:
        Renders a frame as a request asks, with the seed of the frame of a number; its provenance.
    shared:
        Takes the light of key frames for those after them; None where all frames are traced.
    """

    def __init__(
        self,
        display: Display,
        moment: Callable[[int], Moment],
        render: Callable[[Moment, RenderRequest, int], Provenance],
        shared: KeyLight | None,
    ) -> None:
        self._display = display
        self._moment = moment
        self._render = render
        self._shared = shared
        self._step = _count_frames_of_link(shared)
        self._last: tuple[Moment, Key] | None = None  # the last frame that others follow, and its key frame
        self._light = KeptLight()
        self._variances = {"key": 0.0, "next": 0.0}  # of one sample of the last frame of either kind

    def make_request(self, request: RenderRequest, moment: Moment, key: Key | None) -> RenderRequest:
        """The request of a frame, which follows a ``key`` frame or, None, has halves of its own."""
        has_next = moment.number % self._step == 0
        if key is not None:
            assert key.made.spp is not None
            assert self._last is not None
            samples = math.ceil(TUNING.samples_kept * key.made.spp)
            frame = key.moment.number
            source = f"the estimate of the error follows from frame {frame}'s, with three quarters of its samples"
            own = replace(request, spp=samples, judged_by=source, keep_light=self._light.reuse_key)
            holds = self._shared is not None and self._shared.holds(self._last[0], moment)
            return replace(own, trace_through=partial(self._trace, "next", holds, has_next))
        if not (has_next and _is_open(request)):
            return request
        return replace(request, keep_light=self._light.keep_key, trace_through=partial(self._trace, "key", False, True))

    def _trace(self, kind: str, holds: bool, has_next: bool, job: Job, trace: Callable[[Job], Traced]) -> Traced:
        """Trace a frame with the key frame's light where that ``holds``; others may follow those that ``has_next``."""
        if self._shared is None or not (holds or has_next):
            traced = trace(job)
        elif holds:
            traced = (self._shared.pass_on if has_next else self._shared.trace_next)(job, trace)
        else:
            traced = self._shared.trace_key(job, trace)
        # Among clean pixels the denoiser takes other noise.
        self._variances[kind] = 0.0 if "reprojected" in traced.frame.shares else job.denoiser.variance
        return traced

    def estimate(self, made: Provenance, key: Key | None) -> Figures | None:
        """The estimate of a frame that was ``made`` last, after a ``key`` frame or, None, as one; as its file holds it.

        Noise is taken to fall in proportion to the samples, and to grow with the variance of one. Where a frame takes a
        key frame's light, only the samples count.
        """
        if key is None or key.made.estimate is None:
            return made.estimate
        variances = self._variances
        grown = variances["next"] / variances["key"] if 0.0 not in variances.values() else 1.0
        return estimate_next(key.made.estimate, grown / TUNING.samples_kept)

    def noise_of(self, frame: int, request: RenderRequest) -> int:
        """Number of the frame whose seed a frame takes: its own, or 0 where kept pixels would jump to new noise."""
        is_alike = self._shared is not None and self._shared.keeps_noise and _is_open(request)
        return 0 if is_alike and frame % TUNING.frames_of_light == 0 else frame

    def add(self, moment: Moment, made: Provenance, key: Key | None) -> Key:
        """Remember how a frame was made, and return its key frame: ``key``, or itself where that is None."""
        key = key or Key(moment, made)
        if moment.number % self._step == 0:
            self._last = moment, key
        return key

    def before(self, moment: Moment, request: RenderRequest) -> Key | None:
        """The key frame whose error a frame's estimate follows from; None for frames with half-buffers of their own.

        Frames tell their own error where the samples, a quality or a time were asked for, where noise stands still,
        where the key frame's picture is no denoised one, and after a cut. A frame to follow that is missing is
        rendered.
        """
        number = next(iter(list_frames_before(moment.number, request, self._shared)), None)
        if number is None:
            return None
        kept = self._last if self._last is not None and self._last[0].number == number else None
        last = self._moment(number) if kept is None else kept[0]
        may_have_halves = moment.number % TUNING.frames_of_key == 0
        if is_cut(last, moment, self._display):
            return None
        if may_have_halves and not (self._shared and self._shared.holds(last, moment)):
            return None
        if kept is None:
            before = self.before(last, request)
            made = self._render(last, self.make_request(request, last, before), self.noise_of(number, request))
            key = self.add(last, made, before)
        else:
            key = kept[1]
        if key.made.estimate is None or "by_chance" not in key.made.estimate:
            return None
        if not may_have_halves:
            return key
        # A steady flight leaves its key frame's view behind, too: it has halves again as often as other films do.
        # So have pictures that are traced whole, such as those with photons.
        shared = self._shared
        follows = shared and shared.has_light and not is_cut(key.moment, moment, self._display)
        return key if follows else None


def list_frames_before(frame: int, request: RenderRequest, shared: KeyLight | None) -> list[int]:
    """The frames that a frame follows by their numbers, from the one before it back to the key frame; cuts aside."""
    before: list[int] = []
    step, halves = _count_frames_of_link(shared), TUNING.frames_of_key if shared is None else TUNING.frames_of_light
    while _is_open(request) and frame % halves:
        frame = (frame - 1) // step * step
        before.append(frame)
    return before


def _count_frames_of_link(shared: KeyLight | None) -> int:
    """Every so many frames one is followed by others."""
    return TUNING.frames_of_key if shared is None else shared.frames_of_link


def estimate_next(key: Figures, noise: float) -> Figures:
    """The estimate of a frame with ``noise`` times the key frame's, whose estimate is ``key``, both as files hold them.

    The MSE of a denoised picture is taken to follow the square root of the noise, as it does on the average
    (``docs/background/measurements.md``: 2.4 dB for four times the samples), and at most the noise itself: that is the
    lower end of a frame with more of it, and the upper end of one with less. The other ends are the key frame's.
    """
    less = 10 * math.log10(noise)
    middle = dict.fromkeys(("psnr", "worst", "by_chance"), less / 2)
    ends = {"psnr_low": max(less, 0), "worst_low": max(less, 0), "psnr_high": min(less, 0), "worst_high": min(less, 0)}
    changes = {**middle, **ends}
    return {
        name: round(cast("float", value) - changes[name], 2) if name in changes else value
        for name, value in key.items()
    }


def _is_open(request: RenderRequest) -> bool:
    """Whether frames may follow key frames: nothing was asked for that each has to keep for itself."""
    is_asked = request.spp is not None or request.is_open_ended or request.effort != "normal"
    return not is_asked and not request.fixed_noise
