"""Messages between the studio and its page: frames as bytes, everything else as JSON.

A binary message is a frame, from the studio to the page: 24 bytes of header, little-endian, then the coded picture.

======  ====  ==========================================================
offset  type  value
======  ====  ==========================================================
0       u8    version of the header, 1
1       u8    coding: 0 JPEG, 1 PNG, 2 sRGB bytes (RGB, rows from the top)
2       u8    bit 0: at rest, no better frame follows; bit 1: denoised
3       u8    0
4       u32   number of the frame, which the page acknowledges
8       u32   number of the view that the frame shows
12      u16   width, 14 u16 height in pixels
16      u32   samples per native (sub-)pixel
20      f32   seconds that the frame took to render
======  ====  ==========================================================
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import UsageError

Coding = Literal["jpeg", "png", "rgb"]

#: Of frames and views, which messages have as unsigned 32-bit numbers.
LARGEST_NUMBER = 2**32 - 1

CODINGS: tuple[Coding, ...] = ("jpeg", "png", "rgb")

#: Quality of JPEG, 4:4:4: its errors stay below those of a single sample per pixel.
_JPEG_LEVEL = 90

_HEADER = struct.Struct("<BBBBIIHHIf")

#: Deepest nesting of a message's values; a state is three deep.
_MOST_DEPTH = 6


@dataclass(frozen=True)
class FrameHeader:
    """Header of a frame; see the module."""

    coding: Coding
    number: int
    view: int
    width: int
    height: int
    samples: int = 1
    seconds: float = 0.0
    is_final: bool = False
    is_denoised: bool = False

    def pack(self) -> bytes:
        """The header's 24 bytes."""
        flags = self.is_final | self.is_denoised << 1
        size = self.width, self.height
        coding = CODINGS.index(self.coding)
        return _HEADER.pack(1, coding, flags, 0, self.number, self.view, *size, self.samples, self.seconds)


def encode_frame(header: FrameHeader, pixels: NDArray[np.uint8]) -> bytes:
    """A frame as a message.

    Parameters
    ----------
    header:
        The header, with the coding to use.
    pixels:
        ``(height, width, 3)`` uint8, sRGB.
    """
    import imagecodecs

    if header.coding == "jpeg":
        body = imagecodecs.jpeg_encode(pixels, level=_JPEG_LEVEL, subsampling="444")
    elif header.coding == "png":
        body = imagecodecs.png_encode(pixels, level=1)
    else:
        body = np.ascontiguousarray(pixels).tobytes()
    return header.pack() + bytes(body)


def message_text(message: Mapping[str, object]) -> str:
    """A message for the page as JSON, which has neither NaN nor infinities: numbers that are not finite are null."""
    return json.dumps(_finite(message), allow_nan=False)


def parse_message(text: object) -> dict[str, Any]:
    """Message of the page: a JSON object with a ``type``.

    Raises
    ------
    UsageError
        It is none.
    """
    rule = "must be an object of JSON with a type"
    if not isinstance(text, str):
        raise UsageError("the message", rule=rule)
    try:
        message = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError):
        raise UsageError("the message", rule=rule) from None
    if not isinstance(message, dict) or not isinstance(message.get("type"), str) or not _is_shallow(message):
        raise UsageError("the message", rule=rule)
    return message


def count_of(message: dict[str, Any], name: str) -> int:
    """A count of a message, 0 to :data:`LARGEST_NUMBER`; a UsageError otherwise."""
    value: Any = message.get(name)
    if not _is_number(value, LARGEST_NUMBER) or value < 0:
        raise UsageError(f"{str(value)[:40]!r}", parameter=name, rule=f"must be a number from 0 to {LARGEST_NUMBER:g}")
    return int(value)


def numbers_of(message: dict[str, Any], name: str, count: int, limit: float) -> tuple[float, ...]:
    """So many finite numbers of a message, of at most ``limit`` up or down; a UsageError otherwise."""
    values = message.get(name)
    if not isinstance(values, list) or len(values) != count or not all(_is_number(v, limit) for v in values):
        raise UsageError(f"{str(values)[:40]!r}", parameter=name, rule=f"must be {count} numbers")
    return tuple(float(value) for value in values)


def _finite(value: object) -> object:
    if isinstance(value, Mapping):
        return {name: _finite(part) for name, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _is_number(value: object, limit: float) -> bool:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    return math.isfinite(value) and abs(value) <= limit


def _refuse_constant(name: str) -> float:
    raise ValueError(name)  # NaN and infinities are no JSON


def _is_shallow(value: object, depth: int = _MOST_DEPTH) -> bool:
    if not isinstance(value, (dict, list)):
        return True
    parts = value.values() if isinstance(value, dict) else value
    return depth > 0 and all(_is_shallow(part, depth - 1) for part in parts if isinstance(part, (dict, list)))
