"""Key frames: every fourth frame of a film has half-buffers, which tell its error and how many samples are needed.

The halves of a frame are denoised one by one, as each judges the other. Their mean is worse than a frame whose samples
are of one stream and are denoised together: 0.3 to 0.7 dB (``docs/research/films.md``). So the frames after a key frame
have no halves. They take as many samples, and the estimate of the error is the key frame's.

Which frames are key frames follows from their numbers, unless there is a cut between: a frame that shows another scene
than its key frame has halves itself, and so has one whose key frame is not asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Container
from dataclasses import replace

from lippmann.display import Display
from lippmann.image.provenance import Provenance
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.sequences.cuts import Moment, is_cut

#: A key frame and the frames that follow it, together.
FRAMES_OF_KEY = 4


class KeyFrames:
    """The key frames of one sequence.

    Parameters
    ----------
    asked:
        The numbers of all its frames, those among them that an earlier run finished.
    display:
        The display.
    moment:
        Returns a frame by its number.
    render:
        Renders a frame; its provenance.
    """

    def __init__(
        self,
        asked: Container[int],
        display: Display,
        moment: Callable[[int], Moment],
        render: Callable[[Moment], Provenance],
    ) -> None:
        self._asked = asked
        self._display = display
        self._moment = moment
        self._render = render
        self._last: tuple[Moment, Provenance] | None = None

    def add(self, moment: Moment, made: Provenance) -> None:
        """Remember how a frame was made, if it is a key frame."""
        if key_of(moment.number) == moment.number:
            self._last = moment, made

    def before(self, moment: Moment, request: RenderRequest) -> Provenance | None:
        """How the key frame was made that stands for the error of a frame; None where the frame tells its own.

        Frames tell their own error where the samples, a quality or a time were asked for, where noise stands still,
        where the key frame's picture is no denoised one or is not asked for, and after a cut.
        """
        key = key_of(moment.number)
        is_open = request.spp is None and not request.is_open_ended and request.effort == "normal"
        if key == moment.number or key not in self._asked or not is_open or request.fixed_noise:
            return None
        if self._last is None or self._last[0].number != key:
            finished = self._moment(key)  # by an earlier run
            self.add(finished, self._render(finished))
        assert self._last is not None
        last, made = self._last
        is_judged = made.estimate is not None and "by_chance" in made.estimate
        return made if is_judged and not is_cut(last, moment, self._display) else None


def key_of(frame: int) -> int:
    """The key frame of a frame, by their numbers."""
    return frame - frame % FRAMES_OF_KEY


def without_halves(request: RenderRequest, frame: int, key: Provenance) -> RenderRequest:
    """The request of a ``frame`` that follows the ``key`` frame."""
    return replace(request, spp=key.spp, judged_by=f"samples and the estimate of the error are frame {key_of(frame)}'s")
