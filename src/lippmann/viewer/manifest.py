"""Description of a picture and its display for the viewer, as plain values for JSON.

The viewer draws by the formulas of :mod:`lippmann.viewing.replay` and :mod:`lippmann.display.lens_array`. Their
parameters are given as they take effect (aligned pitches, lenses counted as in :attr:`Display.lens_grid`), in
millimetres, pixels and degrees.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal

from lippmann.display import Display
from lippmann.image import Picture
from lippmann.image.views import view_grid
from lippmann.viewer.tiles import TILE_SIZE, Tiles
from lippmann.viewing.replay import default_eye

TileFormat = Literal["png", "rgb"]

#: Version of the description; rises when a key changes its meaning.
VERSION = 1

#: Limit on the tiles of a picture: each is a layer of an array texture, and WebGL 2 guarantees 256.
MAX_TILES = 256

_NO_OFFSETS = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))


def manifest(image: Picture, tiles: Tiles, *, name: str = "", tile_format: TileFormat = "rgb") -> dict[str, object]:
    """Description of a picture: name, facts, geometry of the display (:func:`optics`), transfer and tiles.

    Parameters
    ----------
    image, tiles:
        The picture, and its tiles.
    name:
        Title on the page, such as the file's name; by default the scene's name.
    tile_format:
        Format of a tile: ``png``, or ``rgb`` for uncompressed bytes, three per pixel, row after row from the top.
    """
    display, provenance = image.display, image.provenance
    return {
        "lippmann": VERSION,
        "name": name or provenance.scene,
        "display": display.title or display.name,
        "facts": facts(image),
        **optics(display, subpixels=provenance.subpixels),
        "transfer": provenance.transfer,
        "tiles": {**tiles.description(), "format": tile_format},
    }


def optics(display: Display, *, subpixels: bool) -> dict[str, object]:
    """Geometry of a display as plain values for JSON, in millimetres, pixels and degrees.

    Without ``subpixels`` all sub-pixel offsets are zero. The ``row_pitch`` of a lenticular sheet and an infinite
    ``viewing_distance`` are None.
    """
    panel, lattice, places = display.panel, display.lattice, view_grid(display)
    cells = panel.cells if subpixels else ((_NO_OFFSETS,),)
    return {
        "panel": {
            "width": panel.width,
            "height": panel.height,
            "pixel_pitch": panel.pixel_pitch,
            "subpixels": subpixels,
            "cells": [[[list(pair) for pair in cell] for cell in row] for row in cells],
            # As in replay, cells mean a search for the nearest sub-pixel, even if all cells are alike.
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
        "lens": None if display.lens is None else display.lens.in_words(),
        "gap": display.gap,
        "edge_factor": display.edge_factor,
        "distortion": _distortion(display),
        "viewing_distance": _finite(display.viewing_distance),
        "magnification": display.magnification,
        "micro_image_pitch": display.micro_image_pitch,
        "field_of_view": display.field_of_view,
        "resolvable_depth": list(display.resolvable_depth),
        "eye": list(default_eye(display)),
        "views": {"right": list(places.right), "down": list(places.down)},
    }


def _distortion(display: Display) -> dict[str, object] | None:
    """Factors at equal steps up to ``reach`` (mm from a lens's axis), of both maps; None of a pinhole."""
    bent = display.distortion
    if bent is None:
        return None
    return {
        "pinhole": {"reach": bent.reach, "factors": list(bent.factors)},
        "place": {"reach": bent.reach * bent.factors[-1], "factors": list(bent.inverse_factors)},
    }


def tile_size(display: Display) -> int:
    """Side of a tile in pixels, such that a picture of the display has at most :data:`MAX_TILES` tiles."""
    size, panel = TILE_SIZE, display.panel
    while math.ceil(panel.width / size) * math.ceil(panel.height / size) > MAX_TILES:
        size *= 2
    return size


def facts(image: Picture) -> list[list[str]]:
    """Facts about a picture for the user, as rows of a table: ``[label, text]``."""
    display, provenance = image.display, image.provenance
    grid, panel = display.lens_grid, display.panel
    across, down = display.pixels_per_lens
    slant = f", slant {display.lens_array.slant:.3g}°" if display.lens_array.slant else ""
    distance = display.viewing_distance
    rows = [
        ("Panel", f"{panel.width} x {panel.height} pixels, {display.size_mm[0]:.4g} x {display.size_mm[1]:.4g} mm"),
        ("Lenses", f"{grid.columns}" + ("" if down is None else f" x {grid.rows}")),
        ("Layout", display.lens_array.layout + slant),
        ("Lens", "" if display.lens is None else display.lens.in_words()),
        ("Pixels per lens", f"{across:.4g}" + ("" if down is None else f" x {down:.4g}")),
        ("Field of view", f"{display.field_of_view:.3g}°"),
        ("Viewing distance", "infinite" if math.isinf(distance) else f"{distance:.4g} mm"),
        ("Scene", provenance.scene),
        ("Method", provenance.method),
        ("Samples per pixel", "" if provenance.spp is None else str(provenance.spp)),
        ("Rays traced", "" if provenance.traced_fraction is None else f"{100 * provenance.traced_fraction:.3g} %"),
        ("Estimated quality", _quality(provenance.estimate)),
        ("Rendered by", provenance.version and f"Lippmann {provenance.version}"),
    ]
    return [[label, text] for label, text in rows if text]


def _quality(estimate: Mapping[str, object] | None) -> str:
    psnr = (estimate or {}).get("psnr")
    return f"{psnr:.1f} dB" if isinstance(psnr, (int, float)) else ""


def _finite(value: float) -> float | None:
    return None if math.isinf(value) else value
