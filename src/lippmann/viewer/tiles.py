"""A picture and its maps in tiles, as the page asks for them.

All tiles are parts of the native pixels: an integral image made smaller means nothing to the lenses in front of it.
"""

from __future__ import annotations

import threading
from typing import Any

import numpy as np

from lippmann.codecs.png import encode_png
from lippmann.display.pixel_window import PixelWindow
from lippmann.errors import UsageError
from lippmann.image import Picture
from lippmann.image.encoding import converted_values
from lippmann.viewer.overlays import Codes, overlays

#: Columns and rows of a tile; those on the right and at the bottom may have fewer.
TILE_SIZE = 1024

#: The layer that is the picture itself.
PICTURE = "picture"


class Tiles:
    """The tiles of a picture: 8-bit codes as its display shows them, and its maps in colours.

    Parameters
    ----------
    image:
        The picture; nothing is computed before a tile is asked for.
    size:
        Columns and rows of a tile, at least 1.
    """

    def __init__(self, image: Picture, size: int = TILE_SIZE) -> None:
        self._image = image
        self._size = size
        self._lock = threading.Lock()
        self._overlays = overlays(image)
        panel = image.display.panel
        self.columns, self.rows = -(-panel.width // size), -(-panel.height // size)

    def description(self) -> dict[str, Any]:
        """Plain values for the page: ``width``, ``height``, ``size``, ``columns``, ``rows`` and ``layers``.

        A layer has a ``name``, a ``title`` and what :class:`~lippmann.viewer.overlays.Overlay` says of its colours; the
        first is the picture.
        """
        panel = self._image.display.panel
        layers = [{"name": PICTURE, "title": "Picture"}, *(item.description for item in self._overlays.values())]
        tiles = {"size": self._size, "columns": self.columns, "rows": self.rows}
        return {"width": panel.width, "height": panel.height, **tiles, "layers": layers}

    def codes(self, layer: str, column: int, row: int) -> Codes:
        """``(rows, columns, 3)`` uint8 codes of one tile, row 0 of the panel on top.

        Raises
        ------
        UsageError
            If there is no such layer or tile.
        """
        if layer != PICTURE and layer not in self._overlays:
            raise UsageError(f"there is no layer {layer!r}", rule=f"there are {', '.join([PICTURE, *self._overlays])}")
        if not (0 <= column < self.columns and 0 <= row < self.rows):
            rule = f"there are {self.columns} x {self.rows}"
            raise UsageError(f"there is no tile in column {column}, row {row}", rule=rule)
        top, left, panel = row * self._size, column * self._size, self._image.display.panel
        rows, columns = min(self._size, panel.height - top), min(self._size, panel.width - left)
        window = PixelWindow(left, top, columns, rows)
        return self._picture_codes(window) if layer == PICTURE else self._overlays[layer].codes(window.slices)

    def rgb(self, layer: str, column: int, row: int) -> bytes:
        """The codes of a tile one after the other: R, G, B of its rows from the top; raises as :meth:`codes`."""
        return np.ascontiguousarray(self.codes(layer, column, row)).tobytes()

    def png(self, layer: str, column: int, row: int) -> bytes:
        """A PNG file of a tile, without a colour space, so that nothing changes its codes; raises as :meth:`codes`."""
        return encode_png(self.codes(layer, column, row), text={}, srgb=False)

    def _picture_codes(self, window: PixelWindow) -> Codes:
        transfer = self._image.provenance.transfer
        with self._lock:  # a picture on disk is for one thread at a time
            values = self._image.window(window)
        return converted_values(values, "uint8", transfer).astype(np.uint8, copy=False)
