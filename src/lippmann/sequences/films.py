"""Films of sequences, from the frames in their files: what an eye sees of integral images, or views of quilts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias

from lippmann.color.transfer import Transfer
from lippmann.display import Display
from lippmann.errors import OutputError, UsageError
from lippmann.image.stored_values import FloatArray
from lippmann.options.choices import REUSING
from lippmann.progress import silent
from lippmann.quilts.quilt import DeviceQuilt, Quilt, QuiltLayout, ending_of_name, layout_of_name, names_layout
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.placement import options_of_sequence
from lippmann.sequences.files import SavedFrame
from lippmann.sequences.forms import INTEGRAL, QuiltForm
from lippmann.sequences.frames import Stand, find_stand, hold_exposure, of_frame
from lippmann.sequences.motion import Motion
from lippmann.viewing.replay import Eye, default_size
from lippmann.viewing.video_frames import (
    WIDEST_QUILT,
    layout_of_video,
    projection_of,
    quilt_of_video,
    view_of_quilt,
    view_toward,
)

#: Most pixels of a film's quilts, unless the display has more: a quilt takes as many rays as it has pixels.
_MOST_PIXELS = 1 << 21

#: An eye in the display frame in mm, or one that goes to and fro across the whole view cone once in a film.
FilmEye: TypeAlias = "Eye | Literal['sweep'] | None"


class Shot(NamedTuple):
    """A frame of a film: ``(height, width, 3)`` linear RGB, and the transfer function of its codes."""

    pixels: FloatArray
    transfer: Transfer


#: Makes a film's frame of a sequence's.
Filming: TypeAlias = "Callable[[SavedFrame], Shot]"


def film_of_pictures(video: Path, motion: Motion, display: Display, request: RenderRequest, eye: Eye | None) -> Filming:
    """A film of integral images: what an eye sees of each, by replay.

    A name with a quilt's layout asks for quilts. Those of a lenticular display are rendered by the quilt's own cameras,
    with the request and the placement of the sequence; those of other displays are replays.

    Raises
    ------
    OutputError, PictureError
        As :func:`lippmann.viewing.video_frames.layout_of_video`.
    UsageError
        An eye is given beside cameras that have places of their own.
    """
    layout = layout_of_video(video)
    if layout is not None and display.lens_array.layout == "lenticular":
        if eye is not None:
            raise UsageError(
                "a quilt's cameras have places of their own",
                parameter="eye",
                rule="they stand across the display's view cone",
                fix="leave it out",
            )
        cameras = QuiltCameras(motion, display, request, layout)
        return lambda frame: _shot(cameras(frame.number), quilt_of_video)
    projection = projection_of(video, eye)

    def film(frame: SavedFrame) -> Shot:
        # The film shows what the files hold, whether they were rendered now or before an interruption.
        image = INTEGRAL.read(frame.path)
        return Shot(projection(image), image.provenance.transfer)

    return film


def film_of_quilts(video: Path, display: Display, form: QuiltForm, eye: FilmEye, count: int) -> Filming:
    """A film of quilts, of the pixels that their cameras rendered: one view of each, or with a quilt's name all views.

    Parameters
    ----------
    eye:
        The view whose camera is nearest is shown: the middle one, unless told. ``sweep``: the eye goes from the middle
        to the right, to the left and back in so many frames as there are.
    count:
        How many frames there are.

    Raises
    ------
    OutputError
        The name has no ending of an animation, or the layout of another quilt.
    UsageError
        An eye is given beside a film of all views.
    """
    views = form.quilt.layout.views
    layout = layout_of_name(video) if form.quilt.pair and names_layout(video) else layout_of_video(video)
    if layout is not None:
        if layout[:2] != form.quilt.layout[:2] or (form.quilt.pair and ending_of_name(video) != form.quilt.pair):
            rule = f"the quilts end in {form.quilt.ending}"
            raise OutputError("the name says another quilt", where=str(video), rule=rule)
        if eye is not None:
            raise UsageError("a film of quilts shows all views", parameter="eye", fix="leave it out")
        return lambda frame: _shot(form.read(frame.path), quilt_of_video)
    middle = view_toward(display, views, None if eye == "sweep" else eye)
    shown = 0

    def film(frame: SavedFrame) -> Shot:
        nonlocal shown
        number = middle
        if eye == "sweep":
            number = math.floor((1.0 + math.sin(2.0 * math.pi * shown / count)) / 2.0 * views)
            number = min(number, views - 1)
        shown += 1
        return _shot(form.read(frame.path), lambda quilt: view_of_quilt(quilt, number))

    return film


def _shot(quilt: Quilt, show: Callable[[Quilt], FloatArray]) -> Shot:
    return Shot(show(quilt), quilt.provenance.transfer)


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
    _where: Stand | None = field(default=None, init=False)

    def __call__(self, frame: int) -> Quilt:
        where = self._begin() if self._where is None else self._where
        request = replace(of_frame(self.request, frame), placement=where(frame))
        return self._form().render(self.motion.scene(frame), self.display, request, silent)

    def _begin(self) -> Stand:
        """Find where the display stands, and what of the request a quilt can honour."""
        self._where = find_stand(self.motion, self.display, options_of_sequence(self.request.placement))
        held = hold_exposure(self.request, self.motion, self.display, self._where)
        method = "full" if held.method in REUSING else held.method
        self.request = replace(held, method=method, order=None, respect_gloss=None, subpixels=False, layers=False)
        return self._where

    def _form(self) -> QuiltForm:
        panel, (columns, rows) = self.display.panel, self.layout[:2]
        most = max(panel.width * panel.height, _MOST_PIXELS) / (columns * rows)
        widest = min(WIDEST_QUILT // columns, int(math.sqrt(most * panel.width / panel.height)))
        width, height = default_size(self.display, widest)
        return QuiltForm(DeviceQuilt(self.display.name, width * columns, height * rows, self.layout))
