"""Whether a file can hold the pixels that its header claims, asked before memory is given to them."""

from __future__ import annotations

from pathlib import Path

from lippmann.errors import PictureError

#: Deflate, the tightest packing of all formats here, makes at most 1032 bytes of one: as many grey pixels of 8 bits,
#: and 8 times as many of 1 bit.
_MOST_PER_BYTE = 1100


def check_claim(size: tuple[int, int], pixel_bits: int, file_bytes: int, path: Path) -> None:
    """Raise :class:`PictureError` if a file is too short for ``size`` pixels of ``pixel_bits`` each."""
    if size[0] * size[1] * min(pixel_bits, 8) > 8 * file_bytes * _MOST_PER_BYTE:
        what = f"claims {size[0]} x {size[1]} pixels but has only {file_bytes} bytes"
        raise PictureError(what, where=str(path), fix="make or fetch it anew")
