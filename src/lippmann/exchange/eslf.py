"""ESLF: one PNG of all micro-images side by side, the usual format of lenslet cameras' light fields.

The pixel ``(t, s)`` under lens ``(v, u)`` is in row ``v T + t`` and column ``u S + s``; ``t`` and ``s`` count the views
from the top left. This is the native picture of a display of such lenses with every micro-image turned by 180 degrees,
since a display sends the light of a lens's right-most pixel to the left. An alpha channel holds the weight of each
value. The file does not hold the number of pixels under a lens; 14 x 14 is customary.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.png import encode_png, read_png, read_png_header
from lippmann.display import Display
from lippmann.errors import PictureError
from lippmann.exchange.light_field import (
    WEIGHT,
    LightField,
    check_rectangular,
    check_shape,
    decode_weights,
    encode_weights,
)
from lippmann.exchange.metadata_text import TEXT_KEY, from_note, to_note
from lippmann.image.read import open_file
from lippmann.image.views import view_shape
from lippmann.runtime.atomic_write import replacing

LAYOUT = "eslf"

#: Customary number of pixels under a lens, across and down.
LENS = (14, 14)


def write_eslf(light_field: LightField, display: Display, path: Path) -> None:
    """Write a light field as one PNG of micro-images.

    Parameters
    ----------
    light_field:
        Codes of 8 or 16 bits. A map ``weight`` becomes the alpha channel.
    display:
        The display whose views these are.
    path:
        The file; appears whole or not at all.

    Raises
    ------
    PictureError
        If the display's lenses are not in rows and columns of whole pixels.
    OutputError
        If the file cannot be written.
    """
    check_rectangular(display, "ESLF")
    values: NDArray[Any] = light_field.values
    if light_field.weight is not None:
        values = np.concatenate([values, encode_weights(light_field.weight, values.dtype)[..., None]], axis=-1)
    down, across, height, width, channels = values.shape
    picture = values.transpose(2, 0, 3, 1, 4).reshape(height * down, width * across, channels)
    text = {TEXT_KEY: note} if (note := to_note(light_field.metadata, LAYOUT)) else {}
    with replacing(path) as temporary:
        temporary.write_bytes(encode_png(picture, text=text, srgb=light_field.transfer == "srgb"))


def read_eslf(path: Path, *, grid: tuple[int, int] | None = None) -> LightField:
    """Read a light field from one PNG of micro-images.

    Parameters
    ----------
    path:
        The file.
    grid:
        Pixels under a lens, across and down. None: those of the display that the file names, else 14 x 14.

    Raises
    ------
    PictureError
        If the file is missing, damaged or no PNG in colour, or its sides are no multiples of ``grid``.
    """
    header = open_file(path)
    if header.format != "png":
        raise PictureError(f"is a picture of the format {header.format}", where=str(path), rule="ESLF is PNG")
    if header.text:
        rule = "in ESLF every micro-image is turned by 180 degrees"
        raise PictureError("is the native picture of a display", where=str(path), rule=rule)
    note = read_png_header(path).text.get(TEXT_KEY, "")
    metadata = from_note(note, LAYOUT, str(path))
    across, down = LENS if grid is None else grid
    if grid is None and metadata is not None:
        down, across = view_shape(metadata.display)[:2]
    if header.width % across or header.height % down:
        rule = f"with {across} x {down} pixels per lens its sides must be multiples of these"
        what = f"has {header.width} x {header.height} pixels"
        raise PictureError(what, where=str(path), rule=rule, fix="say display=..., with the lenses it has")
    shape = (down, across, header.height // down, header.width // across)
    check_shape((*shape, 3), str(path))
    codes = read_png(path)
    if codes.ndim != 3 or codes.shape[2] not in (3, 4):
        raise PictureError("is not in colour", where=str(path), rule="ESLF is RGB, or RGB and a weight")
    values: NDArray[Any] = codes.reshape(shape[2], down, shape[3], across, codes.shape[2]).transpose(1, 3, 0, 2, 4)
    maps = {} if values.shape[4] == 3 else {WEIGHT: decode_weights(values[..., 3])}
    return LightField(values[..., :3], metadata, maps, notes=header.notes)
