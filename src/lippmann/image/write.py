"""Picture files written: the format by the name's ending, the bits per channel; a file appears whole or not at all.

How formats code values is described in :mod:`lippmann.image.encoding`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from lippmann.color.transfer import Transfer
from lippmann.errors import OutputError, PictureError
from lippmann.image.encoding import (
    FORMATS,
    STORED,
    FormatName,
    Rows,
    converted_values,
    encode_tiles,
    encode_values,
    is_tiled,
    mirrored_in_file,
    profile_in_file,
    tiles_of_rows,
)
from lippmann.image.integral_image import Picture
from lippmann.image.metadata import Metadata, to_text
from lippmann.image.stored_values import FloatArray, Layer, Stored, Values
from lippmann.runtime.atomic_write import check_folder_writable, check_writable, remark, replacing, replacing_folder


def format_for(path: Path, bits: int | None = None, *, source: Stored = "float32") -> tuple[FormatName, Stored]:
    """File format for a name, and type of the values that such a file stores.

    Parameters
    ----------
    path:
        The file; its ending chooses the format: ``.png``, ``.exr``, ``.tif``, ``.tiff`` or ``.zarr``.
    bits:
        Bits per channel: 8 or 16 (PNG), 16 or 32 (OpenEXR, floats), 8, 16 or 32 (TIFF and Zarr, floats). By default
        those of ``source`` if the format has them; 8 for computed values, 32 in OpenEXR.
    source:
        Type of the values in the file that the picture came from; ``float32`` for computed ones.

    Raises
    ------
    OutputError
        If the ending is unknown or the format has no such bits.
    """
    name = FORMATS.get(path.suffix.lower())
    if name is None:
        raise OutputError.unknown("ending", path.suffix, FORMATS, where=str(path))
    return name, stored_as(name, path, bits, source)


def stored_as(name: FormatName, path: Path, bits: int | None, source: Stored) -> Stored:
    """Type of the values in a file of the format ``name``; the other parameters and errors are :func:`format_for`'s."""
    depths = STORED[name]
    if bits is None:
        return source if source in depths.values() and source != "float32" else next(iter(depths.values()))
    if bits not in depths:
        known = " or ".join(str(depth) for depth in sorted(depths))
        raise OutputError(f"{bits} bits per channel are not possible", where=str(path), rule=f"{name} has {known}")
    return depths[bits]


def check_finite(pixels: FloatArray, path: Path) -> None:
    """Raise :class:`PictureError` if a value of a picture for the file ``path`` is not finite."""
    if not np.isfinite(pixels).all():
        raise PictureError("the picture holds values that are not finite", where=str(path))


def can_be_banded(name: FormatName) -> bool:
    """Whether files of this format can be written without the whole picture in memory."""
    return name in ("tiff", "zarr")


def write_picture(picture: Picture, path: Path, *, bits: int | None = None, icc: bytes = b"") -> None:
    """Write a picture, in memory or on disk, with its metadata.

    Zarr and large TIFF files are written some rows at a time.

    Parameters
    ----------
    picture:
        The picture; OpenEXR alone keeps its maps.
    path:
        The file; its ending chooses the format.
    bits:
        Bits per channel, see :func:`format_for`; by default as in the file that the picture came from.
    icc:
        ICC profile of a print's codes, see :func:`~lippmann.image.encoding.profile_in_file`.

    Raises
    ------
    OutputError
        If the ending is unknown, the format has no such bits, or the file cannot be written.
    """
    target, panel = format_for(path, bits, source=picture.stored), picture.display.panel
    size, transfer = (panel.width, panel.height), picture.provenance.transfer
    _write(path, target, picture.held_rows, size, transfer, picture.metadata, picture.maps, icc=icc)


def write_rows(rows: Rows, metadata: Metadata, path: Path, *, bits: int | None = None, icc: bytes = b"") -> None:
    """Write a computed picture some rows at a time, as tiled BigTIFF or Zarr.

    Parameters
    ----------
    rows:
        ``rows(first, last)`` computes linear RGB ``(last - first, W, 3)``; called from the top down, once for each row.
    metadata:
        Display, placement and provenance of the picture.
    path, bits, icc:
        As for :func:`write_picture`.

    Raises
    ------
    OutputError
        If the ending is unknown, the format has no such bits, or the file cannot be written.
    PictureError
        If a value is not finite, or the format has to be written whole.
    """
    target, panel = format_for(path, bits), metadata.display.panel
    if not can_be_banded(target[0]):
        raise PictureError(f"{target[0].upper()} files are written whole", where=str(path), fix="use .tif or .zarr")

    def checked(first: int, last: int) -> Values:
        values = rows(first, last)
        if not np.isfinite(values).all():
            raise PictureError(f"values in the rows from {first} on are not finite")
        return values

    size, transfer = (panel.width, panel.height), metadata.provenance.transfer
    _write(path, target, checked, size, transfer, metadata, in_tiles=True, icc=icc)


def write_plain_picture(
    pixels: FloatArray,
    path: Path,
    *,
    bits: int | None = None,
    transfer: Transfer = "srgb",
) -> None:
    """Write an ordinary picture, such as a replay or a preview, without metadata.

    Parameters
    ----------
    pixels:
        ``(H, W, 3)`` linear RGB, finite.
    path, bits:
        The file and its bits per channel, see :func:`format_for`.
    transfer:
        Coding of the values in integer formats.

    Raises
    ------
    OutputError
        If the ending is unknown, the format has no such bits, or the file cannot be written.
    PictureError
        If a value is not finite.
    """
    target, (height, width) = format_for(path, bits), pixels.shape[:2]
    check_finite(pixels, path)
    _write(path, target, lambda first, last: pixels[first:last], (width, height), transfer)


@contextmanager
def replacing_output(path: Path, name: FormatName) -> Iterator[Path]:
    """Temporary path for a picture file, renamed to ``path`` when the block succeeds; a folder for Zarr.

    Raises
    ------
    OutputError
        If ``path`` cannot be written.
    """
    with replacing_folder(path) if name == "zarr" else replacing(path) as temporary:
        yield temporary
    remark(f"{path} was written")


def check_output(path: Path, bits: int | None = None) -> tuple[FormatName, Stored]:
    """:func:`format_for`, and an :class:`OutputError` if ``path`` cannot be written; writes nothing."""
    name, stored = format_for(path, bits)
    (check_folder_writable if name == "zarr" else check_writable)(path)
    return name, stored


def _write(
    path: Path,
    target: tuple[FormatName, Stored],
    rows: Rows,
    size: tuple[int, int],
    transfer: Transfer,
    metadata: Metadata | None = None,
    maps: Mapping[str, Layer] | None = None,
    *,
    in_tiles: bool = False,
    icc: bytes = b"",
) -> None:
    """Write rows of linear floats or codes; ``in_tiles`` writes even a small TIFF tile by tile."""
    name, stored = target
    text = "" if metadata is None else to_text(metadata)
    display = None if metadata is None else metadata.display
    pixel_pitch = None if display is None else display.panel.pixel_pitch

    def converted(first: int, last: int) -> Values:
        return mirrored_in_file(converted_values(rows(first, last), stored, transfer), display)

    icc = profile_in_file(display, stored, transfer, icc)
    with replacing_output(path, name) as temporary:
        if in_tiles or is_tiled(name, size):
            tiles = tiles_of_rows(converted, size)
            dtype = np.dtype(stored)
            encode_tiles(temporary, name, tiles, size=size, dtype=dtype, text=text, pixel_pitch=pixel_pitch, icc=icc)
        else:
            layers: dict[str, Layer] = {"": converted(0, size[1])}
            layers |= {key: mirrored_in_file(values, display) for key, values in (maps or {}).items()}
            encode_values(temporary, name, layers, transfer=transfer, text=text, pixel_pitch=pixel_pitch, icc=icc)
