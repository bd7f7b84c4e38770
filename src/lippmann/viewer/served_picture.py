"""A picture's file as the page shows it: read when it is first asked for, and again once it was written anew."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from lippmann.codecs.png import read_png
from lippmann.codecs.tiff import read_tiff
from lippmann.display import Display
from lippmann.errors import PictureError
from lippmann.image import IntegralImage, read_info, read_metadata
from lippmann.image.encoding import check_stored, opaque_colors
from lippmann.image.read import metadata_for
from lippmann.image.stored_values import Stored
from lippmann.image.streamed import LARGE, ChunkedPixels, LargePicture, open_picture
from lippmann.viewer.manifest import TileFormat, manifest, tile_size
from lippmann.viewer.tiles import Tiles


@dataclass(frozen=True)
class Shown:
    """What the page is given of a picture.

    ``version`` names the state of the file: tiles belong to the manifest of the same version only.
    """

    version: str
    manifest: dict[str, Any]
    tiles: Tiles


class PictureFile:
    """A file that the page shows. May be used from several threads at once.

    Parameters
    ----------
    path:
        The file.
    display:
        The display that the picture is for, instead of the one that it carries.
    tile_format:
        How tiles travel: ``rgb`` bare, quickest on one machine, or ``png``, smaller.

    Raises
    ------
    PictureError
        If the file is missing, foreign, cut short, without a display, or of a size other than the display's.
    """

    def __init__(self, path: Path, display: Display | None = None, tile_format: TileFormat = "rgb") -> None:
        read_metadata(path, display=display)
        self.path = path
        self._display = display
        self._tile_format = tile_format
        self._lock = threading.Lock()
        self._shown: Shown | None = None

    def current(self) -> Shown:
        """The picture as the file is now; a :class:`PictureError` if it cannot be read."""
        with self._lock:
            version = self._version()
            if self._shown is None or self._shown.version != version:
                self._shown = None  # two pictures of this size need not be in memory at once
                image = open_shown(self.path, self._display)
                tiles = Tiles(image, tile_size(image.display))
                description = manifest(image, tiles, name=self.path.name, tile_format=self._tile_format)
                self._shown = Shown(version, description, tiles)
            return self._shown

    def loaded(self) -> Shown:
        """The picture as it was last read, whatever has become of the file; reads it if it never was."""
        with self._lock:
            shown = self._shown
        return self.current() if shown is None else shown

    def _version(self) -> str:
        try:
            state = self.path.stat()
        except OSError as error:
            reason = "is not there" if isinstance(error, FileNotFoundError) else f"cannot be read: {error.strerror}"
            raise PictureError(reason, where=str(self.path)) from None
        return f"{state.st_ino:x}-{state.st_size:x}-{state.st_mtime_ns:x}"


def open_shown(path: Path, display: Display | None) -> IntegralImage | LargePicture:
    """A picture for being shown: of a file that holds codes those alone, which is quicker than linear values are.

    Parameters and errors as for :func:`lippmann.image.read.read_picture`; errors in parts of a picture that is read
    piece by piece come when they are read.
    """
    info = read_info(path)
    is_small = info.width * info.height <= LARGE
    if info.stored not in ("uint8", "uint16") or not (info.format == "png" or (info.format == "tiff" and is_small)):
        return open_picture(path, display=display)
    metadata = metadata_for(info, path, display)
    check_stored(info.stored, info.format, path)
    values = opaque_colors(read_png(path) if info.format == "png" else read_tiff(path), path)
    # One piece, which is there already.
    source = ChunkedPixels((info.width, info.height), values.shape[:2], values.dtype, lambda row, column: values)
    return LargePicture(
        source, metadata.display, metadata.world_from_display, metadata.provenance, cast(Stored, info.stored)
    )
