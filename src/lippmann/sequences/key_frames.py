"""Key frames: every fourth frame of a film has half-buffers, which tell its error and how many samples are needed.

The halves of a frame are denoised one by one, as each judges the other. Their mean is worse than a frame whose samples
are of one stream and are denoised together: 0.3 to 0.7 dB (``docs/research/films.md``). So the frames after a key frame
have no halves. They take three quarters of its samples, and the estimate of their error follows from the key frame's.

Which frames are key frames follows from their numbers, so that a frame is the same whether it is rendered alone or with
all others. A frame that shows another scene than its key frame, as after a cut, has halves itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import cast

from lippmann.display import Display
from lippmann.image.picture import Provenance
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.sequences.cuts import Moment, is_cut, is_light_at_rest
from lippmann.sequences.flicker import Figures
from lippmann.sequences.kept_light import KeptLight
from lippmann.sequences.key_light import KeyLight

#: A key frame and the frames that follow it, together.
FRAMES_OF_KEY = 4
#: Samples of a frame after a key frame, as a share of the key frame's.
_SHARE = 0.75


class KeyFrames:
    """The key frames of one sequence.

    Parameters
    ----------
    display:
        The display.
    moment:
        Returns a frame by its number.
    render:
        Renders a frame as a request asks, which has no seed of the frame's own yet; its provenance.
    follows_camera:
        Whether the display follows a camera, so that it may move alone.
    """

    def __init__(
        self,
        display: Display,
        moment: Callable[[int], Moment],
        render: Callable[[Moment, RenderRequest], Provenance],
        follows_camera: bool,
    ) -> None:
        self._display = display
        self._moment = moment
        self._render = render
        self._follows_camera = follows_camera
        self._last: tuple[Moment, Provenance] | None = None
        self._light = KeptLight()
        self._shared = KeyLight()

    def request_of(self, request: RenderRequest, moment: Moment, key: Provenance | None) -> RenderRequest:
        """The request of a frame, which follows a ``key`` frame or, None, has halves of its own."""
        frame = moment.number
        if key is not None:
            assert key.spp is not None
            assert self._last is not None
            told = f"the estimate of the error follows from frame {key_of(frame)}'s, with three quarters of its samples"
            samples = math.ceil(_SHARE * key.spp)
            own = replace(request, spp=samples, judged_by=told, keep_light=self._light.of_next)
            is_shared = self._follows_camera and is_light_at_rest(self._last[0], moment)
            return replace(own, trace_through=self._shared.trace_next) if is_shared else own
        is_key = key_of(frame) == frame and _is_open(request)
        if not is_key:
            return request
        own = replace(request, keep_light=self._light.of_key)
        return replace(own, trace_through=self._shared.trace_key) if self._follows_camera else own

    def add(self, moment: Moment, made: Provenance) -> None:
        """Remember how a frame was made, if it is a key frame."""
        if key_of(moment.number) == moment.number:
            self._last = moment, made

    def before(self, moment: Moment, request: RenderRequest) -> Provenance | None:
        """How the key frame was made that stands for the error of a frame; None where the frame tells its own.

        Frames tell their own error where the samples, a quality or a time were asked for, where noise stands still,
        where the key frame's picture is no denoised one, and after a cut. A key frame that is missing is rendered.
        """
        key = key_of(moment.number)
        if key == moment.number or not _is_open(request):
            return None
        last, made = self._last or (None, None)
        if last is None or last.number != key:
            last, made = self._moment(key), None
        if is_cut(last, moment, self._display):
            return None
        if made is None:
            made = self._render(last, self.request_of(request, last, None))
            self.add(last, made)
        return made if made.estimate is not None and "by_chance" in made.estimate else None


def key_of(frame: int) -> int:
    """The key frame of a frame, by their numbers."""
    return frame - frame % FRAMES_OF_KEY


def estimate_of_next(key: Figures) -> Figures:
    """The estimate of a frame after a key frame, whose own is ``key``, both as files hold them.

    The MSE of a denoised picture is taken to fall with the square root of the number of samples, as it does on the
    average (``docs/background/measurements.md``: 2.4 dB for four times as many), and at most in proportion to it: that
    are the lower ends. The upper ends are the key frame's, as the frame is denoised as a whole.
    """
    most = -10 * math.log10(_SHARE)
    less = {"psnr": most / 2, "worst": most / 2, "by_chance": most / 2, "psnr_low": most, "worst_low": most}
    return {name: round(cast("float", value) - less[name], 2) if name in less else value for name, value in key.items()}


def _is_open(request: RenderRequest) -> bool:
    """Whether frames may follow key frames: nothing was asked for that each has to keep for itself."""
    is_asked = request.spp is not None or request.is_open_ended or request.effort != "normal"
    return not is_asked and not request.fixed_noise
