"""Which way up a picture is shown: the tag Orientation of TIFF 6.0 and EXIF, 1 to 8."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from lippmann.codecs.types import Pixels

if TYPE_CHECKING:
    from PIL import Image

#: Number of the tag.
TAG = 0x112

#: Steps down the rows and across the columns that show orientations 1 to 4, and 5 to 8 after rows became columns.
_STEPS = ((1, 1), (1, -1), (-1, -1), (-1, 1))


def upright(values: Pixels, orientation: int) -> Pixels:
    """``(H, W, ...)`` stored values as they are shown; itself for orientation 1 and unknown ones."""
    if not 2 <= orientation <= 8:
        return values
    down, across = _STEPS[(orientation - 1) % 4]
    values = values.swapaxes(0, 1) if lies(orientation) else values
    return np.ascontiguousarray(values[::down, ::across])


def as_stored(values: Pixels, orientation: int) -> Pixels:
    """Values as they are stored of values that are upright."""
    return upright(values, {6: 8, 8: 6}.get(orientation, orientation))


def lies(orientation: int) -> bool:
    """Whether stored rows are shown as columns."""
    return 5 <= orientation <= 8


def of_exif(data: bytes) -> int:
    """The orientation in a block of EXIF; 1 where it says none or is damaged."""
    from PIL import Image

    exif = Image.Exif()

    def load() -> Image.Exif:
        exif.load(data)
        return exif

    return _orientation(load)


def of_picture(picture: Image.Image) -> int:
    """The orientation of an open picture. Pillow turns a TIFF itself when it decodes it; then it is 1."""
    return _orientation(picture.getexif)


def _orientation(exif: Callable[[], Image.Exif]) -> int:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of damage
            value = exif().get(TAG)
    except (SyntaxError, ValueError, TypeError, LookupError, OSError, struct.error):
        return 1
    return value if isinstance(value, int) and 1 <= value <= 8 else 1
