"""Films of sequences, from the frames in their files: what an eye sees, native pixels, colour and depth, or quilts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from lippmann.codecs.rgbd_names import RgbdForm
from lippmann.codecs.types import Pixels
from lippmann.color.transfer import quantize
from lippmann.display import Display
from lippmann.errors import OutputError, UsageError
from lippmann.image.encoding import mirrored_in_file
from lippmann.image.read import read_picture
from lippmann.options.choices import REUSING
from lippmann.options.outputs import Shows
from lippmann.progress import silent
from lippmann.quilts.files import read_quilt
from lippmann.quilts.quilt import DeviceQuilt, Quilt, QuiltLayout, ending_of_name, layout_of_name, names_layout
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.placement import options_of_sequence
from lippmann.sequences.files import SavedFrame
from lippmann.sequences.forms import QuiltForm
from lippmann.sequences.frames import FramePlacements, give_seed, hold_exposure, place_frames
from lippmann.sequences.kept_scene import KeptScene
from lippmann.sequences.motion import Motion
from lippmann.viewing.color_and_depth import rgbd_codes
from lippmann.viewing.hololuminescent import HEIGHT, WIDTH, for_hololuminescent
from lippmann.viewing.mp4_film import Codec, codec_for, coded_size, most_pixels
from lippmann.viewing.replay import Eye, default_eye, default_size
from lippmann.viewing.video_file import codec_of_film
from lippmann.viewing.video_frames import (
    WIDEST_QUILT,
    layout_of_video,
    projection_of,
    quilt_of_video,
    view_of_quilt,
    view_size_of_video,
    view_toward,
)

#: Most pixels of a film's quilts, unless the display has more: a quilt takes as many rays as it has pixels.
_MOST_PIXELS = 1 << 21

#: An eye in the display frame in mm, or one that goes to and fro across the whole view cone once in a film.
FilmEye: TypeAlias = "Eye | Literal['sweep'] | None"


class Filming(NamedTuple):
    """How a film is made of the frames of a sequence.

    Attributes
    ----------
    codes:
        Codes ``(H, W, 3)`` of 8 bits of a frame as its file holds it.
    codec:
        Of the film; None where its format has none.
    quilt:
        The layout of a film of quilts.
    note:
        What the film does not show as it is in the files, in one line.
    has_depth:
        Whether depth lies beside colour.
    """

    codes: Callable[[SavedFrame], Pixels]
    codec: Codec | None
    quilt: QuiltLayout | None = None
    note: str | None = None
    has_depth: bool = False


def film_pictures(
    video: Path,
    motion: Motion,
    display: Display,
    request: RenderRequest,
    eye: Eye | None,
    shows: Shows = "eye",
    codec: Codec | None = None,
) -> Filming:
    """A film of integral images: what an eye sees of each by replay, their native pixels, or colour beside depth.

    A name with a quilt's layout asks for quilts. Those of a lenticular display are rendered by the quilt's own cameras,
    with the request and the placement of the sequence; those of other displays are replays.

    Raises
    ------
    OutputError, PictureError
        As :func:`lippmann.viewing.video_frames.layout_of_video`, or no encoder takes the size.
    UsageError
        An eye is given beside cameras that have places of their own, or beside native pixels; a film of depth is asked
        for, and the frames have none.
    """
    layout = layout_of_video(video)
    panel, size = display.panel, default_size(display)
    if layout is not None:
        _check_quilts(shows)
        if display.lens_array.layout == "lenticular":
            if eye is not None:
                raise UsageError(
                    "a quilt's cameras have places of their own",
                    parameter="eye",
                    rule="they stand across the display's view cone",
                    fix="leave it out",
                )
            cameras = QuiltCameras(motion, display, request, layout)
            size = (WIDEST_QUILT, WIDEST_QUILT)
            return Filming(
                lambda frame: quilt_of_video(cameras(frame.number)), codec_of_film(video, size, codec), layout
            )
    if shows == "native":
        if eye is not None:
            raise UsageError("native pixels are what no eye sees", parameter="eye", fix="leave it out")
        chosen = codec_of_film(video, (panel.width, panel.height), codec, exact=True)
        return Filming(lambda frame: _native(frame.path, display), chosen)
    if shows in ("rgbd", "rgbd-half"):
        if not request.layers:
            raise UsageError(
                "the frames have no depth",
                parameter="shows",
                rule="that is a layer, which OpenEXR keeps",
                fix="layers=True, and frames named %04d.exr",
            )
        form = RgbdForm(half=shows == "rgbd-half")
        place = place_frames(motion, display, options_of_sequence(request.placement))(0)
        z = default_eye(display)[2] if eye is None else eye[2]
        # The same in all frames: what the motion ever fills, as far as it lies in front of the eye.
        back, front = (min(edge, 0.9 * z) for edge in place.depth_range)
        chosen = codec_of_film(video, (size[0] * (1 if form.half else 2), size[1]), codec)
        return Filming(
            lambda frame: rgbd_codes(read_picture(frame.path), form, eye, between=(z - front, z - back)),
            chosen,
            has_depth=True,
        )
    projection = projection_of(video, eye)

    def see(frame: SavedFrame) -> Pixels:
        # The film shows what the files hold, whether they were rendered now or before an interruption.
        image = read_picture(frame.path)
        return quantize(projection(image), 8, image.provenance.transfer)

    return _film_eye(video, see, size if layout is None else (WIDEST_QUILT, WIDEST_QUILT), shows, codec, layout)


def film_quilts(
    video: Path,
    display: Display,
    form: QuiltForm,
    eye: FilmEye,
    count: int,
    shows: Shows = "eye",
    codec: Codec | None = None,
) -> Filming:
    """A film of quilts, of the pixels that their cameras rendered: one view of each, or with a quilt's name all views.

    Parameters
    ----------
    eye:
        The view whose camera is nearest is shown: the middle one, unless told. ``sweep``: the eye goes from the middle
        to the right, to the left and back in so many frames as there are.
    count:
        How many frames there are.
    shows:
        ``eye`` or ``hololuminescent``.

    Raises
    ------
    OutputError
        The name has no ending of an animation, or the layout of another quilt; no encoder takes the size.
    UsageError
        An eye is given beside a film of all views; quilts have no native pixels and no depth.
    """
    views = form.quilt.layout.views
    layout = layout_of_name(video) if form.quilt.pair and names_layout(video) else layout_of_video(video)
    if layout is not None:
        if layout[:2] != form.quilt.layout[:2] or (form.quilt.pair and ending_of_name(video) != form.quilt.pair):
            rule = f"the quilts end in {form.quilt.ending}"
            raise OutputError("the name says another quilt", where=str(video), rule=rule)
        if eye is not None:
            raise UsageError("a film of quilts shows all views", parameter="eye", fix="leave it out")
        _check_quilts(shows)
        size = form.quilt.width, form.quilt.height
        widest = most_pixels(codec_for(size, codec))
        chosen = codec_of_film(video, (min(size[0], widest), min(size[1], widest)), codec)
        if chosen is None:
            widest = max(size)
        view = size[0] // layout.columns, size[1] // layout.rows
        smaller = view_size_of_video(view, layout, widest)
        width, height = smaller[0] * layout.columns, smaller[1] * layout.rows
        if chosen is not None:
            width, height = coded_size((width, height), chosen, layout)
        note = None
        if (width, height) != size:
            rule = f"{chosen} takes sides of at most {widest}" if smaller != view else f"{chosen} takes even sides"
            note = f"the film's pictures are {width}x{height} pixels, smaller than {size[0]}x{size[1]}: {rule}"
        return Filming(lambda frame: quilt_of_video(_quilt(frame), widest), chosen, layout, note)
    if shows not in ("eye", "hololuminescent"):
        rule = "quilts have neither native pixels nor depth"
        raise UsageError(f"'{shows}' of quilts", parameter="shows", rule=rule, fix="use lippmann render")
    middle = view_toward(display, views, None if eye == "sweep" else eye)
    position = 0

    def see(frame: SavedFrame) -> Pixels:
        nonlocal position
        number = middle
        if eye == "sweep":
            number = math.floor((1.0 + math.sin(2.0 * math.pi * position / count)) / 2.0 * views)
            number = min(number, views - 1)
        position += 1
        quilt = _quilt(frame)
        return quantize(view_of_quilt(quilt, number), 8, quilt.provenance.transfer)

    return _film_eye(video, see, default_size(display), shows, codec)


def _film_eye(
    video: Path,
    see: Callable[[SavedFrame], Pixels],
    size: tuple[int, int],
    shows: Shows,
    codec: Codec | None,
    layout: QuiltLayout | None = None,
) -> Filming:
    """A film of what an eye sees, as it is or framed for a Hololuminescent display."""
    if shows == "hololuminescent":
        chosen = codec_of_film(video, (HEIGHT, WIDTH), codec or "hevc")
        return Filming(lambda frame: for_hololuminescent(see(frame)), chosen)
    return Filming(see, codec_of_film(video, size, codec), layout)


def _quilt(frame: SavedFrame) -> Quilt:
    return read_quilt(frame.path) if frame.quilt is None else frame.quilt


def _native(path: Path, display: Display) -> Pixels:
    image = read_picture(path)
    return np.ascontiguousarray(mirrored_in_file(image.srgb(), display))


def _check_quilts(shows: Shows) -> None:
    """Raise :class:`UsageError` if a film whose name says quilts is to show anything else."""
    if shows != "eye":
        raise UsageError(f"'{shows}' beside a name that says quilts", parameter="shows", fix="choose another name")


@dataclass
class QuiltCameras:
    """Quilts of a sequence whose files are integral images; called with a frame's number.

    The views are as wide as lets a quilt be :data:`~lippmann.viewing.video_frames.WIDEST_QUILT` wide and have two
    million pixels, or as many as the display.
    """

    motion: Motion
    display: Display
    request: RenderRequest
    layout: QuiltLayout
    _where: FramePlacements | None = field(default=None, init=False)
    _kept: KeptScene = field(default_factory=KeptScene, init=False)

    def __call__(self, frame: int) -> Quilt:
        where = self._begin() if self._where is None else self._where
        request = replace(give_seed(self.request, frame), placement=where(frame))
        return self._form().render(self.motion.scene(frame), self.display, request, silent, self._kept.build)

    def _begin(self) -> FramePlacements:
        """Find where the display stands, and what of the request a quilt can honour."""
        self._where = place_frames(self.motion, self.display, options_of_sequence(self.request.placement))
        held = hold_exposure(self.request, self.motion, self.display, self._where, self._kept.build)
        method = "full" if held.method in REUSING else held.method
        self.request = replace(held, method=method, order=None, respect_gloss=None, subpixels=False, layers=False)
        return self._where

    def _form(self) -> QuiltForm:
        panel, (columns, rows) = self.display.panel, self.layout[:2]
        most = max(panel.width * panel.height, _MOST_PIXELS) / (columns * rows)
        widest = min(WIDEST_QUILT // columns, int(math.sqrt(most * panel.width / panel.height)))
        width, height = default_size(self.display, widest)
        return QuiltForm(DeviceQuilt(self.display.name, width * columns, height * rows, self.layout))
