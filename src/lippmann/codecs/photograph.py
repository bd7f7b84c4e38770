"""Photographs and views of any format, as a viewer shows them: upright, in a known colour space."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from lippmann.codecs import orientation as orientations
from lippmann.codecs import png, tiff
from lippmann.codecs.avif_colors import code_points
from lippmann.codecs.claims import check_claim
from lippmann.codecs.icc import adobe_profile, convert_cmyk, convert_codes, is_gray, profile_of_cicp
from lippmann.codecs.picture_notes import aspect_note, pictures_note
from lippmann.codecs.pillow_formats import BYTES_PER_PIXEL, FORMATS, RULE, codes_of, open_picture
from lippmann.codecs.types import Pixels
from lippmann.errors import PictureError
from lippmann.runtime.machine import check_input
from lippmann.runtime.regular_file import unreadable

if TYPE_CHECKING:
    from PIL import Image

#: EXIF: the blocks of the camera and of interoperability, a colour space other than sRGB, and that of Adobe RGB.
_CAMERA, _INTEROP, _COLOR_SPACE, _UNCALIBRATED, _ADOBE = 0x8769, 0xA005, 0xA001, 0xFFFF, "R03"


@dataclass(frozen=True, eq=False)
class Photograph:
    """An open picture.

    Attributes
    ----------
    size:
        Width and height in pixels, upright.
    icc:
        ICC profile of its codes as RGB; empty: sRGB.
    orientation:
        How it was turned, 1 to 8; 1 for none.
    notes:
        What of it is not shown, each in one line.
    """

    size: tuple[int, int]
    icc: bytes
    orientation: int
    notes: tuple[str, ...]
    _decode: Callable[[], Pixels]

    @staticmethod
    def of_codes(codes: Pixels, icc: bytes, notes: tuple[str, ...] = ()) -> Photograph:
        """An upright picture of decoded codes."""
        return Photograph((codes.shape[1], codes.shape[0]), icc, 1, notes, lambda: codes)

    @staticmethod
    def of_frame(picture: Image.Image, number: int, notes: tuple[str, ...] = ()) -> Photograph:
        """Picture ``number`` of an open file of several, from 0 on, decoded and upright."""
        picture.seek(number)
        codes = orientations.upright(codes_of(picture), orientations.of_picture(picture))
        return Photograph.of_codes(codes, picture.info.get("icc_profile") or b"", notes)

    def codes(self) -> Pixels:
        """Codes ``(H, W, 1 to 4)``, uint8 or uint16: grey or RGB, with or without alpha. Float TIFF gives floats."""
        return self._decode()

    def srgb_codes(self) -> Pixels:
        """:meth:`codes` in sRGB.

        Raises
        ------
        PictureError
            If the profile is damaged.
        """
        return _in_srgb(self._decode(), self.icc)


@contextmanager
def open_photograph(file: BinaryIO, path: Path, formats: tuple[str, ...] = (*FORMATS,)) -> Iterator[Photograph]:
    """The picture of an open file, not yet decoded; ``path`` is its name, for errors.

    ``formats`` are names of :data:`lippmann.codecs.pillow_formats.FORMATS`.

    Raises
    ------
    PictureError
        If a PNG or TIFF is damaged or of a kind that is not read.
    PIL.UnidentifiedImageError, OSError, SyntaxError
        As :func:`lippmann.codecs.pillow_formats.open_picture` of other formats.
    MemoryLimitError
        If its pixels take more than the memory that is left.
    """
    start = file.read(8)
    length = file.seek(0, 2)
    file.seek(0)
    if start == png.SIGNATURE and "PNG" in formats:
        header = png.png_header(file, path)
        size = header.width, header.height
        check_claim(size, header.bits * header.channels, length, path)
        # As much as of other formats: what follows makes colours of greys.
        check_input(BYTES_PER_PIXEL * size[0] * size[1], f"a picture of {size[0]} x {size[1]} pixels", where=str(path))
        yield _photograph(
            size, header.icc, header.orientation, header.notes, lambda: _planes(png.decode_png(file, header, path))
        )
    elif start.startswith(tiff.SIGNATURES) and "TIFF" in formats:
        page = tiff.TiffPicture(file, path)
        size = page.width, page.height
        check_claim(size, page.bits, length, path)
        yield _photograph(size, page.icc, page.orientation, page.notes, page.read)
    else:
        with open_picture(file, formats) as picture:
            turn = orientations.of_picture(picture)
            size = picture.size[::-1] if orientations.lies(turn) else picture.size
            icc = picture.info.get("icc_profile") or _other_profile(picture, file, path)
            notes = aspect_note(*_density(picture)) + pictures_note(getattr(picture, "n_frames", 1))
            if picture.mode == "CMYK":
                yield _photograph(
                    size, b"", turn, notes, lambda: orientations.upright(convert_cmyk(picture, icc), turn)
                )
            else:
                yield _photograph(size, icc, turn, notes, lambda: orientations.upright(codes_of(picture), turn))


@contextmanager
def report_errors(path: Path) -> Iterator[None]:
    """Errors of opening and decoding a photograph as :class:`PictureError` that names ``path``."""
    from PIL import UnidentifiedImageError

    try:
        yield
    except UnidentifiedImageError:
        raise PictureError("is no picture that is read here", where=str(path), rule=RULE) from None
    except OSError as error:
        raise unreadable(path, error, PictureError) from None
    except (SyntaxError, ValueError, RuntimeError, EOFError) as error:  # the last two of AVIF's and HEIF's decoders
        raise PictureError(f"cannot be read ({error})", where=str(path)) from None


def _photograph(
    size: tuple[int, int], icc: bytes, orientation: int, notes: tuple[str, ...], decode: Callable[[], Pixels]
) -> Photograph:
    """The photograph with a profile of RGB: greys with one of their own become sRGB."""
    if is_gray(icc):
        return Photograph(size, b"", orientation, notes, lambda: _in_srgb(decode(), icc))
    return Photograph(size, icc, orientation, notes, decode)


def _in_srgb(codes: Pixels, icc: bytes) -> Pixels:
    if not icc or codes.dtype.kind == "f":
        return codes
    colors = codes.shape[2] - (codes.shape[2] + 1) % 2
    return np.concatenate([convert_codes(codes[..., :colors], icc), codes[..., colors:]], axis=2)


def _density(picture: Image.Image) -> tuple[float, float]:
    """Pixels per length across and down, of whatever unit; 0 where nothing is said."""
    across, down = picture.info.get("jfif_density") or picture.info.get("dpi") or (0, 0)
    return float(across), float(down)


def _other_profile(picture: Image.Image, file: BinaryIO, path: Path) -> bytes:
    """The profile of a picture without an ICC profile: of AVIF by its code points, of others by EXIF."""
    if picture.format != "AVIF":
        return _exif_profile(picture)
    cicp = code_points(file)
    try:
        return b"" if cicp is None else profile_of_cicp(*cicp)
    except PictureError as error:
        raise PictureError(error.what, where=str(path), rule=error.rule, fix=error.fix) from None


def _exif_profile(picture: Image.Image) -> bytes:
    """The profile of Adobe RGB where a camera says so, after DCF 2.0; empty otherwise."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of damage
            exif = picture.getexif()
            camera = exif.get_ifd(_CAMERA)
            says_so = camera.get(_COLOR_SPACE) == _UNCALIBRATED and exif.get_ifd(_INTEROP).get(1) == _ADOBE
    except (SyntaxError, ValueError, TypeError, LookupError, OSError, struct.error):
        return b""
    return adobe_profile() if says_so else b""


def _planes(codes: Pixels) -> Pixels:
    return codes[..., None] if codes.ndim == 2 else codes
