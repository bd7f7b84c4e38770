"""The frames of a sequence in files, and going on with a sequence that was interrupted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lippmann.display import Display
from lippmann.image.encoding import FormatName
from lippmann.image.metadata import Provenance
from lippmann.image.write import format_for, replacing_output
from lippmann.journal.fingerprint import content_hash, in_words
from lippmann.journal.frame_journal import ENDING, FrameJournal
from lippmann.journal.tile_journal import sweep_beside
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.runtime import engine
from lippmann.scene.placement import options_of_sequence
from lippmann.sequences.forms import INTEGRAL, Form
from lippmann.sequences.frames import FramePlacements, place_frames, render_frames
from lippmann.sequences.motion import Motion
from lippmann.sequences.windows import RenderedFrame, Window, WindowRunner, cut_windows

if TYPE_CHECKING:
    from lippmann.quilts.quilt import Quilt

#: What of a request changes nothing in the pictures, or is told apart.
_IMMATERIAL = ("device", "threads", "plan", "placement")


@dataclass(frozen=True, eq=False)
class SavedFrame:
    """A frame in its file.

    Attributes
    ----------
    number, path:
        Of the frame and its file.
    provenance:
        How it was made; without seconds where it was ``resumed``.
    resumed:
        Whether an earlier run had rendered it.
    quilt:
        A quilt with the values of its file; None where they have to be read.
    """

    number: int
    path: Path
    provenance: Provenance
    resumed: bool = False
    quilt: Quilt | None = None


def journal_of(output: Path, first: Path) -> Path:
    """The journal of a sequence called ``output`` whose first frame's file is ``first``."""
    return first.parent / (output.name + ENDING)


@contextmanager
def save_sequence(
    motion: Motion,
    output: Path,
    path_of: Callable[[int], Path],
    display: Display,
    frames: Sequence[int],
    request: RenderRequest,
    *,
    form: Form[Any] = INTEGRAL,
    resume: bool = False,
    bits: int | None = None,
    runner: WindowRunner | None = None,
    progress: ProgressCallback = silent,
) -> Iterator[Iterator[SavedFrame]]:
    """Render one file a frame; a journal beside them tells which are finished.

    A context manager: each frame is rendered when it is asked for, and the journal is removed once the ``with`` ends
    well and all frames have been asked for. What is made of the frames inside of it, a film, may be interrupted, too.

    Parameters
    ----------
    output:
        What the sequence is called; see :func:`journal_of`.
    path_of:
        The file of each frame.
    request:
        How each is made; its placement is for the whole sequence.
    form:
        What each frame is: an integral image, or a quilt.
    resume:
        Keep the frames that an interrupted run finished, if there are any: those whose files are as they were then. All
        frames together are the same, byte for byte, as those of an unbroken run.
    runner:
        Renders the frames elsewhere, all before the first is yielded; the files are the same, byte for byte. By default
        this process.
    bits:
        See :func:`lippmann.image.write.format_for`.

    Yields
    ------
    Iterator[SavedFrame]
        An iterator over the frames in their order, each once it lies in its file.

    Raises
    ------
    PictureError
        If the journal is of another sequence: another scene, display, version or option; says what differs.
    LippmannError
        As those functions.
    """
    from lippmann.rendering.denoise import oidn
    from lippmann.tiles.job import made_by

    name, stored = format_for(path_of(frames[0]), bits)
    placement = options_of_sequence(request.placement)
    started = engine.start(request.device, request.threads)
    denoiser = oidn.denoiser_version() if request.denoise != "none" else None
    options = {name: value for name, value in vars(request).items() if name not in _IMMATERIAL}
    fingerprint = {
        **made_by(started.gpu_name or "cpu", started.llvm_version, denoiser),
        "the scene and what moves in it": content_hash(motion.content),
        **in_words(display.to_dict(), "the display's "),
        **in_words(options),
        **in_words(vars(placement), "placement "),
        **form.settings,
        "the format": name,
        "values": stored,
        "the first frame": str(frames[0]),
    }
    where = place_frames(motion, display, placement)
    with FrameJournal.open(journal_of(output, path_of(frames[0])), fingerprint, resume=resume) as journal:
        missing = [number for number in frames if not journal.holds(number, path_of(number))]
        if missing:
            sweep_beside(path_of(missing[0]))  # which an interrupted run may have left half written
        if runner is None:
            made = _render_here(motion, display, missing, where, path_of, bits, progress, request, form, journal)
        else:
            request = replace(request, device="gpu" if started.gpu_name else "cpu", threads=None)
            windows = cut_windows(motion, display, missing, where, path_of, request, form, bits)
            made = _render_there(windows, missing, path_of, name, runner, progress, journal)
        yield _order_frames(frames, missing, path_of, made, form)
        if all(number in journal for number in frames):
            journal.finish()


def _order_frames(
    frames: Sequence[int],
    missing: Sequence[int],
    path_of: Callable[[int], Path],
    made: Iterator[SavedFrame],
    form: Form[Any],
) -> Iterator[SavedFrame]:
    """The frames that lie there and those that are ``made``."""
    absent = set(missing)
    for number in frames:
        if number in absent:
            yield next(made)
        else:
            path = path_of(number)
            yield SavedFrame(number, path, form.provenance(path), resumed=True)


def _render_here(
    motion: Motion,
    display: Display,
    frames: Sequence[int],
    where: FramePlacements,
    path_of: Callable[[int], Path],
    bits: int | None,
    progress: ProgressCallback,
    request: RenderRequest,
    form: Form[Any],
    journal: FrameJournal,
) -> Iterator[SavedFrame]:
    """Frames rendered by this process, saved, and written down."""
    for number, image in render_frames(motion, display, frames, where, request, form, progress):
        path = path_of(number)
        frame = SavedFrame(number, path, image.provenance, quilt=form.write(image, path, bits))
        del image  # while the next is rendered
        journal.add(number, path)
        yield frame
        del frame  # likewise


def _render_there(
    windows: Iterator[Window],
    frames: Sequence[int],
    path_of: Callable[[int], Path],
    name: FormatName,
    runner: WindowRunner,
    progress: ProgressCallback,
    journal: FrameJournal,
) -> Iterator[SavedFrame]:
    """Frames rendered by a runner, saved and written down as they come."""
    saved: dict[int, SavedFrame] = {}

    def save(frame: RenderedFrame) -> None:
        path = path_of(frame.number)
        with replacing_output(path, name) as temporary:
            for part, content in frame.files.items():
                place = temporary / part
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_bytes(content)
        journal.add(frame.number, path)
        saved[frame.number] = SavedFrame(frame.number, path, frame.provenance)
        progress(Progress("sequence", len(saved), len(frames), f"frame {len(saved)} of {len(frames)}"))

    if frames:
        progress(Progress("sequence", 0, len(frames)))
        runner(windows, len(frames), save)
    yield from (saved[number] for number in frames)
