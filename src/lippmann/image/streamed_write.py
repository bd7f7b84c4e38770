"""Writing a picture that is made a few rows at a time and never whole in memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs import tiff, zarr_array
from lippmann.color.transfer import Transfer
from lippmann.display.pixel_window import TileGrid
from lippmann.errors import PictureError
from lippmann.image.encoding import FormatName, stored_values
from lippmann.image.metadata import Metadata, to_text
from lippmann.image.stored_values import FloatArray, Stored
from lippmann.image.write import format_for, replacing_output

#: Makes the rows from the first up to the last: ``(last - first, W, 3)`` linear RGB.
Rows = Callable[[int, int], FloatArray]


def can_be_banded(name: FormatName) -> bool:
    """Whether files of this format can be written without the picture being whole in memory."""
    return name in ("tiff", "zarr")


def write_in_bands(rows: Rows, metadata: Metadata, path: Path, *, bits: int | None = None) -> None:
    """Write the picture that ``rows`` makes, from the top down and each row once, as tiled BigTIFF or Zarr.

    Raises
    ------
    OutputError
        As :func:`lippmann.image.write.write_picture`.
    PictureError
        If a value is not finite, or the format has to be written whole.
    """
    name, stored = format_for(path, bits)
    if not can_be_banded(name):
        raise PictureError(f"{name.upper()} files are written whole", where=str(path), fix="use .tif or .zarr")
    panel = metadata.display.panel
    size, text, dtype = (panel.width, panel.height), to_text(metadata), np.dtype(stored)
    tiles = _tiles(rows, size, stored, metadata.provenance.transfer)
    with replacing_output(path, name) as temporary:
        if name == "zarr":
            places = (window.slices for window in TileGrid(*size, tiff.TILE))
            cut = zip(places, tiles, strict=True)
            zarr_array.write_zarr(temporary, cut, size=size, side=tiff.TILE, dtype=dtype, text=text)
            return
        tiff.write_tiled_tiff(
            temporary,
            tiles,
            size=size,
            side=tiff.TILE,
            dtype=dtype,
            description=text,
            pixel_pitch=panel.pixel_pitch,
        )


def _tiles(rows: Rows, size: tuple[int, int], stored: Stored, transfer: Transfer) -> Iterator[NDArray[Any]]:
    width, height = size
    for first in range(0, height, tiff.TILE):
        linear = rows(first, min(first + tiff.TILE, height))
        if not np.isfinite(linear).all():
            raise PictureError(f"values in the rows from {first} on are not finite")
        band = stored_values(linear, stored, transfer)
        yield from (band[:, left : left + tiff.TILE] for left in range(0, width, tiff.TILE))
