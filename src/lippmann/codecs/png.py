"""PNG with 8 or 16 bits per channel, its text and its resolution.

Pillow neither writes nor reads 16-bit colour, so the pixels go through libpng (``imagecodecs``) and the chunks that
carry text and resolution are written and read here, after the PNG specification (W3C, third edition, sections 5, 11).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from lippmann.codecs import orientation as orientations
from lippmann.codecs.icc import profile_of_cicp, rgb_profile
from lippmann.codecs.picture_notes import aspect_note, pictures_note
from lippmann.codecs.types import Pixels
from lippmann.color.primaries import REC709
from lippmann.errors import PictureError
from lippmann.runtime.machine import check_input
from lippmann.runtime.quiet_stderr import silence_libraries

SIGNATURE = b"\x89PNG\r\n\x1a\n"

#: Compression level: higher ones cost twice the time for less than 2 % of the size.
_LEVEL = 4

#: Longest text that is read, decompressed: a display's description takes a few kilobytes.
_LONGEST_TEXT = 1 << 24

#: Chunks whose bodies are read; gAMA and cHRM hold fractions in units of 1/100000.
_READ = (b"IHDR", b"iTXt", b"iCCP", b"cICP", b"sRGB", b"gAMA", b"cHRM", b"eXIf", b"pHYs", b"acTL")
_FRACTION = 100_000
#: Exponents that differ by less than this share are alike (libpng's PNG_GAMMA_THRESHOLD).
_ALIKE = 0.05

_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 2, 6: 4}


@dataclass(frozen=True)
class PngHeader:
    """Facts in a PNG beside its pixels.

    Attributes
    ----------
    width, height:
        Size in pixels, as shown.
    bits:
        Bits per channel.
    channels:
        Channels once decoded.
    text:
        Its international texts.
    icc:
        ICC profile of the codes, from the first there is of cICP, iCCP, sRGB, and gAMA with cHRM; empty: sRGB.
    orientation:
        The EXIF orientation.
    notes:
        What of it is not shown, each in one line.
    """

    width: int
    height: int
    bits: int
    channels: int
    text: Mapping[str, str]
    icc: bytes = b""
    orientation: int = 1
    notes: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        """Bytes of its codes once decoded."""
        return self.width * self.height * self.channels * max(1, self.bits // 8)


def encode_png(
    codes: Pixels,
    *,
    text: Mapping[str, str],
    pixel_pitch: float | None = None,
    srgb: bool = True,
    icc: bytes = b"",
) -> bytes:
    """A PNG file of ``(H, W, 3)`` uint8 or uint16 codes.

    ``text`` becomes one ``iTXt`` chunk per keyword (Latin-1, at most 79 letters); ``pixel_pitch`` (mm) becomes
    ``pHYs``; ``srgb`` marks the codes as sRGB, unless ``icc``, a profile, describes them.
    """
    import imagecodecs

    encoded = bytes(imagecodecs.png_encode(np.ascontiguousarray(codes), level=_LEVEL))
    extra = b""
    if icc:
        extra += chunk(b"iCCP", b"profile\0\0" + zlib.compress(icc))  # name, method deflate
    elif srgb:
        extra += chunk(b"sRGB", b"\0")  # perceptual intent
    if pixel_pitch is not None:
        per_metre = max(1, round(1000 / pixel_pitch))
        extra += chunk(b"pHYs", struct.pack(">IIB", per_metre, per_metre, 1))
    for keyword, value in text.items():
        # keyword, no compression, no language, no translated keyword
        extra += chunk(b"iTXt", keyword.encode("latin-1") + b"\0\0\0\0\0" + value.encode("utf-8"))
    after_header = len(SIGNATURE) + 12 + 13
    return encoded[:after_header] + extra + encoded[after_header:]


def read_png_header(path: Path) -> PngHeader:
    """Size and texts of a PNG, without decoding its pixels.

    Raises
    ------
    PictureError
        If the file is truncated, damaged or no PNG.
    """
    with path.open("rb") as file:
        return png_header(file, path)


def png_header(file: BinaryIO, path: Path) -> PngHeader:
    """:func:`read_png_header` of a file that is open, at its beginning; ``path`` is its name, for errors."""
    header: tuple[int, int, int, int] | None = None
    text: dict[str, str] = {}
    bodies: dict[bytes, bytes] = {}
    for kind, body in chunks(file, path):
        if kind == b"IHDR" and len(body) == 13:
            width, height, bits, color_type = struct.unpack(">IIBB", body[:10])
            header = width, height, bits, _CHANNELS.get(color_type, 0)
        elif kind == b"iTXt":
            text.update(_international_text(body, path))
        else:
            bodies.setdefault(kind, body)
    if header is None or not header[0] or not header[1] or not header[3]:
        raise _damaged(path, "it has no proper header")
    width, height, bits, channels = header
    orientation = orientations.of_exif(bodies[b"eXIf"]) if b"eXIf" in bodies else 1
    if orientations.lies(orientation):
        width, height = height, width
    return PngHeader(width, height, bits, channels, text, _profile(bodies, path), orientation, _notes(bodies))


def read_png(path: Path) -> Pixels:
    """Codes of a PNG, upright: ``(H, W)`` or ``(H, W, 2 to 4)`` uint8 or uint16.

    Raises
    ------
    PictureError
        If a check sum is wrong or the pixels cannot be decoded.
    MemoryLimitError
        If they take more than the memory that is left.
    """
    with path.open("rb") as file:
        header = png_header(file, path)
        check_input(header.size, "its picture", where=str(path))
        return decode_png(file, header, path)


def decode_png(file: BinaryIO, header: PngHeader, path: Path) -> Pixels:
    """:func:`read_png` of an open file whose ``header`` is read, for callers who have asked for the memory."""
    import imagecodecs

    # libpng reports a wrong check sum of most chunks on standard error and goes on; so all are looked at first.
    file.seek(0)
    for _ in chunks(file, path, all_bodies=True):
        pass
    file.seek(0)
    try:
        with silence_libraries():
            codes: Pixels = imagecodecs.png_decode(file.read())
    except (RuntimeError, ValueError) as error:
        raise _damaged(path, str(error)) from error
    return orientations.upright(codes, header.orientation)


def chunk(kind: bytes, body: bytes) -> bytes:
    """A chunk with its length and check sum."""
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def chunks(file: BinaryIO, path: Path, *, all_bodies: bool = False) -> Iterator[tuple[bytes, bytes]]:
    """Kind and checked body of every chunk up to ``IEND``; bodies of no interest are empty, unless ``all_bodies``."""
    if file.read(len(SIGNATURE)) != SIGNATURE:
        raise PictureError("is no PNG", where=str(path))
    size = file.seek(0, 2)
    file.seek(len(SIGNATURE))
    while True:
        head = file.read(8)
        if len(head) < 8:
            raise _damaged(path, "it ends before its end mark")
        (length,), kind = struct.unpack(">I", head[:4]), head[4:]
        if file.tell() + length + 4 > size:
            raise _damaged(path, f"it ends within its {kind.decode('latin-1')!r} chunk")
        if kind == b"IEND":
            return
        if not all_bodies and kind not in _READ:
            file.seek(length + 4, 1)
            yield kind, b""
            continue
        body, (crc,) = file.read(length), struct.unpack(">I", file.read(4))
        if zlib.crc32(kind + body) != crc:
            raise _damaged(path, f"the check sum of its {kind.decode('latin-1')} chunk is wrong")
        yield kind, body


def _international_text(body: bytes, path: Path) -> dict[str, str]:
    keyword, _, rest = body.partition(b"\0")
    compressed, value = rest[:1] == b"\1", rest[2:].split(b"\0", 2)
    if len(rest) < 2 or len(value) < 3:
        raise _damaged(path, "one of its texts has no proper form")
    raw = value[2]
    try:
        if compressed:
            # Rewriters of PNG files compress texts; the limit keeps a small file from filling the memory.
            raw = zlib.decompressobj().decompress(raw, _LONGEST_TEXT)
        return {keyword.decode("latin-1"): raw.decode("utf-8")}
    except (zlib.error, UnicodeDecodeError) as error:
        raise _damaged(path, f"one of its texts cannot be read ({error})") from error


def _notes(bodies: Mapping[bytes, bytes]) -> tuple[str, ...]:
    density, animation = bodies.get(b"pHYs", b""), bodies.get(b"acTL", b"")
    notes = aspect_note(*struct.unpack(">II", density[:8])) if len(density) == 9 else ()
    return notes + (pictures_note(int.from_bytes(animation[:4], "big")) if len(animation) == 8 else ())


def _profile(bodies: Mapping[bytes, bytes], path: Path) -> bytes:
    """ICC profile of the codes by the chunk that comes first (PNG, third edition, 4.3); empty: sRGB."""
    code_points = bodies.get(b"cICP", b"")
    if len(code_points) == 4:
        if not code_points[3]:
            rule = "codes over their full range are read"
            raise PictureError(
                "its codes have a narrow range (cICP)", where=str(path), rule=rule, fix="convert it to sRGB"
            )
        try:
            return profile_of_cicp(code_points[0], code_points[1])
        except PictureError as error:
            raise PictureError(error.what, where=str(path), rule=error.rule, fix=error.fix) from None
    if b"iCCP" in bodies:
        _, _, packed = bodies[b"iCCP"].partition(b"\0")
        try:
            return zlib.decompressobj().decompress(packed[1:], _LONGEST_TEXT)  # after the byte of the method, deflate
        except zlib.error as error:
            raise _damaged(path, f"its ICC profile cannot be read ({error})") from error
    if b"sRGB" in bodies:
        return b""
    gamma = int.from_bytes(bodies.get(b"gAMA", b""), "big") / _FRACTION
    places = bodies.get(b"cHRM", b"")
    white_first = [number / _FRACTION for number in struct.unpack(">8I", places)] if len(places) == 32 else []
    return rgb_profile([*white_first[2:], *white_first[:2]] or REC709, _curve(gamma))


def _curve(gamma: float) -> float | None:
    """Exponent from codes to light; None, the curve of sRGB, for its own exponent and without one."""
    return None if gamma <= 0.0 or abs(gamma * 2.2 - 1.0) < _ALIKE else 1.0 / gamma


def _damaged(path: Path, what: str) -> PictureError:
    return PictureError(f"this PNG is damaged: {what}", where=str(path), fix="make or fetch it anew")
