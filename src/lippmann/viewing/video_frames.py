"""What a film shows of integral images: what an eye sees, or a quilt of what many eyes see."""

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

#: Widest quilt of a film in pixels: what players and H.264's usual levels still take.
WIDEST_QUILT = 4096

Projection = Callable[[IntegralImage], FloatArray]


def projection_of(path: Path, eye: Eye | None = None) -> Projection:
    """What a film called ``path`` shows of a picture: a quilt if its name says so (``_qs8x6a0.75``), else a replay.

    Parameters
    ----------
    eye:
        Where the eye is (mm, display frame); of a quilt, the middle one. None: where the display is made to be seen
        from.

    Raises
    ------
    OutputError, PictureError
        The ending is no film's, or the name's layout is impossible.
    """
    check_animation_path(path)
    if "_qs" not in path.stem:
        return lambda image: replay(image, eye)
    layout = layout_of_name(path)
    if layout.columns > WIDEST_QUILT // 16:
        raise OutputError(f"{layout.columns} columns are too many", where=str(path), rule="a view is 16 pixels or more")
    return lambda image: quilt_of(image, layout, eye).pixels


def quilt_of(image: IntegralImage, layout: QuiltLayout, eye: Eye | None = None) -> Quilt:
    """Replays from evenly spaced places across the display's field, the leftmost at the bottom left.

    Views have the panel's proportions, and the size at which the quilt is no wider than :data:`WIDEST_QUILT`.
    """
    x, y, z = default_eye(image.display) if eye is None else eye
    reach = 2 * z * math.tan(math.radians(image.display.field_of_view / 2))
    width, height = default_size(image.display, WIDEST_QUILT // layout.columns)
    quilt = Quilt(np.empty((height * layout.rows, width * layout.columns, 3), dtype=np.float32), layout)
    for number in range(layout.views):
        across = x + reach * ((number + 0.5) / layout.views - 0.5)
        quilt.view_values(number)[...] = replay(image, (across, y, z), size=(width, height))
    return quilt
