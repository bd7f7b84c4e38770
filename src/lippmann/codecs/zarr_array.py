"""Zarr: a folder with one file per tile, and what the picture says of itself as an attribute.

The array has the shape ``(height, width, 3)``, chunks of one tile each, the attribute ``lippmann`` with the same values
that other formats carry as text, and the attribute ``dimensions``: row, column, color.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from lippmann.codecs.types import Attributes, Pixels, StoredType, ZarrArray, ZarrModule
from lippmann.codecs.zarr_reader import array_names, axis_names, node_kind, open_array, read_array
from lippmann.errors import MemoryLimitError, PictureError
from lippmann.runtime.machine import check_input

ENDING = ".zarr"

#: The files that make a folder a Zarr array or group, in the third and the second version of the format.
MARKS = ("zarr.json", ".zarray", ".zgroup")

DIMENSIONS = ["row", "column", "color"]
#: Other programs' names for an axis that runs across the picture, and so cannot be the first.
_ACROSS = ("x", "column", "columns", "width")

#: Compression: higher levels save little of rendered pictures.
_LEVEL = 1

#: Name of the attribute with the metadata.
TEXT_KEY = "lippmann"


def write_zarr(
    folder: Path,
    tiles: Iterable[tuple[tuple[slice, slice], Pixels]],
    *,
    size: tuple[int, int],
    side: int,
    dtype: StoredType,
    text: str,
) -> None:
    """Write the array into ``folder``, which is empty, tile by tile.

    Parameters
    ----------
    tiles:
        Where each tile lies, and its ``(rows, columns, 3)`` values.
    size:
        Width and height of the picture.
    side:
        Height and width of a tile.
    text:
        JSON of the metadata, or empty.

    Raises
    ------
    PictureError
        If the library is not installed.
    """
    zarr = load_zarr(folder)
    shape = {"shape": (size[1], size[0], 3), "chunks": (side, side, 3), "dtype": dtype, "fill_value": 0}
    array = _create(zarr, str(folder), shape)
    array.attrs.update({TEXT_KEY: json.loads(text or "null"), "dimensions": DIMENSIONS})
    for place, values in tiles:
        array[place] = values


def _create(zarr: ZarrModule, folder: str, shape: Attributes) -> ZarrArray:
    """An empty array packed by Zstandard with check sums, so that a changed byte does not become a colour."""
    if hasattr(zarr, "create_array"):
        packing = zarr.codecs.ZstdCodec(level=_LEVEL, checksum=True)
        return zarr.create_array(store=folder, compressors=(packing,), overwrite=True, **shape)
    from numcodecs import Zstd  # the library's second version

    return zarr.open_array(folder, mode="w", compressor=Zstd(level=_LEVEL, checksum=True), **shape)


def is_zarr(path: Path) -> bool:
    """Whether this is a folder with a Zarr array or group."""
    try:
        return any((path / mark).is_file() for mark in MARKS)
    except (OSError, ValueError):  # no file can have such a name
        return False


class ZarrPicture:
    """The Zarr array of a folder, opened for reading: its metadata, read once, and its values, whole or by chunks.

    Attributes
    ----------
    width, height:
        Size in pixels.
    dtype:
        NumPy type name of the values.
    text:
        JSON of the attribute :data:`TEXT_KEY`; empty without.
    chunk:
        Rows and columns of a chunk; those at the right and lower edge are cut off.

    Raises
    ------
    PictureError
        If the library is not installed, or the folder holds no picture, or one whose metadata is not admitted.
    """

    def __init__(self, folder: Path) -> None:
        zarr = load_zarr(folder)
        try:
            metadata, attributes = read_array(folder)
        except PictureError:
            if node_kind(folder) == "group":
                raise _group(folder) from None
            raise
        if len(metadata.shape) != 3 or metadata.shape[2] != 3 or min(metadata.shape) < 1:
            raise PictureError(
                f"holds an array of shape {metadata.shape}", where=str(folder), rule="it must be (height, width, 3)"
            )
        axes = axis_names(metadata, attributes)
        if axes and axes[0].lower() in _ACROSS:
            raise PictureError(
                f"has the axes {', '.join(axes)[:60]}",
                where=str(folder),
                rule="they must be height, width, 3 colours",
                fix="store the picture with its axes in that order",
            )
        self._folder, self._array = folder, open_array(zarr, folder, metadata)
        self.height, self.width = metadata.shape[:2]
        self.dtype: str = self._array.dtype.name
        attribute = attributes.get(TEXT_KEY)
        self.text = "" if attribute is None else json.dumps(attribute)
        high, wide = (int(length) for length in self._array.chunks[:2])
        self.chunk = high, wide

    def read(self) -> Pixels:
        """All ``(height, width, 3)`` values as stored; a :class:`PictureError` if they cannot be decoded."""
        size = 3 * self.width * self.height * np.dtype(self.dtype).itemsize
        check_input(size, "its picture", where=str(self._folder))
        return self._read(slice(None), slice(None))

    def read_chunk(self, row: int, column: int) -> Pixels:
        """``(rows, columns, 3)`` values of a chunk; a :class:`PictureError` if they cannot be decoded."""
        high, wide = self.chunk
        return self._read(slice(row * high, (row + 1) * high), slice(column * wide, (column + 1) * wide))

    def _read(self, rows: slice, columns: slice) -> Pixels:
        try:
            values: Pixels = np.asarray(self._array[rows, columns])
        except (PictureError, MemoryLimitError):
            raise
        except Exception as error:  # whatever the library stumbles with over a damaged chunk
            what = f"this Zarr array is damaged: {error}"
            raise PictureError(what, where=str(self._folder), fix="make it anew") from error
        return values


def _group(folder: Path) -> PictureError:
    names = array_names(folder)
    held = f"it holds the arrays {', '.join(names)}" if names else "it holds no arrays"
    fix = f"name an array: {folder / names[0]}" if names else ""
    return PictureError("is a Zarr group", where=str(folder), rule=held, fix=fix)


def load_zarr(where: Path) -> ZarrModule:
    """The library, which is an extra.

    Raises
    ------
    PictureError
        If it is not installed.
    """
    try:
        import zarr
    except ImportError:
        raise PictureError(
            "the library 'zarr' is not installed", where=str(where), fix='install it: pip install "lippmann[exchange]"'
        ) from None
    return zarr
