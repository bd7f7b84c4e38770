"""Windows of a film: successive frames that one worker of a cluster renders as they are rendered in one process."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any

from lippmann.display import Display
from lippmann.image.metadata import Provenance
from lippmann.progress import silent
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.runtime import engine
from lippmann.runtime.atomic_write import scratch_folder
from lippmann.runtime.folder_list import read_list
from lippmann.runtime.machine import return_freed_memory
from lippmann.scene.mitsuba_source import MitsubaSource
from lippmann.sequences.cuts import Moment
from lippmann.sequences.forms import Form
from lippmann.sequences.frames import FramePlacements, choose_key_light, hold_exposure, make_frame_renderer
from lippmann.sequences.kept_scene import KeptScene
from lippmann.sequences.key_frames import list_frames_before
from lippmann.sequences.key_light import KeyLight
from lippmann.sequences.motion import Motion
from lippmann.sequences.tuning import TUNING


@dataclass(frozen=True)
class RenderedFrame:
    """A frame from a worker.

    Attributes
    ----------
    number:
        Of the frame.
    files:
        Content of its file, called "."; of a format that is a folder, of all files by their paths in it.
    provenance:
        How it was made.
    """

    number: int
    files: Mapping[str, bytes]
    provenance: Provenance


#: Renders the frames of windows, in any order, and calls the function with each.
WindowRunner = Callable[[Iterator["Window"], int, Callable[[RenderedFrame], None]], None]


@dataclass(frozen=True, eq=False)
class Window:
    """Frames to be rendered, as a job that can be pickled before it begins.

    Parameters
    ----------
    frames:
        Numbers of the frames.
    names:
        Names of their files.
    moments:
        These frames, and those that they follow, by number.
    display, request, form, shared:
        As of :func:`lippmann.sequences.frames.make_frame_renderer`.
    bits:
        Per value of the files.
    """

    frames: Sequence[int]
    names: Mapping[int, str]
    moments: Mapping[int, Moment]
    display: Display
    request: RenderRequest
    form: Form[Any]
    shared: KeyLight | None
    bits: int | None

    def name(self, index: int) -> str:
        """A frame's name for people."""
        return str(index)

    def count_before(self, index: int) -> int:
        """How many frames are rendered before a frame by a worker that has rendered none."""
        return len(list_frames_before(index, self.request, self.shared))

    def open(self, threads: int | None) -> Callable[[int], Callable[[], RenderedFrame]]:
        """A function that renders a frame; what that returns gives the frame."""
        request = replace(self.request, threads=threads)
        engine.start(request.device, threads)
        for source in (moment.scene.description for moment in self.moments.values()):
            if isinstance(source, MitsubaSource):
                source.scene()  # its files may be gone when the first frame is rendered
        render = make_frame_renderer(
            self.moments.__getitem__, self.display, request, self.form, self.shared, KeptScene()
        )

        def render_file(index: int) -> Callable[[], RenderedFrame]:
            image = render(index, silent)
            with scratch_folder("lippmann-frame-") as folder:
                path = Path(folder, self.names[index])
                self.form.write(image, path, self.bits)
                names = read_list(path) if path.is_dir() else {"."}
                files = {name: (path / name).read_bytes() for name in names}
            frame = RenderedFrame(index, files, image.provenance)
            del image
            return_freed_memory()
            return lambda: frame

        return render_file


def cut_windows(
    motion: Motion,
    display: Display,
    frames: Sequence[int],
    where: FramePlacements,
    path_of: Callable[[int], Path],
    request: RenderRequest,
    form: Form[Any],
    bits: int | None,
) -> Iterator[Window]:
    """The frames in windows, each of which a worker can render without the others; as many as pass on light."""
    request = hold_exposure(request, motion, display, where)
    for _, numbers in groupby(frames, lambda frame: frame // TUNING.frames_of_light):
        window, shared = list(numbers), choose_key_light(motion, where)
        before = (number for frame in window for number in list_frames_before(frame, request, shared))
        moments = {number: Moment(number, motion.scene(number), where(number)) for number in sorted({*window, *before})}
        names = {number: path_of(number).name for number in window}
        yield Window(window, names, moments, display, request, form, shared, bits)


__all__ = ["RenderedFrame", "Window", "WindowRunner", "cut_windows"]
