"""Frames of a video from integral images: the picture that an eye sees, or a quilt of such pictures."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from lippmann.errors import OutputError
from lippmann.image import IntegralImage
from lippmann.image.stored_values import FloatArray
from lippmann.quilts.quilt import Quilt, QuiltLayout, layout_of_name
from lippmann.viewing.replay import Eye, default_eye, default_size, replay
from lippmann.viewing.video_file import check_animation_path

#: Limit on the width of a quilt in a video, in pixels: that of players and of common H.264 levels.
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
    check_animation_path(path)
    if "_qs" not in path.stem:
        return lambda image: replay(image, eye)
    layout = layout_of_name(path)
    if layout.columns > WIDEST_QUILT // 16:
        rule = f"a view of a quilt in a video has at least 16 of {WIDEST_QUILT} pixels"
        raise OutputError(f"{layout.columns} columns are too many", where=str(path), rule=rule)
    return lambda image: quilt_of(image, layout, eye).pixels


def quilt_of(image: IntegralImage, layout: QuiltLayout, eye: Eye | None = None) -> Quilt:
    """Quilt of replays from equally spaced eyes across the display's field of view.

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
    reach = 2 * z * math.tan(math.radians(image.display.field_of_view / 2))
    width, height = default_size(image.display, WIDEST_QUILT // layout.columns)
    quilt = Quilt(np.empty((height * layout.rows, width * layout.columns, 3), dtype=np.float32), layout)
    for number in range(layout.views):
        across = x + reach * ((number + 0.5) / layout.views - 0.5)
        quilt.view_values(number)[...] = replay(image, (across, y, z), size=(width, height))
    return quilt
