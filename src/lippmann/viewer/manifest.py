"""What the page has to know of a picture to behave as its display does, as plain values for JSON.

The page draws with the formulas of :mod:`lippmann.viewing.replay` and :mod:`lippmann.display.lattice`; here are their
numbers, in effect (aligned pitches, lenses counted as in :attr:`Display.lens_grid`), in millimetres, pixels and
degrees.
"""

from __future__ import annotations

import math
from typing import Any, Literal

from lippmann.display import Display
from lippmann.image import Picture
from lippmann.image.views import view_grid
from lippmann.viewer.tiles import TILE_SIZE, Tiles
from lippmann.viewing.replay import default_eye

TileFormat = Literal["png", "rgb"]

#: Rises when a name that the page knows changes its meaning.
VERSION = 1

#: The most tiles of a picture: each is a layer of one array texture, of which every WebGL 2 has at least so many.
MOST_TILES = 256

_NO_OFFSETS = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))


def manifest(image: Picture, tiles: Tiles, *, name: str = "", tile_format: TileFormat = "rgb") -> dict[str, Any]:
    """The description of a picture for the page.

    Parameters
    ----------
    image, tiles:
        What the panel shows, whole and in tiles.
    name:
        What the page calls it, such as the file's name; by default the scene's.
    tile_format:
        What a tile is sent as: ``png``, or ``rgb`` for bare bytes, three per pixel, row after row from the top.
    """
    display, made = image.display, image.provenance
    return {
        "lippmann": VERSION,
        "name": name or made.scene,
        "display": display.title or display.name,
        "facts": facts(image),
        **optics(display, subpixels=made.subpixels),
        "transfer": made.transfer,
        "tiles": {**tiles.description(), "format": tile_format},
    }


def optics(display: Display, *, subpixels: bool) -> dict[str, Any]:
    """The numbers of a display's geometry.

    ``subpixels`` says whether red, green and blue lie at their own places; where not, all offsets are zero. The
    ``row_pitch`` of a lenticular sheet and an infinite ``viewing_distance`` are None.
    """
    panel, lattice, places = display.panel, display.lattice, view_grid(display)
    cells: Any = (panel.subpixel_cells or ((panel.subpixel_offsets,),)) if subpixels else ((_NO_OFFSETS,),)
    return {
        "panel": {
            "width": panel.width,
            "height": panel.height,
            "pixel_pitch": panel.pixel_pitch,
            "subpixels": subpixels,
            "cells": [[[list(pair) for pair in cell] for cell in row] for row in cells],
            # With cells the nearest sub-pixel is looked for even if all cells were alike, as replay does.
            "uneven": subpixels and panel.subpixel_cells is not None,
        },
        "lenses": {
            "layout": lattice.layout,
            "columns": display.lens_grid.columns,
            "rows": display.lens_grid.rows,
            "pitch": lattice.pitch,
            "row_pitch": _finite(lattice.row_pitch),
            "slant": lattice.slant,
            "origin": [lattice.origin_x, lattice.origin_y],
            "tolerance": lattice.tolerance,
        },
        "gap": display.gap,
        "viewing_distance": _finite(display.viewing_distance),
        "magnification": display.magnification,
        "micro_image_pitch": display.micro_image_pitch,
        "field_of_view": display.field_of_view,
        "resolvable_depth": list(display.resolvable_depth),
        "eye": list(default_eye(display)),
        "views": {"right": list(places.right), "down": list(places.down)},
    }


def tile_size(display: Display) -> int:
    """Side of a tile in pixels, such that a picture of the display has at most :data:`MOST_TILES`."""
    size, panel = TILE_SIZE, display.panel
    while math.ceil(panel.width / size) * math.ceil(panel.height / size) > MOST_TILES:
        size *= 2
    return size


def facts(image: Picture) -> list[list[str]]:
    """What one wants to know of the picture, as rows of a table: label and text."""
    display, made = image.display, image.provenance
    grid, panel = display.lens_grid, display.panel
    across, down = display.pixels_per_lens
    slant = f", slant {display.lens_array.slant:.3g}°" if display.lens_array.slant else ""
    distance = display.viewing_distance
    rows = [
        ("Panel", f"{panel.width} x {panel.height} pixels, {display.size_mm[0]:.4g} x {display.size_mm[1]:.4g} mm"),
        ("Lenses", f"{grid.columns}" + ("" if down is None else f" x {grid.rows}")),
        ("Layout", display.lens_array.layout + slant),
        ("Pixels per lens", f"{across:.4g}" + ("" if down is None else f" x {down:.4g}")),
        ("Field of view", f"{display.field_of_view:.3g}°"),
        ("Viewing distance", "infinite" if math.isinf(distance) else f"{distance:.4g} mm"),
        ("Scene", made.scene),
        ("Method", made.method),
        ("Samples per pixel", "" if made.spp is None else str(made.spp)),
        ("Rays traced", "" if made.traced_fraction is None else f"{100 * made.traced_fraction:.3g} %"),
        ("Estimated quality", _quality(made.estimate)),
        ("Rendered by", made.version and f"Lippmann {made.version}"),
    ]
    return [[label, text] for label, text in rows if text]


def _quality(estimate: Any) -> str:
    psnr = (estimate or {}).get("psnr")
    return f"{psnr:.1f} dB" if isinstance(psnr, (int, float)) else ""


def _finite(value: float) -> float | None:
    return None if math.isinf(value) else value
