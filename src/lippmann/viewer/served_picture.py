"""Picture file of the viewer's server: read at the first request, and again after the file has changed."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path

from lippmann.display import Display
from lippmann.errors import PictureError
from lippmann.image import read
from lippmann.image.streamed import picture_of_file
from lippmann.runtime.regular_file import unreadable
from lippmann.viewer.manifest import TileFormat, manifest, tile_size
from lippmann.viewer.tiles import Tiles


@dataclass(frozen=True)
class ServedPicture:
    """Description and tiles of a picture, and the display that it is made for.

    ``version`` identifies the version of the file: tiles belong to the manifest of the same version only.
    """

    version: str
    manifest: dict[str, object]
    tiles: Tiles
    tile_format: TileFormat
    display: Display


class PictureFile:
    """Picture file that a server shows. Safe for use from several threads.

    Parameters
    ----------
    path:
        The file.
    display:
        Display of the picture; by default the one in the file's metadata.
    tile_format:
        Format of the tiles: ``rgb``, uncompressed, fastest on one machine; or ``png``, smaller.

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
        self._picture: ServedPicture | None = None
        self._opened: tuple[str, read.PictureFile] | None = self._version(), read.open_file(path)
        self._opened[1].metadata_for(display)

    def current(self) -> ServedPicture:
        """The picture in the present version of the file; a :class:`PictureError` if it cannot be read."""
        with self._lock:
            version = self._version()
            if self._picture is None or self._picture.version != version:
                self._picture = None  # frees the memory before the next version is read
                opened, self._opened = self._opened, None
                file = opened[1] if opened is not None and opened[0] == version else read.open_file(self.path)
                # The page takes display codes: decoding them would only cost memory.
                image = picture_of_file(file, self._display, keeps_codes=True)
                tiles = Tiles(image, tile_size(image.display))
                description = manifest(image, tiles, name=self.path.name, tile_format=self._tile_format)
                self._picture = ServedPicture(version, description, tiles, self._tile_format, image.display)
            return self._picture

    def load_once(self) -> ServedPicture:
        """The picture as last read, even if the file has changed since; reads the file the first time."""
        with self._lock:
            picture = self._picture
        return self.current() if picture is None else picture

    def _version(self) -> str:
        try:
            state = self.path.stat()
        except OSError as error:
            raise unreadable(self.path, error, PictureError) from None
        return f"{state.st_ino:x}-{state.st_size:x}-{state.st_mtime_ns:x}"
