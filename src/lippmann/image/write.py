"""Picture files written: the format by the ending of the name, the bits per channel, replacing only what is whole.

What the formats do to the values is told in :mod:`lippmann.image.encoding`.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Transfer
from lippmann.errors import OutputError, PictureError
from lippmann.image.encoding import FORMATS, STORED, FormatName, Rows, encode_rows
from lippmann.image.metadata import Metadata, metadata_of, to_text
from lippmann.image.picture import Picture
from lippmann.image.stored_values import FloatArray, Stored, Values
from lippmann.runtime.atomic_write import check_folder_writable, check_writable, replacing, replacing_folder


def format_for(path: Path, bits: int | None = None, *, source: Stored = "float32") -> tuple[FormatName, Stored]:
    """The format that a file name stands for and the type of the values that would be stored in it.

    ``bits`` per channel: 8 or 16 for PNG, 16 or 32 for EXR (float), 8, 16 or 32 (float) for TIFF and Zarr. None takes
    those of ``source`` where the format has them, so that a picture is written as exactly as it was read, except that
    computed values (``float32``) go to 8 bits unless the format is OpenEXR.

    Raises
    ------
    OutputError
        If the ending is unknown or the format has no such bits.
    """
    name = FORMATS.get(path.suffix.lower())
    if name is None:
        ending = f"the ending '{path.suffix}' is unknown" if path.suffix else "the name has no ending"
        raise OutputError(ending, where=str(path), rule=f"known are {', '.join(FORMATS)}")
    return name, stored_as(name, path, bits, source)


def stored_as(name: FormatName, path: Path, bits: int | None, source: Stored) -> Stored:
    """The type of the values that a file of the format ``name`` stores; see :func:`format_for`."""
    depths = STORED[name]
    if bits is None:
        is_kept = source in depths.values() and source != "float32"
        return source if is_kept else next(iter(depths.values()))
    if bits not in depths:
        known = " or ".join(str(depth) for depth in sorted(depths))
        raise OutputError(f"{bits} bits per channel are not possible", where=str(path), rule=f"{name} has {known}")
    return depths[bits]


def can_be_banded(name: FormatName) -> bool:
    """Whether files of this format can be written without the picture being whole in memory."""
    return name in ("tiff", "zarr")


def write_picture(picture: Picture, path: Path, *, bits: int | None = None) -> None:
    """Write a picture, in memory or on disk, with its metadata; see :func:`format_for` for endings and ``bits``.

    Only OpenEXR keeps the picture's maps. Zarr and large TIFF files are written a few rows at a time.

    Raises
    ------
    OutputError
        If the ending is unknown, the format has no such bits, or the place cannot be written.
    """
    target = format_for(path, bits, source=picture.stored)
    _write_rows(path, target, picture.held_rows, metadata_of(picture), maps=picture.maps)


def write_rows(rows: Rows, metadata: Metadata, path: Path, *, bits: int | None = None) -> None:
    """Write the picture that ``rows`` makes, from the top down and each row once, as tiled BigTIFF or Zarr.

    Raises
    ------
    OutputError
        As :func:`write_picture`.
    PictureError
        If a value is not finite, or the format has to be written whole.
    """
    name, stored = format_for(path, bits)
    if not can_be_banded(name):
        raise PictureError(f"{name.upper()} files are written whole", where=str(path), fix="use .tif or .zarr")

    def checked(first: int, last: int) -> Values:
        values = rows(first, last)
        if not np.isfinite(values).all():
            raise PictureError(f"values in the rows from {first} on are not finite")
        return values

    _write_rows(path, (name, stored), checked, metadata, in_tiles=True)


def write_plain_picture(
    pixels: FloatArray,
    path: Path,
    *,
    bits: int | None = None,
    transfer: Transfer = "srgb",
    maps: Mapping[str, NDArray[Any]] | None = None,
) -> None:
    """Write an ordinary picture, ``(H, W, 3)`` linear RGB: a replay, a preview. OpenEXR takes ``maps`` with it.

    Raises
    ------
    OutputError
        As :func:`write_picture`.
    PictureError
        If a value is not finite.
    """
    name, stored = format_for(path, bits)
    if not np.isfinite(pixels).all():
        raise PictureError("the picture holds values that are not finite", where=str(path))
    size, rows = pixels.shape[1::-1], lambda first, last: pixels[first:last]
    with replacing_output(path, name) as temporary:
        encode_rows(temporary, name, rows, size=size, stored=stored, transfer=transfer, maps=maps)


def _write_rows(
    path: Path,
    target: tuple[FormatName, Stored],
    rows: Rows,
    metadata: Metadata,
    *,
    maps: Mapping[str, NDArray[Any]] | None = None,
    in_tiles: bool = False,
) -> None:
    panel, (name, stored) = metadata.display.panel, target
    with replacing_output(path, name) as temporary:
        encode_rows(
            temporary,
            name,
            rows,
            size=(panel.width, panel.height),
            stored=stored,
            transfer=metadata.provenance.transfer,
            text=to_text(metadata),
            pixel_pitch=panel.pixel_pitch,
            maps=maps,
            in_tiles=in_tiles,
        )


def replacing_output(path: Path, name: FormatName) -> AbstractContextManager[Path]:
    """:func:`lippmann.runtime.atomic_write.replacing`, or what does the same for the formats that are folders."""
    return replacing_folder(path) if name == "zarr" else replacing(path)


def check_output(path: Path, name: FormatName) -> None:
    """Raise :class:`OutputError` now if a picture of this format could not be written to ``path`` later."""
    if name == "zarr":
        check_folder_writable(path)
    else:
        check_writable(path)
