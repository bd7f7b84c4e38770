"""Sequences: a scene that moves, or turns on a turntable, becomes numbered pictures or quilts, and a film of them."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lippmann.cli.shared.console import Console
from lippmann.errors import OutputError, UsageError
from lippmann.options.outputs import SequenceOptions
from lippmann.options.texts import triple
from lippmann.sequences.flicker import film_in_words

if TYPE_CHECKING:
    from lippmann.cli.shared.scene_source import SceneSource
    from lippmann.display import Display
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.sequences.files import SavedFrame
    from lippmann.sequences.films import FilmEye, Filming
    from lippmann.sequences.forms import Form
    from lippmann.sequences.frames import FrameRange
    from lippmann.sequences.motion import Motion
    from lippmann.sequences.windows import WindowRunner

_NUMBER = re.compile(r"%(?:0(\d{1,2}))?d")
_NUMERAL = re.compile(r"\([^()]*\)|[\d.]+")
_FOLDER_PATTERN = "frame_%04d"


@dataclass(frozen=True)
class Files:
    """Files to write: the output, its bits per value, maps, and whether to go on with an interrupted run."""

    output: Path
    bits: int | None
    maps: Path | None
    resume: bool


def render_frames(
    source: SceneSource,
    display: Display,
    request: RenderRequest,
    spec: SequenceOptions,
    files: Files,
    console: Console,
    *,
    form: Form[Any] | None = None,
    runner: WindowRunner | None = None,
) -> None:
    """Render and write all frames: quilts of a given ``form``, or without one integral images."""
    from lippmann.image.write import format_for
    from lippmann.journal.tile_journal import sweep_beside
    from lippmann.sequences.files import save_sequence
    from lippmann.sequences.forms import INTEGRAL, QuiltForm
    from lippmann.sequences.motion import FRAMES_PER_SECOND
    from lippmann.viewing.video_file import write_codes

    _check(spec)
    request = replace(request, fixed_noise=spec.fixed_noise)
    chosen = frame_range(spec.frames or ":")
    output = files.output
    motion = open_moving(source, spec, request)
    frames = chosen.of(motion)
    ending = form.quilt.ending if isinstance(form, QuiltForm) else ""
    path_of = name_frames(output, len(frames), ending)
    name, _ = format_for(path_of(frames[0]), files.bits)
    filming = _filming(spec, motion, display, request, form, len(frames))
    if filming is not None and filming.note is not None:
        console.remark(filming.note)
    if files.maps is not None:
        raise UsageError("a sequence writes no pictures of its maps", where="--maps", fix="leave it out")
    if request.layers and name != "exr":
        raise UsageError(
            "the frames cannot hold layers", where="--layers", rule="OpenEXR can", fix="name them %04d.exr"
        )
    account = _Account()
    with (
        _places(output, path_of(frames[0]), spec.video),
        console.progress() as progress,
        save_sequence(
            motion,
            output,
            path_of,
            display,
            frames,
            request,
            form=form or INTEGRAL,
            resume=files.resume,
            bits=files.bits,
            runner=runner,
            progress=progress,
        ) as saved,
    ):
        noted_frames = map(account.note, saved)
        if filming is None or spec.video is None:
            deque(noted_frames, maxlen=0)
        else:
            sweep_beside(spec.video)
            write_codes(
                map(filming.codes, noted_frames),
                spec.video,
                frames_per_second=spec.fps or FRAMES_PER_SECOND,
                codec=filming.codec,
                quilt=filming.quilt,
                has_depth=filming.has_depth,
            )
    account.tell(console, output, spec.video)


class _Account:
    """What is told of frames in the end: each frame, and the remarks on them, alike ones once."""

    def __init__(self) -> None:
        self._frames: list[dict[str, Any]] = []
        self._notes: dict[str, dict[int, str]] = {}

    def note(self, frame: SavedFrame) -> SavedFrame:
        """Add a frame, and pass it on."""
        made = frame.provenance
        self._frames.append(
            {
                "frame": frame.number,
                "output": str(frame.path),
                "seconds": made.seconds.get("total", 0.0),
                "spp": made.spp,
                "found": frame.resumed,
                "estimate": None if made.estimate is None else dict(made.estimate),
            }
        )
        for note in made.notes:
            # The same remark of several frames differs in its numbers at most, and in what stands in parentheses.
            self._notes.setdefault(_NUMERAL.sub("", note), {})[frame.number] = note
        return frame

    def tell(self, console: Console, output: Path, video: Path | None) -> None:
        """Print the remarks and the result."""
        frames, count = self._frames, len(self._frames)
        for alike in self._notes.values():
            first, text = next(iter(alike.items()))
            told = f" ({len(alike)} of {count} frames, the first is {first})" if len(alike) < count else ""
            if len(set(alike.values())) > 1:
                told = f" (frame {first}; with other numbers {len(alike) - 1} more of {count} frames)"
            console.remark(text + told)
        if (line := film_in_words([one["estimate"] for one in frames])) is not None:
            console.remark(line)
        film = "" if video is None else f", {video}"
        seconds, resumed = sum(one["seconds"] for one in frames), sum(one["found"] for one in frames)
        before = f", {resumed} of them found" if resumed else ""
        console.result(
            {"output": str(output), "frames": frames, "video": None if video is None else str(video)},
            f"{frames[0]['output']} to {Path(frames[-1]['output']).name}{film}: "
            f"{count} frames{before}, {seconds:.1f} s",
        )


def _check(spec: SequenceOptions) -> None:
    """Refuse options of a film that go together with no film, or not with this one."""
    from lippmann.sequences.motion import FRAMES_PER_SECOND
    from lippmann.viewing.hololuminescent import RATES
    from lippmann.viewing.video_file import check_animation_path

    if (spec.camera_path is not None or spec.turns) and spec.fps is not None and spec.video is None:
        what = "a turn" if spec.turns else "a camera path"
        raise UsageError(f"{what} has one pose a frame", where="--fps", fix="leave it out, or add --video")
    if spec.fps is not None and not 0.001 <= spec.fps <= 1000:
        raise UsageError(f"{spec.fps:g} frames per second", where="--fps", rule="0.001 to 1000")
    if spec.eye is not None and spec.video is None:
        raise UsageError("nobody looks", where="--eye", fix="add --video FILE.mp4, or leave it out")
    if spec.video is not None:
        check_animation_path(spec.video, spec.codec)
    else:
        for option, given in (("--codec", spec.codec is not None), ("--shows", spec.shows != "eye")):
            if given:
                raise UsageError("there is no film", where=option, fix="add --video FILE.mp4, or leave it out")
    if spec.shows == "hololuminescent" and spec.fps not in RATES:
        raise UsageError(
            f"{spec.fps or FRAMES_PER_SECOND:g} frames per second",
            where="--fps",
            rule="the player of Hololuminescent displays takes 30 or 60",
            fix="add --fps 30",
        )


def open_moving(source: SceneSource, spec: SequenceOptions, request: RenderRequest) -> Motion:
    """Animation, camera flight or turntable that the options ask for."""
    if spec.turns:
        from lippmann.options.placement import PlacementOptions
        from lippmann.runtime import engine
        from lippmann.sequences.turntable import open_turntable

        # A scene of Mitsuba's tells its box only once the engine runs, and that on the device that was asked for.
        engine.start(request.device, request.threads)
        placement = request.placement if isinstance(request.placement, PlacementOptions) else None
        return open_turntable(source.load(), spec.turntable, swing=spec.swing, placement=placement)
    from lippmann.sequences.motion import open_motion

    return open_motion(
        source.name,
        fps=None if spec.camera_path is not None else spec.fps,
        animation=spec.animation,
        camera_path=spec.camera_path,
        asked=source.asked,
        light=source.light,
        allow_outside=source.access.allow_outside,
    )


def _filming(
    spec: SequenceOptions, motion: Motion, display: Display, request: RenderRequest, form: Form[Any] | None, count: int
) -> Filming | None:
    """The part of each frame that the film shows."""
    if spec.video is None:
        return None
    from lippmann.sequences.films import film_pictures, film_quilts
    from lippmann.sequences.forms import QuiltForm

    if isinstance(form, QuiltForm):
        return film_quilts(spec.video, display, form, _eye(spec.eye), count, spec.shows, spec.codec)
    eye = None if spec.eye is None else triple(spec.eye, "--eye")
    return film_pictures(spec.video, motion, display, request, eye, spec.shows, spec.codec)


def _eye(text: str | None) -> FilmEye:
    """The eye of a film of quilts."""
    if text is None or text == "sweep":
        return text  # type: ignore[return-value]
    x, y, z = triple(text, "--eye")
    if z <= 0.0:
        raise UsageError(f"an eye at z = {z:g}", where="--eye", rule="z is toward the viewer, above 0 mm")
    return x, y, z


def frame_range(text: str) -> FrameRange:
    """``FIRST:STOP[:STEP]``, parts of it left out, or one number.

    Raises
    ------
    UsageError
        It is none, or empty.
    """
    from lippmann.sequences.frames import FrameRange

    match = re.fullmatch(r"(\d{1,9})|(\d{0,9}):(\d{0,9})(?::(\d{1,9}))?", text.strip())
    if match is None:
        rule = "must be FIRST:STOP or FIRST:STOP:STEP, such as 0:48 for the frames 0 to 47"
        raise UsageError(f"'{text}'", where="--frames", rule=rule)
    if match[1]:
        return FrameRange(int(match[1]), int(match[1]) + 1)
    return FrameRange(int(match[2] or 0), int(match[3]) if match[3] else None, int(match[4] or 1))


def name_frames(output: Path, frames: int, ending: str = "") -> Callable[[int], Path]:
    """Path of each frame: ``output`` has one ``%d`` or ``%04d`` in its name, or is a folder.

    The stems of the files in a folder end in ``ending``.

    Raises
    ------
    OutputError
        It is neither, and there is more than one frame.
    """
    name = output.name
    if "%" in name:
        if len(_NUMBER.findall(name)) != 1 or "%" in _NUMBER.sub("", name):
            raise OutputError("the frames' numbers have no clear place", where=str(output), rule="one %d or %04d")
        return lambda number: output.with_name(_NUMBER.sub(lambda m: f"{number:0{m[1] or 1}}", name))
    if output.is_dir() or not output.suffix:
        return lambda number: output / f"{_FOLDER_PATTERN % number}{ending}.png"
    if frames == 1:
        return lambda number: output
    stem = output.stem.removesuffix(ending)
    from lippmann.image.encoding import FORMATS

    picture = output.suffix if output.suffix.lower() in FORMATS else ".png"
    fix = f"{stem}_%04d{ending}{picture}, a folder, or a film: {stem}{ending}.mp4"
    raise OutputError(f"this is one name for {frames} frames", where=str(output), fix=fix)


@contextmanager
def _places(output: Path, first: Path, video: Path | None) -> Iterator[None]:
    """Check that frames and film can be written. A folder that is made for them is removed again if it stays empty."""
    from lippmann.runtime.atomic_write import check_writable, output_error, undone

    is_new = first.parent == output and not output.is_dir()

    def remove_empty() -> None:
        if is_new:
            with suppress(OSError):  # it holds something
                output.rmdir()

    with undone(remove_empty):
        if is_new:
            try:
                output.mkdir()
            except OSError as error:
                raise output_error(output, error) from None
        check_writable(first)
        if video is not None:
            check_writable(video)
        yield
