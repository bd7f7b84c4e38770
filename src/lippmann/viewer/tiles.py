"""Tiles of a picture and its layers for the viewer.

Every tile holds native pixels. There are no reduced resolutions: a downscaled integral image no longer fits its lenses.
"""

from __future__ import annotations

import threading

import numpy as np

from lippmann.codecs.png import encode_png
from lippmann.display.panel import PixelWindow
from lippmann.errors import UsageError
from lippmann.image import Picture
from lippmann.image.encoding import converted_values
from lippmann.viewer.overlays import Codes, overlays

#: Columns and rows of a tile; tiles at the right and lower edge may have fewer.
TILE_SIZE = 1024

#: Name of the layer that is the picture itself.
PICTURE = "picture"


class Tiles:
    """Tiles of a picture: its 8-bit display codes, and its layers in false colour.

    Parameters
    ----------
    image:
        The picture; tiles are computed when requested.
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

    @property
    def layers(self) -> tuple[str, ...]:
        """Names of the layers; the first is the picture."""
        return (PICTURE, *self._overlays)

    def description(self) -> dict[str, object]:
        """Plain values for JSON: ``width``, ``height``, ``size``, ``columns``, ``rows`` and ``layers``.

        A layer has a ``name``, a ``title`` and the legend of its colours, see
        :class:`~lippmann.viewer.overlays.Overlay`. The first is the picture.
        """
        panel = self._image.display.panel
        layers = [{"name": PICTURE, "title": "Picture"}, *(item.description for item in self._overlays.values())]
        tiles = {"size": self._size, "columns": self.columns, "rows": self.rows}
        return {"width": panel.width, "height": panel.height, **tiles, "layers": layers}

    def codes(self, layer: str, column: int, row: int) -> Codes:
        """``(rows, columns, 3)`` uint8 codes of one tile; row 0 is the upper one.

        Raises
        ------
        UsageError
            If there is no such layer or tile.
        """
        if layer not in self.layers:
            raise UsageError.unknown("layer", layer, self.layers)
        if not (0 <= column < self.columns and 0 <= row < self.rows):
            rule = f"there are {self.columns} x {self.rows}"
            raise UsageError(f"there is no tile in column {column}, row {row}", rule=rule)
        top, left, panel = row * self._size, column * self._size, self._image.display.panel
        rows, columns = min(self._size, panel.height - top), min(self._size, panel.width - left)
        window = PixelWindow(left, top, columns, rows)
        return self._picture_codes(window) if layer == PICTURE else self._overlays[layer].codes(window.slices)

    def rgb(self, layer: str, column: int, row: int) -> bytes:
        """Codes of a tile as bytes: R, G, B of each pixel, row after row from the top; raises as :meth:`codes`."""
        return np.ascontiguousarray(self.codes(layer, column, row)).tobytes()

    def png(self, layer: str, column: int, row: int) -> bytes:
        """PNG file of a tile, without a colour space, so that no reader changes its codes; raises as :meth:`codes`."""
        return encode_png(self.codes(layer, column, row), text={}, srgb=False)

    def _picture_codes(self, window: PixelWindow) -> Codes:
        transfer = self._image.provenance.transfer
        with self._lock:  # readers of pictures on disk are not thread-safe
            values = self._image.window(window)
        return converted_values(values, "uint8", transfer).astype(np.uint8, copy=False)
