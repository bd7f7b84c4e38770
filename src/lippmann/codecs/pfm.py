"""Portable float maps: a picture of 32-bit floats behind three lines of text.

``Pf`` for one channel, width and height, and a scale whose sign tells the order of the bytes (negative: little-endian);
then the rows, the lowest first (P. Debevec's HDRShop format; the files of the 4D Light Field Benchmark are such).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import PictureError
from lippmann.runtime.regular_file import check_kind, unreadable

_HEADER = re.compile(rb"(P[Ff])\s+(\d{1,9})\s+(\d{1,9})\s+(-?\d{1,9}(?:\.\d{1,9})?(?:[eE][-+]?\d{1,2})?)[ \t\r]*\n")


def write_pfm(path: Path, values: NDArray[np.float32]) -> None:
    """Write ``(H, W)`` floats, row 0 on top, little-endian; they come back bit by bit, infinities too."""
    height, width = values.shape
    path.write_bytes(f"Pf\n{width} {height}\n-1.0\n".encode("ascii") + values[::-1].astype("<f4").tobytes())


def read_pfm(path: Path) -> NDArray[np.float32]:
    """``(H, W)`` floats of a PFM, row 0 on top.

    Raises
    ------
    PictureError
        If the file is missing, no PFM of one channel, or has more or fewer values than its header says.
    """
    try:
        check_kind(path, PictureError)
        content = path.read_bytes()
    except OSError as error:
        raise unreadable(path, error, PictureError) from error
    header = _HEADER.match(content)
    if header is None:
        raise PictureError("is no PFM", where=str(path), rule="it begins with Pf, width and height, and a scale")
    if header[1] == b"PF":
        raise PictureError("is a PFM in colour", where=str(path), rule="a depth or disparity has one channel")
    width, height, scale = int(header[2]), int(header[3]), float(header[4])
    body = len(content) - header.end()
    if body != 4 * width * height:
        kind = "is cut short" if body < 4 * width * height else "is too long"
        rule = f"{width} x {height} values take {4 * width * height} bytes"
        raise PictureError(f"{kind}: {body} bytes follow its header", where=str(path), rule=rule)
    values = np.frombuffer(content, dtype="<f4" if scale < 0 else ">f4", offset=header.end())
    return np.ascontiguousarray(values.reshape(height, width)[::-1], dtype=np.float32)
