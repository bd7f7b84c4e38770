"""ICC profiles: sRGB's own, profiles of files, and codes converted from one to another (LittleCMS, through Pillow).

An empty profile stands for sRGB.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.types import Pixels
from lippmann.color.primaries import P3_D65, REC709, REC2020, xyz_from_rgb
from lippmann.color.transfer import decode_srgb
from lippmann.errors import PictureError
from lippmann.runtime.regular_file import check_kind, unreadable

if TYPE_CHECKING:
    from PIL import Image, ImageCms

#: Bytes of a profile's header that hold when it was made, and what stands there: the same picture is the same file.
_DATE, _MADE = slice(24, 36), struct.pack(">6H", 2000, 1, 1, 0, 0, 0)


#: Values that a curve is told by.
_CURVE = 4096
#: Chromaticities that differ by less are alike: PNG stores those of sRGB to 5 decimals, other programs to 2 or 3.
_ALIKE = 0.002

#: Primaries and white by code point of ITU-T H.273: Rec. 709, Rec. 601 (625 and 525 lines), Rec. 2020, P3 with the
#: white of cinemas and with D65.
_D65 = REC709[6:]
_REC601 = (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, *_D65)
_PRIMARIES = {
    1: REC709,
    5: (0.640, 0.330, 0.290, 0.600, 0.150, 0.060, *_D65),
    6: _REC601,
    7: _REC601,
    9: REC2020,
    11: (*P3_D65[:6], 0.314, 0.351),
    12: P3_D65,
}


def _rec709_curve(coded: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(coded < 0.081, coded / 4.5, ((coded + 0.099) / 1.099) ** (1.0 / 0.45))


#: Transfer functions whose values go beyond a display's.
_HDR = {16: "PQ", 18: "HLG"}
#: Linear values of coded ones, where the curve is not sRGB's: Rec. 709 and its kin, gamma 2.2 and 2.8, linear.
_CURVES: dict[int, Callable[[NDArray[np.float64]], NDArray[np.float64]]] = {
    1: _rec709_curve,
    4: lambda coded: coded**2.2,
    5: lambda coded: coded**2.8,
    6: _rec709_curve,
    8: lambda coded: coded,
    14: _rec709_curve,
    15: _rec709_curve,
}


#: Bytes of a profile's header that name its colour space, and of those that are converted the library's names and
#: their channels.
_SPACE, _KINDS = slice(16, 20), {b"RGB ": ("rgb", 3), b"GRAY": ("gray", 1)}


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
        raise unreadable(path, error, PictureError) from None
    try:
        colors = _open(data).profile.xcolor_space.strip()
    except OSError:
        colors = ""
    if colors != "RGB":
        what = f"is a profile of {colors}" if colors else "is no ICC profile"
        raise PictureError(what, where=str(path), rule="profiles are those of RGB devices")
    return Profile(name_of(data) or path.name, data)


def is_gray(data: bytes) -> bool:
    """Whether a profile is that of a grey device."""
    return data[_SPACE] == b"GRAY"


def name_of(data: bytes) -> str:
    """The name that a profile gives itself; empty if it gives none or is damaged."""
    from PIL import ImageCms

    try:
        return " ".join(ImageCms.getProfileDescription(_open(data)).split())
    except (ImageCms.PyCMSError, OSError):
        return ""


def rgb_profile(chromaticities: Sequence[float], curve: float | NDArray[np.float32] | None = None) -> bytes:
    """The profile of RGB with these primaries and this curve; empty if it is sRGB's, or the primaries mean nothing.

    Parameters
    ----------
    chromaticities:
        x and y of red, green, blue and white, eight numbers.
    curve:
        Linear values of codes: the exponent, or the values of evenly spaced ones. None: the curve of sRGB.
    """
    import imagecodecs

    if curve is None:
        curve = decode_srgb(np.linspace(0.0, 1.0, _CURVE)).astype(np.float32)
        if np.allclose(chromaticities, REC709, atol=_ALIKE):
            return b""
    places = [(x, y, 1.0) for x, y in zip(chromaticities[::2], chromaticities[1::2], strict=True)]
    form = {"gamma": curve} if isinstance(curve, float) else {"transferfunction": curve}
    try:
        xyz_from_rgb(chromaticities)
        primaries = [number for place in places[:3] for number in place]
        data = bytearray(imagecodecs.cms_profile("rgb", whitepoint=places[3], primaries=primaries, **form))
    except (RuntimeError, ValueError):
        return b""
    data[_DATE] = _MADE
    return bytes(data)


def profile_of_cicp(primaries: int, transfer: int) -> bytes:
    """The profile of code points of ITU-T H.273; empty for sRGB and unknown ones.

    Raises
    ------
    PictureError
        If the values go beyond a display's: PQ and HLG.
    """
    if transfer in _HDR:
        rule = "codes of a standard dynamic range are read"
        raise PictureError(f"its colours are {_HDR[transfer]}", rule=rule, fix="convert it to sRGB, or to OpenEXR")
    places, curve = _PRIMARIES.get(primaries, REC709), _CURVES.get(transfer)
    return rgb_profile(places, None if curve is None else curve(np.linspace(0.0, 1.0, _CURVE)).astype(np.float32))


@cache
def adobe_profile() -> bytes:
    """The profile of Adobe RGB (1998)."""
    return rgb_profile((0.64, 0.33, 0.21, 0.71, 0.15, 0.06, *_D65), 563.0 / 256.0)


def convert_cmyk(picture: Image.Image, icc: bytes) -> NDArray[np.uint8]:
    """sRGB codes ``(H, W, 3)`` of a CMYK picture, by its profile if that is one of CMYK."""
    if icc[_SPACE] == b"CMYK":
        from PIL import ImageCms

        try:
            converted = ImageCms.profileToProfile(picture, _open(icc), _open(b""), outputMode="RGB")
            assert converted is not None  # it is not done in place
            return np.asarray(converted)
        except (ImageCms.PyCMSError, OSError) as error:
            raise PictureError(f"its colours cannot be converted: {error}", fix="convert it to sRGB") from None
    return np.asarray(picture.convert("RGB"))


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
        converted = ImageCms.profileToProfile(picture, _open(source), _open(target), outputMode="RGB")
    except (ImageCms.PyCMSError, OSError) as error:
        rule = "profiles are those of RGB devices"
        raise PictureError(f"its colours cannot be converted: {error}", rule=rule) from None
    assert converted is not None  # it is not done in place
    return converted


def convert_codes(codes: Pixels, source: bytes, target: bytes = b"") -> Pixels:
    """Codes in the profile ``target``: themselves if both are the same, else RGB.

    Parameters
    ----------
    codes:
        ``(H, W, 1 or 3)`` grey or RGB, uint8 or uint16.
    source:
        Their profile. One of grey for RGB, and one that is neither, does not count (PNG, 11.3.2.3).

    Raises
    ------
    PictureError
        If a profile is damaged.
    """
    import imagecodecs

    space = source[_SPACE]
    if (source or srgb_profile()) == (target or srgb_profile()):
        return codes
    if space not in _KINDS or (space == b"GRAY" and codes.shape[2] == 3):
        return codes
    kind, channels = _KINDS[space]
    pixels = np.ascontiguousarray(np.broadcast_to(codes, (*codes.shape[:2], channels)))
    flat = pixels.reshape((1, -1, 3) if channels == 3 else (1, -1))
    try:
        target = target or srgb_profile()
        converted = imagecodecs.cms_transform(flat, source, target, colorspace=kind, outcolorspace="rgb")
    except (RuntimeError, ValueError) as error:
        raise PictureError(f"its colours cannot be converted: {error}", fix="convert it to sRGB") from None
    return np.asarray(converted).reshape(*codes.shape[:2], 3)


def _open(data: bytes) -> ImageCms.ImageCmsProfile:
    from PIL import ImageCms

    return ImageCms.ImageCmsProfile(io.BytesIO(data or srgb_profile()))
