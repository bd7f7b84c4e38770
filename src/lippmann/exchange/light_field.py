"""Light fields with the axes that most tools use: a grid of views, one per camera.

The axes are ``[t, s, v, u, colour]``: ``t`` counts the cameras from the top, ``s`` from the left, ``v`` the rows of a
view from the top, ``u`` its columns from the left. A lens sends the light of its right-most pixel to the left and that
of its lowest pixel upwards, so ``t`` and ``s`` run opposite to the pixels under a lens.

Values keep the type in which they are stored (codes stay codes), so that a conversion between files is lossless.
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
from lippmann.image.micro_images import Permutation, micro_images_as_views
from lippmann.image.stored_values import Stored, Values
from lippmann.image.views import view_grid, view_shape
from lippmann.runtime.machine import check_input

#: Cameras down and across, rows and columns of a view.
Shape = tuple[int, int, int, int]

#: Limit on pixels of all views together: a light field is held in memory as a whole.
MOST_PIXELS = 1 << 29
#: Least memory of a light field while it is read: colours of one byte.
_BYTES_PER_PIXEL = 3

#: Name of the map with the confidence weight of each value, 0 to 1: the fourth channel of LFToolbox and ESLF.
WEIGHT = "weight"

#: Name of the map with the height over the lens plane of the surface in each pixel, in mm; rendered with layers.
DEPTH = "depth"

#: Bits of the types that hold codes.
CODE_BITS: Mapping[str, int] = {"uint8": 8, "uint16": 16}


@dataclass(frozen=True, eq=False)
class LightField:
    """The views of a grid of cameras.

    Parameters
    ----------
    values:
        ``(t, s, v, u, 3)`` RGB: uint8 or uint16 codes, float16 or float32 linear light.
    metadata:
        Display, placement and provenance; None if the file holds none.
    maps:
        Further layers by name, ``(t, s, v, u)`` or ``(t, s, v, u, 2 to 4)``, float32 or uint32. ``depth`` is the height
        over the lens plane in mm, positive toward the cameras, minus infinity where a ray meets nothing; ``weight``
        lies in [0, 1].
    cameras:
        Baseline, focus distance and placement of the cameras; None if the file holds none.
    mask:
        ``(t, s, v, u)``, True where a value belongs to a pixel of the panel; None if all do.
    notes:
        One sentence for each part of the file that is left out.

    Raises
    ------
    PictureError
        If ``values`` has another shape or type, or more than :data:`MOST_PIXELS` pixels.

    Examples
    --------
    >>> import numpy as np
    >>> from lippmann.plugins import LightField
    >>> LightField(np.zeros((3, 5, 20, 30, 3), np.uint8)).shape
    (3, 5, 20, 30)
    """

    values: Values
    metadata: Metadata | None = None
    maps: Mapping[str, NDArray[np.generic]] = field(default_factory=dict)
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
        return cast("Shape", self.values.shape[:4])

    @property
    def stored(self) -> Stored:
        """Type of the values: ``uint8``, ``uint16``, ``float16`` or ``float32``."""
        return cast("Stored", self.values.dtype.name)

    @property
    def transfer(self) -> Transfer:
        """Transfer function between codes and linear light: that of the metadata, else sRGB."""
        return "srgb" if self.metadata is None else self.metadata.provenance.transfer

    @property
    def weight(self) -> NDArray[np.float32] | None:
        """``(t, s, v, u)`` float32 map ``weight``; None if there is none of this shape and type."""
        weight = self.maps.get(WEIGHT)
        if weight is None or weight.ndim != 4 or weight.dtype != np.float32:
            return None
        return cast("NDArray[np.float32]", weight)

    def image(self, display: Display | None = None, *, where: str = "", layout: str = "") -> IntegralImage:
        """The integral image whose views these are.

        Parameters
        ----------
        display:
            The display of the image. None takes the display of the metadata, else a square micro-lens array that
            matches the cameras.
        where:
            The file that was read: named in messages, its stem is the scene's name in the provenance.
        layout:
            Name of the file's layout, for the provenance.

        Raises
        ------
        PictureError
            If there is no display, or its views differ from these in number or size.
        """
        target = self._display(display, where)
        _check_fit(self.shape, target, where)
        permutation = Permutation(target)

        def join(values: NDArray[Any]) -> NDArray[Any]:
            return np.ascontiguousarray(permutation.join(micro_images_as_views(values[::-1, ::-1], target)))

        pixels = join(self.values)
        linear = dequantize(pixels, self.transfer) if pixels.dtype.kind == "u" else pixels.astype(np.float32)
        maps = {name: join(values) for name, values in self.maps.items()}
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
        rule = f"its display has {across} x {down} pixels under each lens, for its views, and {width} x {height} lenses"
        raise PictureError(what, where=where, rule=rule, fix="describe it in a TOML file, and say display=FILE")

    def _origin(self, scene: str, layout: str) -> tuple[NDArray[np.float64], Provenance]:
        if self.metadata is not None:
            return self.metadata.world_from_display, self.metadata.provenance
        placed = np.eye(4) if self.cameras is None else self.cameras.world_from_display
        options = {"layout": layout} if layout else {}
        return placed, Provenance(method="import", scene=scene, version=VERSION, options=options)


def light_field_of(image: IntegralImage, stored: Stored) -> LightField:
    """The views of an integral image with its metadata and maps: a permutation of its pixels.

    Parameters
    ----------
    image:
        The picture. If its views are resampled (``views_are_exact`` is False), a view here holds the pixels at the same
        position of every micro-image.
    stored:
        Type of the values. Codes are rounded to nearest, with the transfer function of the picture; half floats are
        clipped to their largest finite value.
    """
    display, permutation = image.display, Permutation(image.display)

    def split(values: NDArray[Any]) -> NDArray[Any]:
        return micro_images_as_views(permutation.split(values), display)[::-1, ::-1]

    pixels: NDArray[Any] = image.pixels
    if stored in CODE_BITS:
        pixels = quantize(image.pixels, CODE_BITS[stored], image.provenance.transfer)
    elif stored == "float16":
        largest = float(np.finfo(np.float16).max)
        pixels = np.clip(image.pixels, -largest, largest).astype(np.float16)
    mask = micro_images_as_views(permutation.mask, display)[::-1, ::-1]
    maps = {name: split(values) for name, values in image.maps.items()}
    return LightField(split(pixels), image.metadata, maps, mask=None if mask.all() else mask)


def check_shape(shape: tuple[int, ...], where: str) -> None:
    """Raise :class:`PictureError` unless ``shape`` is ``(t, s, v, u, 3)`` with at most :data:`MOST_PIXELS` pixels."""
    if len(shape) != 5 or shape[4] != 3 or min(shape) < 1:
        rule = "it must be [t, s, v, u, colour] with 3 colours"
        raise PictureError(f"the light field has the shape {shape}", where=where, rule=rule)
    pixels = shape[0] * shape[1] * shape[2] * shape[3]
    if pixels > MOST_PIXELS:
        raise PictureError(f"claims {pixels} pixels", where=where, rule=f"at most {MOST_PIXELS} are read")
    check_input(_BYTES_PER_PIXEL * pixels, f"a light field of {pixels} pixels", where=where)


def check_rectangular(display: Display, layout: str) -> None:
    """Raise :class:`PictureError` unless the display's views are those of a rectangular grid of cameras.

    Excluded are resampled views, hexagonal arrays and slanted sheets, whose rows of lenses are offset from each other.
    ``layout`` names the layout in the message.
    """
    fix = "use 'lippmann export --as zarr', 'lippmann views' or 'lippmann micro-images'"
    if display.lens_array.layout == "hexagonal" or display.lens_array.slant != 0:
        kind = "hexagonal lenses" if display.lens_array.layout == "hexagonal" else "slanted lenses"
        rule = f"{layout} takes lenses in rows and columns"
        raise PictureError(f"the display {display.name} has {kind}", rule=rule, fix=fix)
    if not view_grid(display).exact:
        what = f"the lenses of the display {display.name} cover parts of pixels"
        raise PictureError(what, rule=f"{layout} takes lenses that cover whole pixels", fix=fix)


def _check_fit(shape: Shape, display: Display, where: str) -> None:
    expected = view_shape(display)
    if shape != expected:
        rule = f"the display {display.name} has {_shape_text(expected)}"
        raise PictureError(f"has {_shape_text(shape)}", where=where, rule=rule)


def _shape_text(shape: Shape) -> str:
    return f"{shape[1]} x {shape[0]} views of {shape[3]} x {shape[2]} pixels"


# ---- Weights as a fourth colour ------------------------------------------------------------------------------------


def encode_weights(weight: NDArray[np.float32], dtype: np.dtype[np.generic]) -> Values:
    """Weights in [0, 1] as values of the colours' type: codes rounded to nearest, 1 the highest code; or floats."""
    if dtype.kind == "f":
        return weight.astype(dtype)
    top = np.iinfo(dtype.name).max
    return np.floor(np.clip(weight.astype(np.float64), 0, 1) * top + 0.5).astype(dtype)


def decode_weights(codes: Values) -> NDArray[np.float32]:
    """Weights in [0, 1] of codes or floats; the inverse of :func:`encode_weights`."""
    top = 1.0 if codes.dtype.kind == "f" else np.iinfo(codes.dtype.name).max
    return (codes.astype(np.float64) / top).astype(np.float32)
