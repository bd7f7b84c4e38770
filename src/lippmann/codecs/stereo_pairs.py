"""Stereo pairs in one JPEG file: JPS and MPO.

**JPS** is a JPEG picture of both views. The segment APP3 ``_JPSJPS_`` says how they lie; flag 4 means that the left
eye's is first. Without that flag, or without the segment, the right eye's is on the left: for crossed eyes. **MPO**
(CIPA DC-007) is one JPEG picture after another, the leftmost viewpoint first.
"""

from __future__ import annotations

import io
import re
import struct
from pathlib import Path

import numpy as np

from lippmann.codecs.photograph import Photograph, open_photograph
from lippmann.codecs.pillow_formats import open_picture
from lippmann.codecs.types import FILMS, Pixels
from lippmann.errors import PictureError

#: Endings of the files that hold pairs; films (:data:`lippmann.codecs.types.FILMS`) may, too.
PAIRS = (".jps", ".mpo")
#: Endings of HEIF pictures, whose pairs :mod:`lippmann.scene.readers.heif` reads.
HEIF = (".heic", ".heif", ".hif")

_APP3, _JPS = b"\xff\xe3", b"_JPSJPS_"
#: Of the JPS descriptor: a stereo picture, its layouts, and flags.
_STEREO, _SIDE_BY_SIDE, _OVER_UNDER = 1, 2, 3
_HALF_HEIGHT, _HALF_WIDTH, _LEFT_FIRST = 1, 2, 4
#: Of an MPO's pictures: what Pillow writes of the first, and those of a stereo pair, the first of which represents it.
_PILLOWS, _DISPARITY, _REPRESENTS = 0x030000, 0x020002, 0x20000000
#: The tag of the list of an MPO's pictures, and Pillow's name of those that show another one of them in small.
_MP_ENTRIES, _SMALL = 0xB002, "Large Thumbnail"
#: JPEG: nearly without loss, all colours.
_JPEG = {"quality": 95, "subsampling": 0}


def encode_jps(left: Pixels, right: Pixels, *, half: bool = False) -> bytes:
    """A JPS file of two views ``(h, w, 3)`` of 8 bits, the right one on the left; ``half``: each is halved in width."""
    from PIL import Image

    held = io.BytesIO()
    Image.fromarray(np.concatenate([right, left], axis=1)).save(held, "JPEG", **_JPEG)
    body = _JPS + struct.pack(">H4BH", 4, 0, _HALF_WIDTH if half else 0, _SIDE_BY_SIDE, _STEREO, 0)
    data = held.getvalue()
    after = 4 + int.from_bytes(data[4:6], "big")  # the mark of the file, and its JFIF segment
    return data[:after] + _APP3 + struct.pack(">H", len(body) + 2) + body + data[after:]


def encode_mpo(left: Pixels, right: Pixels) -> bytes:
    """An MPO file of two views ``(h, w, 3)`` of 8 bits."""
    from PIL import Image

    held = io.BytesIO()
    Image.fromarray(left).save(held, "MPO", save_all=True, append_images=[Image.fromarray(right)], **_JPEG)
    data = bytearray(held.getvalue())
    # Pillow calls them a picture and one of no kind. Of each: attribute, size, offset (0 for the first), no others.
    first = re.compile(re.escape(struct.pack("<L", _PILLOWS)) + b".{4}" + bytes(8), re.DOTALL)
    match = first.search(data, data.index(b"MPF\0"))
    assert match is not None
    place = match.start()
    struct.pack_into("<L", data, place, _DISPARITY | _REPRESENTS)
    struct.pack_into("<L", data, place + 16, _DISPARITY)
    return bytes(data)


def read_pair(path: Path) -> tuple[Photograph, Photograph] | None:
    """The left and the right view of a file of a pair, of a spatial film those of its first frame; None for others.

    Raises
    ------
    PictureError
        It is damaged, or by its name a pair and by its content none.
    MemoryLimitError
        Its pixels take more than the memory that is left.
    OSError, SyntaxError, PIL.UnidentifiedImageError
        As :func:`lippmann.codecs.photograph.open_photograph`.
    """
    suffix = path.suffix.lower()
    if suffix == ".jps":
        return _read_jps(path)
    if suffix == ".mpo":
        return _read_mpo(path)
    if suffix in FILMS:
        from lippmann.codecs.film_views import read_first_pair

        return read_first_pair(path)
    return None


def _read_jps(path: Path) -> tuple[Photograph, Photograph]:
    with path.open("rb") as file, open_photograph(file, path, ("JPEG",)) as picture:
        codes, icc, notes = picture.codes(), picture.icc, picture.notes
    flags, layout, kind = _descriptor(path.read_bytes())
    if kind != _STEREO or layout not in (_SIDE_BY_SIDE, _OVER_UNDER):
        raise PictureError(
            "holds no views side by side or one above the other", where=str(path), rule="such JPS files are read"
        )
    axis = 1 if layout == _SIDE_BY_SIDE else 0
    middle = codes.shape[axis] // 2
    first, second = codes.take(range(middle), axis), codes.take(range(middle, 2 * middle), axis)
    if flags & _HALF_WIDTH:
        first, second = first.repeat(2, axis=1), second.repeat(2, axis=1)
    if flags & _HALF_HEIGHT:
        first, second = first.repeat(2, axis=0), second.repeat(2, axis=0)
    left, right = (first, second) if flags & _LEFT_FIRST else (second, first)
    return Photograph.of_codes(left, icc, notes), Photograph.of_codes(right, icc, notes)


def _descriptor(data: bytes) -> tuple[int, int, int]:
    """Flags, layout and kind of a JPS; those of a pair for crossed eyes where it says nothing."""
    place = 2
    while data[place : place + 1] == b"\xff" and data[place + 1] not in (0xDA, 0xD9):
        body = data[place + 4 : place + 2 + int.from_bytes(data[place + 2 : place + 4], "big")]
        if data[place : place + 2] == _APP3 and body.startswith(_JPS) and len(body) >= 14:
            flags, layout, kind = body[11:14]
            return flags, layout, kind
        place += 4 + len(body)
    return 0, _SIDE_BY_SIDE, _STEREO


def _read_mpo(path: Path) -> tuple[Photograph, Photograph]:
    with open_picture(path, ("JPEG",)) as picture:
        entries = getattr(picture, "mpinfo", {}).get(_MP_ENTRIES, ())
        kinds = [entry["Attribute"]["MPType"] for entry in entries]
        numbers = [number for number, kind in enumerate(kinds) if not kind.startswith(_SMALL)]
        if len(numbers) < 2:
            raise PictureError("holds one picture", where=str(path), rule="an MPO file of a pair holds two")
        notes = (f"it holds {len(numbers)} views: the first two are shown",) if len(numbers) > 2 else ()
        return Photograph.of_frame(picture, numbers[0], notes), Photograph.of_frame(picture, numbers[1], notes)
