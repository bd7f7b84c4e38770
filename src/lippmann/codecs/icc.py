"""ICC profiles: sRGB's own, profiles of files, and codes converted from one to another (LittleCMS, through Pillow).

An empty profile stands for sRGB.
"""

from __future__ import annotations

import io
import struct
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import PictureError
from lippmann.runtime.regular_file import check_kind

if TYPE_CHECKING:
    from PIL import Image, ImageCms

#: Bytes of a profile's header that hold when it was made, and what stands there: the same picture is the same file.
_DATE, _MADE = slice(24, 36), struct.pack(">6H", 2000, 1, 1, 0, 0, 0)


class Profile(NamedTuple):
    """A profile's name and its bytes."""

    name: str
    data: bytes


@cache
def srgb_profile() -> bytes:
    """The profile of sRGB."""
    from PIL import ImageCms

    data = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    data[_DATE] = _MADE
    return bytes(data)


def read_profile(path: Path) -> Profile:
    """The profile in a file.

    Raises
    ------
    PictureError
        If it cannot be read, or is no profile of an RGB device.
    """
    check_kind(path, PictureError)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise PictureError(f"cannot be read: {error.strerror}", where=str(path)) from None
    try:
        colors = _opened(data).profile.xcolor_space.strip()
    except OSError:
        colors = ""
    if colors != "RGB":
        what = f"is a profile of {colors}" if colors else "is no ICC profile"
        raise PictureError(what, where=str(path), rule="profiles are those of RGB devices")
    return Profile(name_of(data) or path.name, data)


def name_of(data: bytes) -> str:
    """The name that a profile gives itself; empty if it gives none or is damaged."""
    from PIL import ImageCms

    try:
        return " ".join(ImageCms.getProfileDescription(_opened(data)).split())
    except (ImageCms.PyCMSError, OSError):
        return ""


def convert_picture(picture: Image.Image, source: bytes, target: bytes) -> Image.Image:
    """An RGB picture in the profile ``target``; itself if both are the same.

    Raises
    ------
    PictureError
        If a profile cannot be used.
    """
    if (source or srgb_profile()) == (target or srgb_profile()):
        return picture
    from PIL import ImageCms

    try:
        converted = ImageCms.profileToProfile(picture, _opened(source), _opened(target), outputMode="RGB")
    except (ImageCms.PyCMSError, OSError) as error:
        rule = "profiles are those of RGB devices"
        raise PictureError(f"its colours cannot be converted: {error}", rule=rule) from None
    assert converted is not None  # it is not done in place
    return converted


def convert_codes(codes: NDArray[np.uint8], source: bytes, target: bytes) -> NDArray[np.uint8]:
    """``(H, W, 3)`` codes in the profile ``target``; raises as :func:`convert_picture`."""
    from PIL import Image

    return np.asarray(convert_picture(Image.fromarray(codes), source, target))


def _opened(data: bytes) -> ImageCms.ImageCmsProfile:
    from PIL import ImageCms

    return ImageCms.ImageCmsProfile(io.BytesIO(data or srgb_profile()))
