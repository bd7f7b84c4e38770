"""A picture's file as the page shows it: read when it is first asked for, and again once it was written anew."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lippmann.display import Display
from lippmann.errors import PictureError
from lippmann.image import read
from lippmann.image.streamed import picture_of_file
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
        self.path = path
        self._display = display
        self._tile_format = tile_format
        self._lock = threading.Lock()
        self._shown: Shown | None = None
        self._opened: tuple[str, read.PictureFile] | None = self._version(), read.open_file(path)
        self._opened[1].metadata_for(display)

    def current(self) -> Shown:
        """The picture as the file is now; a :class:`PictureError` if it cannot be read."""
        with self._lock:
            version = self._version()
            if self._shown is None or self._shown.version != version:
                self._shown = None  # two pictures of this size need not be in memory at once
                opened, self._opened = self._opened, None
                file = opened[1] if opened is not None and opened[0] == version else read.open_file(self.path)
                # Codes stay codes: they are what the page is given.
                image = picture_of_file(file, self._display, keeps_codes=True)
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
