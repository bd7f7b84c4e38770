"""Picture files read: recognized by their first bytes, checked against the display that they are for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lippmann.display import Display
from lippmann.errors import PictureError
from lippmann.image.encoding import FormatName, decode_file, read_header
from lippmann.image.integral_image import IntegralImage
from lippmann.image.metadata import Metadata, from_text
from lippmann.image.provenance import Provenance


@dataclass(frozen=True)
class PictureInfo:
    """What is known of a picture file without decoding it.

    ``layers`` are the names of its maps; ``metadata`` is None if it does not say for which display it is.
    """

    format: FormatName
    width: int
    height: int
    stored: str
    layers: tuple[str, ...]
    metadata: Metadata | None


def read_picture(path: Path, *, display: Display | None = None) -> IntegralImage:
    """Read an integral image: PNG, OpenEXR or TIFF.

    Parameters
    ----------
    path:
        The file.
    display:
        The display that the picture is for, instead of the one that it carries; needed for files of other programs.

    Raises
    ------
    PictureError
        If the file is missing, empty, foreign or damaged, has no display, or a size other than the display's.
    """
    info = read_info(path)
    metadata = metadata_for(info, path, display)
    layers, stored = decode_file(path, info.format, metadata.provenance.transfer)
    pixels = layers.pop("")
    try:
        return IntegralImage(
            pixels, metadata.display, metadata.world_from_display, metadata.provenance, layers, stored=stored
        )
    except PictureError as error:
        raise PictureError(error.what, where=str(path), rule=error.rule, fix=error.fix) from error


def read_metadata(path: Path, *, display: Display | None = None) -> Metadata:
    """Display, placement and provenance of a picture, without decoding its pixels; raises as :func:`read_picture`."""
    return metadata_for(read_info(path), path, display)


def read_info(path: Path) -> PictureInfo:
    """Format, size and metadata of a picture file, without decoding its pixels.

    Raises
    ------
    PictureError
        If the file is missing, empty, foreign or damaged, or its metadata makes no sense.
    """
    header = read_header(path)
    metadata = from_text(header.text, str(path)) if header.text else None
    return PictureInfo(header.format, header.width, header.height, header.stored, header.layers, metadata)


def metadata_for(info: PictureInfo, path: Path, display: Display | None) -> Metadata:
    """The metadata of a picture file, for ``display`` if one is given; raises as :func:`read_picture`."""
    metadata = info.metadata
    if metadata is None:
        if display is None:
            raise PictureError("has no display in it", where=str(path), fix="say --display")
        metadata = Metadata(display, np.eye(4), Provenance())
    elif display is not None:
        metadata = replace(metadata, display=display)
    panel = metadata.display.panel
    if (info.width, info.height) != (panel.width, panel.height):
        raise PictureError(
            f"has {info.width} x {info.height} pixels",
            where=str(path),
            rule=f"the display {metadata.display.name} has {panel.width} x {panel.height}",
        )
    return metadata
