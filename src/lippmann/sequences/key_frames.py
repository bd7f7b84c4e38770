"""Key frames: every fourth frame of a film has half-buffers, which tell its error and how many samples are needed.

The halves of a frame are denoised one by one, as each judges the other. Their mean is worse than a frame whose samples
are of one stream and are denoised together: 0.3 to 0.7 dB (``docs/research/films.md``). So the frames after a key frame
have no halves. They take as many samples, and the estimate of the error is the key frame's.

Which frames are key frames follows from their numbers alone. Where a frame is rendered without its key frame, that one
is rendered first, so the frame is the same as among all others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lippmann.image.provenance import Provenance
from lippmann.rendering.request.render_request import RenderRequest

#: A key frame and the frames that follow it, together.
FRAMES_OF_KEY = 4


class KeyFrames:
    """The key frames of one sequence.

    Parameters
    ----------
    render:
        Renders a frame by its number; its provenance.
    """

    def __init__(self, render: Callable[[int], Provenance]) -> None:
        self._render = render
        self._last: tuple[int, Provenance] | None = None

    def add(self, frame: int, made: Provenance) -> None:
        """Remember how a frame was made, if it is a key frame."""
        if key_of(frame) == frame:
            self._last = frame, made

    def before(self, frame: int, request: RenderRequest) -> Provenance | None:
        """How the key frame was made that stands for the error of ``frame``; None where the frame tells its own.

        Frames tell their own error where the samples, a quality or a time were asked for, where noise stands still,
        and where the key frame's picture is no denoised one.
        """
        key = key_of(frame)
        is_asked = request.spp is not None or request.is_open_ended or request.effort != "normal"
        if frame == key or is_asked or request.fixed_noise:
            return None
        if self._last is None or self._last[0] != key:
            self.add(key, self._render(key))
        assert self._last is not None
        made = self._last[1]
        return made if made.estimate is not None and "by_chance" in made.estimate else None


def key_of(frame: int) -> int:
    """The key frame of a frame, by their numbers."""
    return frame - frame % FRAMES_OF_KEY


def without_halves(request: RenderRequest, frame: int, key: Provenance) -> RenderRequest:
    """The request of a ``frame`` that follows the ``key`` frame."""
    return replace(request, spp=key.spp, judged_by=f"samples and the estimate of the error are frame {key_of(frame)}'s")
