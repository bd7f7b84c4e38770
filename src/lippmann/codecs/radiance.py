"""Radiance pictures (``.hdr``, ``.pic``): shared-exponent RGB or XYZ.

Runs of bytes are decoded by imagecodecs. The header is read here, from "Radiance File Formats" (G. Ward, Radiance 4.2):
imagecodecs 2026.3.6 ignores its variables, takes XYZ for RGB and knows one order of lines.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.color.primaries import rec709_from_rgb, to_rec709, xyz_from_rgb
from lippmann.errors import PictureError
from lippmann.runtime.machine import check_input

MAGICS = (b"#?RADIANCE", b"#?RGBE")

#: Pixels whose sides differ by no more than this share are square.
_SQUARE = 0.01
#: "-Y 512 +X 1024": lines from the top, each from the left. The first axis is that of the lines.
_SIZE = re.compile(rb"([-+])([XY]) +([0-9]{1,9}) +([-+])([XY]) +([0-9]{1,9})[ \t\r]*\n")
#: A byte of a file holds less than so many pixels: at best four bytes repeat a pixel 255 times.
_PIXELS_PER_BYTE = 64
#: How lines begin whose channels lie apart, in runs of bytes. Others have pixels, and runs of these.
_NEW_RUNS = b"\2\2"
#: Primaries and white of files that name none; such RGB is taken as that of Rec. 709, as all programs take it.
_PRIMARIES = (0.640, 0.330, 0.290, 0.600, 0.150, 0.060, 1.0 / 3.0, 1.0 / 3.0)


@dataclass(frozen=True)
class RadianceHeader:
    """The header of a Radiance picture.

    Attributes
    ----------
    width, height:
        Pixels of the upright picture.
    xyz:
        Whether its values are XYZ, not RGB.
    exposure:
        Factor ``(3,)`` that its values were multiplied by (all EXPOSURE and COLORCORR lines).
    primaries:
        Chromaticities of its red, green, blue and white; None for the format's own.
    start:
        Where its scan lines begin.
    """

    width: int
    height: int
    xyz: bool
    exposure: tuple[float, float, float]
    primaries: tuple[float, ...] | None
    start: int
    by_columns: bool
    flips: tuple[bool, bool]


def read_header(data: bytes, where: str) -> RadianceHeader:
    """The header of a Radiance picture.

    Raises
    ------
    PictureError
        It ends early, a variable holds no numbers, or the size is none.
    """
    end = re.search(rb"\n\r?\n", data)
    size = _SIZE.match(data, end.end()) if end else None
    if end is None or size is None or size[2] == size[5]:
        raise _undecodable("it does not say its size", where)
    exposure, xyz, primaries = np.ones(3), False, None
    for line in data[: end.start()].split(b"\n"):
        name, _, value = line.decode("latin-1").partition("=")
        if name == "FORMAT":
            xyz = value.strip() == "32-bit_rle_xyze"
        elif name in ("EXPOSURE", "COLORCORR"):
            exposure = exposure * _numbers(name, value, 1 if name == "EXPOSURE" else 3, where)
        elif name == "PIXASPECT" and abs(float(_numbers(name, value, 1, where)[0]) - 1.0) > _SQUARE:
            raise _undecodable(f"its pixels are not square: PIXASPECT is {value.strip()}", where)
        elif name == "PRIMARIES":
            given = _numbers(name, value, 8, where)
            primaries = tuple(given.tolist()) if given.any() else None  # zeros stand for none, as in USD's own sky
    if not (np.isfinite(exposure).all() and (exposure > 0.0).all()):
        raise _undecodable("its exposure must be above 0", where)
    first, second = int(size[3]), int(size[6])
    by_columns = size[2] == b"X"
    return RadianceHeader(
        width=first if by_columns else second,
        height=second if by_columns else first,
        xyz=xyz,
        exposure=(float(exposure[0]), float(exposure[1]), float(exposure[2])),
        primaries=primaries,
        start=size.end(),
        by_columns=by_columns,
        # -Y runs down from the top, +X to the right: the order of rows and columns here.
        flips=tuple(size[1 + 3 * axis] == (b"-" if size[2 + 3 * axis] == b"X" else b"+") for axis in (0, 1)),  # type: ignore[arg-type]
    )


def read_radiance(data: bytes, header: RadianceHeader, where: str) -> NDArray[np.float32]:
    """Linear RGB ``(height, width, 3)`` of Rec. 709, row 0 on top, in the units before exposure.

    Raises
    ------
    PictureError
        The scan lines are cut short or damaged, or the primaries mean nothing.
    MemoryLimitError
        The picture takes more memory than is left.
    """
    import imagecodecs

    if header.height * header.width > _PIXELS_PER_BYTE * len(data):
        raise _undecodable(f"{len(data)} bytes hold no {header.width}x{header.height} pixels", where)
    check_input(32 * header.height * header.width, "its picture", where=where)
    lines, length = (header.width, header.height) if header.by_columns else (header.height, header.width)
    plain = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {lines} +X {length}\n".encode()
    body = data[header.start :]
    if not (8 <= length < 1 << 15 and body[:2] == _NEW_RUNS):
        body = _without_old_runs(body, lines * length)
    try:
        pixels = np.asarray(imagecodecs.rgbe_decode(plain + body), np.float32)
        matrix = _matrix(header)
    except (RuntimeError, ValueError) as error:
        raise _undecodable(str(error), where) from None
    pixels = pixels[tuple(slice(None, None, -1 if flip else 1) for flip in header.flips)]
    if header.by_columns:
        pixels = pixels.transpose(1, 0, 2)
    if matrix is not None:
        pixels = to_rec709(pixels, matrix)
    return np.ascontiguousarray(pixels / np.asarray(header.exposure, np.float32))


def _without_old_runs(body: bytes, count: int) -> bytes:
    """Scan lines without runs: 1, 1, 1, n repeats the pixel before n times, and if others follow, 256 n times, ...

    The result has at most ``count`` pixels.
    """
    codes = np.frombuffer(body, np.uint8, len(body) // 4 * 4).reshape(-1, 4)
    is_run = (codes[:, :3] == 1).all(axis=1)
    if not is_run.any() or is_run[0]:
        return body
    places = np.arange(len(codes))
    last = np.maximum.accumulate(np.where(is_run, 0, places))
    shifts = np.minimum(8 * (places - last - 1), 40)  # beyond, any number is more than a picture has
    repeats = np.where(is_run, codes[:, 3].astype(np.int64) << np.maximum(shifts, 0), 1)
    repeats = np.diff(np.minimum(np.cumsum(np.minimum(repeats, count)), count), prepend=0)
    return np.repeat(codes[last], repeats, axis=0).tobytes()


def _matrix(header: RadianceHeader) -> NDArray[np.float64] | None:
    if header.xyz:
        return np.asarray(np.linalg.inv(xyz_from_rgb(_PRIMARIES)))
    if header.primaries is None or np.allclose(header.primaries, _PRIMARIES, atol=1e-3):
        return None
    return rec709_from_rgb(header.primaries)


def _numbers(name: str, value: str, count: int, where: str) -> NDArray[np.float64]:
    try:
        numbers = np.array([float(word) for word in value.split()])
    except ValueError:
        numbers = np.zeros(0)
    if len(numbers) != count:
        raise _undecodable(f"{name} is '{value.strip()[:60]}', not {count} number(s)", where)
    return numbers


def _undecodable(why: str, where: str) -> PictureError:
    return PictureError(f"cannot be decoded ({why})", where=where, fix="is it cut short?")
