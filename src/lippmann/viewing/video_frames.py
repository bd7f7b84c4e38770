"""Frames of a video: what an eye sees of an integral image, a view of a quilt, or a whole quilt."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from lippmann.codecs.types import Pixels
from lippmann.color.transfer import quantize
from lippmann.display import Display
from lippmann.display.view_cone import cone_tangent
from lippmann.errors import OutputError
from lippmann.image import IntegralImage
from lippmann.image.stored_values import FloatArray
from lippmann.quilts.quilt import Quilt, QuiltLayout, layout_of_name
from lippmann.viewing.replay import DEFAULT_WIDTH, Eye, default_eye, default_size, replay
from lippmann.viewing.video_file import check_animation_path

#: Limit on the width of a quilt that is made for a video alone, in pixels: that of players of H.264.
WIDEST_QUILT = 4096

Projection = Callable[[IntegralImage], FloatArray]


def projection_of(path: Path, eye: Eye | None = None) -> Projection:
    """The function that makes a video's frame of an integral image: a quilt or a replay.

    Parameters
    ----------
    path:
        The video. A name with a quilt's layout (``_qs8x6a0.75``) asks for quilts.
    eye:
        Position ``(x, y, z)`` of the eye in the display frame in mm; for a quilt, of the central one. None: the centre
        of the viewing zone.

    Raises
    ------
    OutputError
        If the name has no ending of an animation, or the quilt has too many columns.
    PictureError
        If the name's layout is out of range.
    """
    layout = layout_of_video(path)
    if layout is None:
        return lambda image: replay(image, eye)
    return lambda image: quilt_of(image, layout, eye).pixels


def layout_of_video(path: Path) -> QuiltLayout | None:
    """The layout of the quilts that a video's name asks for; None for single views.

    Raises
    ------
    OutputError
        If the name has no ending of an animation, or the quilt has too many columns.
    PictureError
        If the name's layout is out of range.
    """
    check_animation_path(path)
    if "_qs" not in path.stem:
        return None
    layout = layout_of_name(path, to_write=True)
    if layout.columns > WIDEST_QUILT // 16:
        rule = f"a view of a quilt in a video has at least 16 of {WIDEST_QUILT} pixels"
        raise OutputError(f"{layout.columns} columns are too many", where=str(path), rule=rule)
    return layout


def view_toward(display: Display, views: int, eye: Eye | None = None) -> int:
    """The number of the view, of so many across a lenticular display's cone, whose camera is nearest to an eye.

    Parameters
    ----------
    eye:
        Position ``(x, y, z)`` in the display frame in mm; only its direction sideways counts. None: the middle.
    """
    slope = 0.0 if eye is None else eye[0] / eye[2]
    share = (slope / cone_tangent(display) + 1.0) / 2.0
    return min(max(math.floor(share * views), 0), views - 1)


def view_of_quilt(quilt: Quilt, number: int) -> FloatArray:
    """A view ``(height, width, 3)`` of a quilt in linear light, in the proportions in which it is displayed.

    Views of other proportions lose pixels along one side. The width is at most
    :data:`~lippmann.viewing.replay.DEFAULT_WIDTH`.
    """
    width, height = quilt.view_size
    aspect = quilt.layout.aspect or width / height
    view_width = min(width, height * aspect, DEFAULT_WIDTH)
    return _resize(quilt.view(number), max(1, round(view_width)), max(1, round(view_width / aspect)))


def quilt_of_video(quilt: Quilt, widest: int = WIDEST_QUILT) -> Pixels:
    """Codes of the views of a quilt side by side, at most ``widest`` pixels wide and high, of 8 bits."""
    (width, height), (columns, rows) = quilt.view_size, quilt.layout[:2]
    size = view_size_of_video(quilt.view_size, quilt.layout, widest)
    if size == quilt.view_size and quilt.values.dtype == np.uint8:
        return quilt.values[quilt.size[1] - rows * height :, : columns * width].astype(np.uint8, copy=False)
    small = Quilt(np.empty((size[1] * rows, size[0] * columns, 3), dtype=np.uint8), quilt.layout)
    for number in range(quilt.layout.views):
        small.view_values(number)[...] = quantize(_resize(quilt.view(number), *size), 8, quilt.provenance.transfer)
    return small.values.astype(np.uint8, copy=False)


def view_size_of_video(view: tuple[int, int], layout: QuiltLayout, widest: int) -> tuple[int, int]:
    """Width and height of the views of a quilt at most ``widest`` pixels wide and high, in proportion to ``view``'s."""
    width, height = view
    shrink = min(1.0, widest / (layout.columns * width), widest / (layout.rows * height))
    return max(1, int(width * shrink)), max(1, int(height * shrink))


def _resize(pixels: FloatArray, width: int, height: int) -> FloatArray:
    """Linear RGB in another size: each pixel the mean of what it covers."""
    from PIL import Image

    if pixels.shape[:2] == (height, width):
        return pixels
    planes = [
        np.asarray(Image.fromarray(pixels[..., channel]).resize((width, height), Image.Resampling.BOX), np.float32)
        for channel in range(3)
    ]
    return np.stack(planes, axis=-1)


def quilt_of(image: IntegralImage, layout: QuiltLayout, eye: Eye | None = None) -> Quilt:
    """Quilt of replays from equally spaced eyes on a level line across the display's view cone.

    Parameters
    ----------
    image:
        The native picture.
    layout:
        Columns and rows of the quilt. Views have the panel's proportions; the quilt is at most :data:`WIDEST_QUILT`
        wide.
    eye:
        Position ``(x, y, z)`` of the central eye in the display frame in mm. None: the centre of the viewing zone.
    """
    x, y, z = default_eye(image.display) if eye is None else eye
    reach = 2 * z * cone_tangent(image.display)
    width, height = default_size(image.display, WIDEST_QUILT // layout.columns)
    quilt = Quilt(np.empty((height * layout.rows, width * layout.columns, 3), dtype=np.float32), layout)
    for number in range(layout.views):
        across = x + reach * ((number + 0.5) / layout.views - 0.5)
        quilt.view_values(number)[...] = replay(image, (across, y, z), size=(width, height))
    return quilt
