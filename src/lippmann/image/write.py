"""Picture files written: the format by the ending of the name, the bits per channel, replacing only what is whole.

What the formats do to the values is told in :mod:`lippmann.image.encoding`.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np

from lippmann.color.transfer import Transfer
from lippmann.errors import OutputError, PictureError
from lippmann.image.encoding import FORMATS, STORED, FormatName, encode_file
from lippmann.image.integral_image import IntegralImage
from lippmann.image.metadata import metadata_of, to_text
from lippmann.image.stored_values import FloatArray, Stored
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


def write_picture(image: IntegralImage, path: Path, *, bits: int | None = None) -> None:
    """Write an integral image with its metadata; see :func:`format_for` for endings and ``bits``.

    Only OpenEXR keeps the picture's maps.

    Raises
    ------
    OutputError
        If the ending is unknown, the format has no such bits, or the place cannot be written.
    """
    name, stored = format_for(path, bits, source=image.stored)
    layers = {"": image.pixels, **image.maps} if name == "exr" else {"": image.pixels}
    with replacing_output(path, name) as temporary:
        encode_file(
            temporary,
            name,
            layers,
            stored=stored,
            transfer=image.provenance.transfer,
            text=to_text(metadata_of(image)),
            pixel_pitch=image.display.panel.pixel_pitch,
        )


def write_plain_picture(
    pixels: FloatArray,
    path: Path,
    *,
    bits: int | None = None,
    transfer: Transfer = "srgb",
    maps: Mapping[str, Any] | None = None,
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
    layers = {"": pixels, **(maps or {})} if name == "exr" else {"": pixels}
    with replacing_output(path, name) as temporary:
        encode_file(temporary, name, layers, stored=stored, transfer=transfer)


def replacing_output(path: Path, name: FormatName) -> AbstractContextManager[Path]:
    """:func:`lippmann.runtime.atomic_write.replacing`, or what does the same for the formats that are folders."""
    return replacing_folder(path) if name == "zarr" else replacing(path)


def check_output(path: Path, name: FormatName) -> None:
    """Raise :class:`OutputError` now if a picture of this format could not be written to ``path`` later."""
    if name == "zarr":
        check_folder_writable(path)
    else:
        check_writable(path)
