"""One file that shows a picture anywhere a browser is: page, description and tiles in one, no network needed."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lippmann.display import Display
from lippmann.errors import UsageError
from lippmann.image import Picture
from lippmann.runtime.atomic_write import replacing
from lippmann.viewer.manifest import manifest, tile_size
from lippmann.viewer.page import single_file_page
from lippmann.viewer.tiles import Tiles

#: The most pictures that a page shows: two, with a divider between them.
MOST_PICTURES = 2

#: The most pixels of a picture in such a page, which holds all of them several times over while it is written, and
#: while a browser reads it.
MOST_PIXELS = 1 << 27


def check_exportable(display: Display) -> None:
    """Raise :class:`UsageError` if a picture of this display has too many pixels for a page that needs no server."""
    panel = display.panel
    if panel.width * panel.height > MOST_PIXELS:
        raise UsageError(
            f"a picture of {panel.width} x {panel.height} pixels will not do",
            where="--export",
            rule=f"a page in one file shows at most {MOST_PIXELS} pixels",
            fix="leave it out: the viewer's server sends what is looked at",
        )


def export_page(pictures: Sequence[tuple[str, Picture]], path: Path) -> None:
    """Write a page that shows one picture, or two with a divider between them.

    Parameters
    ----------
    pictures:
        What the page calls each picture, and the picture.
    path:
        The HTML file to write; about a third larger than the pictures as PNG.

    Raises
    ------
    UsageError
        If there is no picture, or there are more than two, or one has more than :data:`MOST_PIXELS`.
    OutputError
        If the place cannot be written.
    """
    if not 1 <= len(pictures) <= MOST_PICTURES:
        raise UsageError(f"{len(pictures)} pictures will not do", rule="a page shows one or two")
    for _, image in pictures:
        check_exportable(image.display)
    data = json.dumps([_embedded(name, image) for name, image in pictures], allow_nan=False, separators=(",", ":"))
    title = " | ".join(name for name, _ in pictures)
    with replacing(path) as temporary:
        temporary.write_text(single_file_page(title, data, len(pictures)), encoding="utf-8")


def _embedded(name: str, image: Picture) -> dict[str, Any]:
    tiles = Tiles(image, tile_size(image.display))
    described = manifest(image, tiles, name=name, tile_format="png")
    layers = [layer["name"] for layer in described["tiles"]["layers"]]
    return {"manifest": described, "tiles": {layer: _all(tiles, layer) for layer in layers}}


def _all(tiles: Tiles, layer: str) -> dict[str, str]:
    places = ((column, row) for row in range(tiles.rows) for column in range(tiles.columns))
    return {f"{c}_{r}": base64.b64encode(tiles.png(layer, c, r)).decode("ascii") for c, r in places}
