"""Animated PNG, one frame at a time, after the PNG specification (W3C, third edition, section 11.3.4).

Pillow holds all frames of an animation at once.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

from lippmann.codecs.png import SIGNATURE, chunk, chunks, encode_png
from lippmann.codecs.types import Pixels

#: Largest numerator of a delay, a fraction of a second; and largest denominator that is asked for.
_MOST, _FINEST = 65535, 1000


def write_apng(frames: Iterator[Pixels], path: Path, frames_per_second: float) -> None:
    """Write 8-bit frames as a lossless animation that repeats forever."""
    seconds = 1 / frames_per_second
    delay = Fraction(seconds).limit_denominator(max(1, min(_FINEST, int(_MOST / seconds))))
    with path.open("wb") as file:
        count = sequence = 0
        for count, frame in enumerate(frames, 1):
            parts = list(chunks(io.BytesIO(encode_png(frame, text={})), path, all_bodies=True))
            if count == 1:
                file.write(SIGNATURE + b"".join(chunk(*part) for part in parts if part[0] in (b"IHDR", b"sRGB")))
                place = file.tell()
                file.write(chunk(b"acTL", bytes(8)))
            height, width = frame.shape[:2]
            fraction = delay.numerator, delay.denominator
            file.write(chunk(b"fcTL", struct.pack(">5I2H2B", sequence, width, height, 0, 0, *fraction, 0, 0)))
            sequence += 1
            for body in (body for kind, body in parts if kind == b"IDAT"):
                if count == 1:
                    file.write(chunk(b"IDAT", body))
                else:
                    file.write(chunk(b"fdAT", struct.pack(">I", sequence) + body))
                    sequence += 1
        file.write(chunk(b"IEND", b""))
        file.seek(place)
        file.write(chunk(b"acTL", struct.pack(">2I", count, 0)))
