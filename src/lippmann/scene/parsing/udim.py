"""Textures in tiles (UDIM): tile 1001 + u + 10 v is the square of texture coordinates u to u + 1, v to v + 1."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.machine import check_input
from lippmann.scene.parsing.files import MissingFileError
from lippmann.scene.parsing.texture_maps import resize, unit
from lippmann.scene.values.description import Image, Matrix

#: What stands in a name for a tile's number, or (MaterialX, Mudbox) for ``u1_v1``.
_MARK = re.compile(r"<UDIM>|%\(UDIM\)d|<UVTILE>", re.IGNORECASE)
_FIRST, _LAST, _ACROSS = 1001, 1100, 10


@dataclass(frozen=True, eq=False)
class TiledImage(Image):
    """Tiles side by side; ``inside`` takes texture coordinates, v downwards, to those of the whole.

    ``numbers`` are those of the tiles that are there.
    """

    inside: Matrix
    numbers: frozenset[int]


def is_tiled(name: str) -> bool:
    """Whether a texture's name means one for each tile."""
    return _MARK.search(name) is not None


def read_tiles(name: str, read: Callable[[Callable[[str], str]], Image]) -> TiledImage:
    """All tiles of a name that are there; ``read`` is given what puts a tile's number into names.

    Raises
    ------
    MissingFileError
        There is none.
    MemoryLimitError
        Together they take more than the memory that is left.
    """
    tiles, missing = {}, None
    for number in range(_FIRST, _LAST + 1):
        try:
            tiles[number] = read(partial(_of_tile, number))
        except MissingFileError as error:
            missing = missing or error
    if not tiles and missing:
        raise missing
    return _joined(name, tiles)


def missing_tiles(image: TiledImage, coordinates: NDArray[np.float64]) -> list[int]:
    """Numbers of the tiles that points ``(n, 2)`` of texture coordinates, v downwards, need and there are not."""
    column, row = np.floor(coordinates * (1.0, -1.0) + (0.0, 1.0)).T
    return sorted({int(number) for number in np.unique(_FIRST + column + _ACROSS * row)} - image.numbers)


def _of_tile(number: int, name: str) -> str:
    """The name of a tile's file."""
    row, column = divmod(number - _FIRST, _ACROSS)
    return _MARK.sub(lambda mark: f"u{column + 1}_v{row + 1}" if "uv" in mark[0].lower() else str(number), name)


def _joined(name: str, tiles: Mapping[int, Image]) -> TiledImage:
    """One image of tiles by their numbers: each as large, and of as many channels, as the largest; black between."""
    places = np.array([divmod(number - _FIRST, _ACROSS) for number in tiles])
    (low, left), (high, right) = places.min(axis=0), places.max(axis=0)
    rows, columns = int(high - low) + 1, int(right - left) + 1
    height, width, channels = np.max([tile.pixels.shape for tile in tiles.values()], axis=0)
    check_input(4 * rows * columns * height * width * channels, f"texture '{name}' in tiles", where=name)
    in_bytes = all(tile.pixels.dtype == np.uint8 for tile in tiles.values())
    pixels = np.zeros((rows, height, columns, width, channels), np.uint8 if in_bytes else np.float32)
    for (row, column), tile in zip(places, tiles.values(), strict=True):
        texels = tile.pixels if in_bytes else unit(tile)
        if texels.shape[2] < channels:  # grey for colours, and opaque
            full = np.full((*texels.shape[:2], channels), 255 if in_bytes else 1.0, texels.dtype)
            full[..., :3] = texels[..., :3]
            texels = full
        if texels.shape[:2] != (height, width):
            planes = [resize(plane.astype(np.float32), (height, width)) for plane in np.moveaxis(texels, 2, 0)]
            texels = np.stack(planes, axis=2) + (0.5 if in_bytes else 0.0)
        pixels[high - row, :, column - left] = texels
    inside = np.array([[1 / columns, 0.0, -left / columns], [0.0, 1 / rows, (rows - 1 + low) / rows], [0.0, 0.0, 1.0]])
    return TiledImage(name, pixels.reshape(rows * height, columns * width, channels), inside, frozenset(tiles))
