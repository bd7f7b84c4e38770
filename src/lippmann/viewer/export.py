"""Export of pictures as one HTML file that contains the viewer and all tiles and needs no network."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from pathlib import Path

from lippmann.display import Display
from lippmann.errors import UsageError
from lippmann.image import Picture
from lippmann.options.option import checked
from lippmann.runtime.atomic_write import replacing
from lippmann.viewer.lens_light import lens_light
from lippmann.viewer.manifest import manifest, tile_size
from lippmann.viewer.page import single_file_page
from lippmann.viewer.tiles import Tiles

#: Limit on the pictures of a page: two, with a divider between them.
MAX_PICTURES = 2

#: Limit on the pixels of a picture: writing and opening the file hold all of them in memory, several times.
MOST_PIXELS = 1 << 27


def check_exportable(display: Display) -> None:
    """Raise :class:`UsageError` if a picture of this display has too many pixels for a page that needs no server."""
    panel = display.panel
    if panel.width * panel.height > MOST_PIXELS:
        raise UsageError(
            f"a picture of {panel.width} x {panel.height} pixels is too large",
            parameter="export",
            rule=f"a page in one file shows at most {MOST_PIXELS} pixels",
            fix="leave it out: the viewer's server sends what is looked at",
        )


@checked
def export_page(pictures: Sequence[tuple[str, Picture]], path: Path) -> None:
    """Write one HTML file that shows one picture, or two with a divider between them.

    Parameters
    ----------
    pictures:
        Title and picture, one or two.
    path:
        The HTML file to write; about a third larger than the pictures as PNG.

    Raises
    ------
    UsageError
        If there is no picture, or there are more than two, or one has more than :data:`MOST_PIXELS`.
    OutputError
        If the place cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> import numpy as np
    >>> from lippmann.viewer.export import export_page
    >>> small = lippmann.load_display("seed-lenticular").resized(16, 8)
    >>> export_page([("white", lippmann.IntegralImage(np.ones((8, 16, 3)), small))], Path("page.html"))
    """
    if not 1 <= len(pictures) <= MAX_PICTURES:
        raise UsageError(f"{len(pictures)} pictures", rule="must be one or two")
    for _, image in pictures:
        check_exportable(image.display)
    data = json.dumps([_picture_data(name, image) for name, image in pictures], allow_nan=False, separators=(",", ":"))
    title = " | ".join(name for name, _ in pictures)
    with replacing(path) as temporary:
        temporary.write_text(single_file_page(title, data, len(pictures)), encoding="utf-8")


def _picture_data(name: str, image: Picture) -> dict[str, object]:
    tiles = Tiles(image, tile_size(image.display))
    description = manifest(image, tiles, name=name, tile_format="png")
    layers = {layer: _base64_tiles(tiles, layer) for layer in tiles.layers}
    return {"manifest": description, "tiles": layers, "light": lens_light(image.display)}


def _base64_tiles(tiles: Tiles, layer: str) -> dict[str, str]:
    """PNG files of all tiles of a layer, in base 64, by ``column_row``."""
    places = ((column, row) for row in range(tiles.rows) for column in range(tiles.columns))
    return {f"{c}_{r}": base64.b64encode(tiles.png(layer, c, r)).decode("ascii") for c, r in places}
