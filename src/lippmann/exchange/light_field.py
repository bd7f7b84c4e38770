"""A light field as other tools hold it: rows and columns of views, seen from a grid of cameras.

The axes are those of most of them, ``[t, s, v, u, colour]``: ``t`` counts the cameras from the top, ``s`` from the
left, ``v`` the rows of a view from the top, ``u`` its columns from the left. A lens shows the pixel at its right end to
the left and the one at its lower end upwards, so ``t`` and ``s`` run against the pixels under a lens.

Values stay as they are stored, codes as codes, so that nothing is lost on the way from file to file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from lippmann._version import VERSION
from lippmann.color.transfer import Transfer, dequantize, quantize
from lippmann.display import Display
from lippmann.errors import PictureError
from lippmann.exchange.cameras import Cameras
from lippmann.image import IntegralImage, Metadata, Provenance
from lippmann.image.metadata import metadata_of
from lippmann.image.micro_images import Permutation, micro_images_as_views
from lippmann.image.stored_values import Stored
from lippmann.image.views import view_grid

#: Cameras down and across, rows and columns of a view.
Shape = tuple[int, int, int, int]

#: More pixels than any light field has that other tools hold; all of one is in memory at once.
MOST_PIXELS = 1 << 29

#: The map of an integral image that holds the weight of each value, 1 for full: LFToolbox's fourth channel.
WEIGHT = "weight"

#: The map that holds the height over the lens plane of what each pixel sees, as ``lippmann render --layers`` makes it.
DEPTH = "depth"

_BITS = {"uint8": 8, "uint16": 16}


@dataclass(frozen=True, eq=False)
class LightField:
    """Views of a grid of cameras.

    Parameters
    ----------
    values:
        ``(t, s, v, u, 3)`` RGB: uint8 or uint16 codes, float16 or float32 linear light.
    metadata:
        Display, placement and provenance, where the file says them.
    maps:
        Further layers by name, ``(t, s, v, u)`` or ``(t, s, v, u, 2 to 4)``, float32 or uint32. ``depth`` is the height
        over the lens plane in mm, positive toward the cameras, minus infinity where nothing is seen; ``weight`` lies
        between 0 and 1.
    cameras:
        Where the cameras stand, where the file says it.
    mask:
        ``(t, s, v, u)``: which values stand for a pixel of the panel; None if all do.
    notes:
        What was found but is not taken along, as sentences.

    Raises
    ------
    PictureError
        If shapes or types are not as said above.
    """

    values: NDArray[Any]
    metadata: Metadata | None = None
    maps: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    cameras: Cameras | None = None
    mask: NDArray[np.bool_] | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_shape(self.values.shape, "")
        if self.values.dtype not in (np.uint8, np.uint16, np.float16, np.float32):
            rule = "it must hold codes of 8 or 16 bits or floats of 16 or 32"
            raise PictureError(f"the light field holds {self.values.dtype}", rule=rule)

    @property
    def shape(self) -> Shape:
        """Cameras down and across, rows and columns of a view."""
        return cast(Shape, self.values.shape[:4])

    @property
    def stored(self) -> Stored:
        """The type of the values."""
        return cast(Stored, self.values.dtype.name)

    @property
    def transfer(self) -> Transfer:
        """How codes stand for linear light."""
        return "srgb" if self.metadata is None else self.metadata.provenance.transfer

    @property
    def weight(self) -> NDArray[np.float32] | None:
        """The map ``weight``, if there is one with one float a value."""
        found = self.maps.get(WEIGHT)
        return found if found is not None and found.ndim == 4 and found.dtype == np.float32 else None

    def image(self, display: Display | None = None, *, where: str = "", layout: str = "") -> IntegralImage:
        """The integral image that shows these views.

        Parameters
        ----------
        display:
            The display, instead of the one that the file names or that its cameras describe.
        where, layout:
            The file, for messages and as the scene's name, and its layout, for the provenance.

        Raises
        ------
        PictureError
            If there is no display, or its views are not as many or not of this size.
        """
        target = self._display(display, where)
        _check_fit(self.shape, target, where)
        permutation = Permutation(target)

        def joined(values: NDArray[Any]) -> NDArray[Any]:
            return np.ascontiguousarray(permutation.join(micro_images_as_views(values[::-1, ::-1], target)))

        pixels = joined(self.values)
        linear = dequantize(pixels, self.transfer) if pixels.dtype.kind == "u" else pixels.astype(np.float32)
        maps = {name: joined(values) for name, values in self.maps.items()}
        world_from_display, provenance = self._origin(Path(where).stem, layout)
        try:
            return IntegralImage(linear, target, world_from_display, provenance, maps, stored=self.stored)
        except PictureError as error:
            raise PictureError(error.what, where=where, rule=error.rule, fix=error.fix) from error

    def _display(self, display: Display | None, where: str) -> Display:
        if display is not None:
            return display
        if self.metadata is not None:
            return self.metadata.display
        down, across, height, width = self.shape
        if self.cameras is not None and down == across:
            return self.cameras.display(across, width, height, where=where)
        what = "has no display in it" if self.cameras is None else f"has {across} x {down} views, of unlike number"
        fix = f"say --display, with {across} x {down} pixels per lens and {width} x {height} lenses"
        raise PictureError(what, where=where, fix=fix)

    def _origin(self, scene: str, layout: str) -> tuple[NDArray[np.float64], Provenance]:
        if self.metadata is not None:
            return self.metadata.world_from_display, self.metadata.provenance
        placed = np.eye(4) if self.cameras is None else self.cameras.world_from_display
        options = {"layout": layout} if layout else {}
        return placed, Provenance(method="import", scene=scene, version=VERSION, options=options)


def light_field_of(image: IntegralImage, stored: Stored) -> LightField:
    """The views of an integral image, on any display a permutation of its pixels, with its metadata and maps.

    ``stored`` says what the values become: codes are rounded to the nearest, after the picture's own transfer. On
    displays whose views are not exact these are the pixels of equal place in their micro-images.
    """
    display, permutation = image.display, Permutation(image.display)

    def split(values: NDArray[Any]) -> NDArray[Any]:
        return micro_images_as_views(permutation.split(values), display)[::-1, ::-1]

    pixels: NDArray[Any] = image.pixels
    if stored in _BITS:
        pixels = quantize(image.pixels, _BITS[stored], image.provenance.transfer)
    elif stored == "float16":
        largest = float(np.finfo(np.float16).max)
        pixels = np.clip(image.pixels, -largest, largest).astype(np.float16)
    mask = micro_images_as_views(permutation.mask, display)[::-1, ::-1]
    maps = {name: split(values) for name, values in image.maps.items()}
    return LightField(split(pixels), metadata_of(image), maps, mask=None if mask.all() else mask)


def check_shape(shape: tuple[int, ...], where: str) -> None:
    """Raise :class:`PictureError` if no light field in colour has this shape, before memory is given to it."""
    if len(shape) != 5 or shape[4] != 3 or min(shape) < 1:
        rule = "it must be [t, s, v, u, colour] with 3 colours"
        raise PictureError(f"the light field has the shape {shape}", where=where, rule=rule)
    pixels = shape[0] * shape[1] * shape[2] * shape[3]
    if pixels > MOST_PIXELS:
        raise PictureError(f"claims {pixels} pixels", where=where, rule=f"at most {MOST_PIXELS} are read")


def check_rectangular(display: Display, layout: str) -> None:
    """Raise :class:`PictureError` unless the views are what a rectangular grid of cameras sees.

    They are not where views are resampled, and where neighbouring rows of a view stand beside each other: hexagonal
    arrays, slanted sheets.
    """
    fix = "use 'lippmann export --as zarr', 'lippmann views' or 'lippmann micro-images'"
    if display.lens_array.layout == "hexagonal" or display.lens_array.slant != 0:
        kind = "hexagonal lenses" if display.lens_array.layout == "hexagonal" else "slanted lenses"
        rule = f"{layout} takes lenses in rows and columns"
        raise PictureError(f"the display {display.name} has {kind}", rule=rule, fix=fix)
    if not view_grid(display).exact:
        rule = f"{layout} takes lenses that cover whole pixels"
        raise PictureError(f"the lenses of the display {display.name} do not", rule=rule, fix=fix)


def view_shape(display: Display) -> Shape:
    """The shape of the light field of a display's pictures."""
    rows, columns, ny, nx = Permutation(display).shape
    return (1, nx, ny, columns) if display.lens_array.layout == "lenticular" else (ny, nx, rows, columns)


def _check_fit(shape: Shape, display: Display, where: str) -> None:
    wanted = view_shape(display)
    if shape != wanted:
        rule = f"the display {display.name} has {_in_words(wanted)}"
        raise PictureError(f"has {_in_words(shape)}", where=where, rule=rule)


def _in_words(shape: Shape) -> str:
    return f"{shape[1]} x {shape[0]} views of {shape[3]} x {shape[2]} pixels"
