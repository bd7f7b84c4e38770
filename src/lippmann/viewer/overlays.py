"""What a picture knows of its own pixels, in colours: maps that the page lays over it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import quantize
from lippmann.image import Picture
from lippmann.metrics.error_image import BRIGHTEST, SCALE, in_false_color
from lippmann.rendering.estimate.psnr import ERROR_LAYER
from lippmann.rendering.reprojection.common.point_image import INTERPOLATED, REPROJECTED, STATUS_LAYER, TRACED
from lippmann.viewing.diagnostic_maps import EMPTY_CODE, INTERPOLATED_CODE, REPROJECTED_CODE, TRACED_CODE

Codes = NDArray[np.uint8]
#: Rows and columns of the part that is wanted.
Part = tuple[slice, slice]

#: Layers whose channels are shown as red, green and blue: unit vectors, and reflectances.
_NORMAL, _ALBEDO = "normal", "albedo"

#: Layers that make no picture: numbers that only name something.
_NO_PICTURE = ("shape",)

#: How pixels came about: the status, what people call it, and its colour.
_ORIGINS = (
    (REPROJECTED, "carried over from another lens", REPROJECTED_CODE),
    (TRACED, "missed, then traced", TRACED_CODE),
    (INTERPOLATED, "missed, then averaged", INTERPOLATED_CODE),
)

#: Layers in the order in which they are offered; others follow by name.
_TITLES = {
    STATUS_LAYER: "Missed pixels",
    ERROR_LAYER: "Error",
    "samples": "Samples per pixel",
    "depth": "Depth",
    _NORMAL: "Normals",
    _ALBEDO: "Albedo",
}

_UNITS = {ERROR_LAYER: "of full scale, root mean square", "depth": "mm"}

#: Layers that count something: their scale begins at zero.
_COUNTS = ("samples",)


@dataclass(frozen=True)
class Overlay:
    """One map.

    ``description`` are plain values for the page: ``name``, ``title``, and how to read the colours: ``colors``
    (``[r, g, b]`` at even steps from one end of ``range`` to the other) with a ``unit``, or ``classes``, a list of
    ``{"label", "color"}``; neither where the colours are the values themselves. ``codes(part)`` are the ``(rows,
    columns, 3)`` uint8 codes of a part.
    """

    description: dict[str, Any]
    codes: Callable[[Part], Codes]


def overlays(image: Picture) -> dict[str, Overlay]:
    """The maps of a picture by name: where its pixels came from, its error, and other layers of numbers."""
    order = [name for name in _TITLES if name in image.maps]
    order += sorted(name for name in image.maps if name not in _TITLES and name not in _NO_PICTURE)
    found = {name: _overlay(image, name) for name in order}
    return {name: overlay for name, overlay in found.items() if overlay is not None}


def _overlay(image: Picture, name: str) -> Overlay | None:
    values = image.maps[name]
    head = {"name": name, "title": _TITLES.get(name, name.replace("_", " ").capitalize())}
    if values.ndim == 3:
        return _picture(head, values) if values.shape[2] == 3 else None
    if name == STATUS_LAYER:
        present = [(label, code) for status, label, code in _ORIGINS if (values == status).any()]
        classes = [{"label": label, "color": list(code)} for label, code in present]
        return Overlay(head | {"classes": classes}, lambda part: _origin_codes(values[part]))
    low, high = _range(name, values)
    colors = np.rint(255 * SCALE).astype(int).tolist()
    description = head | {"range": [low, high], "unit": _UNITS.get(name, ""), "colors": colors}
    # Estimates hold mean squared errors, the map of a comparison holds their roots.
    if name == ERROR_LAYER and image.provenance.method != "error map":
        return Overlay(description, lambda part: _scaled(np.sqrt(np.maximum(values[part], 0)), low, high))
    return Overlay(description, lambda part: _scaled(values[part], low, high))


def _picture(head: dict[str, Any], values: NDArray[Any]) -> Overlay | None:
    """A layer whose channels are colours, or can stand for them."""
    if head["name"] == _NORMAL:
        return Overlay(
            head, lambda part: quantize(np.asarray(0.5 + 0.5 * values[part], np.float32), 8, "linear").astype(np.uint8)
        )
    if head["name"] == _ALBEDO:
        return Overlay(head, lambda part: quantize(values[part], 8, "srgb").astype(np.uint8))
    return None


def _range(name: str, values: NDArray[Any]) -> tuple[float, float]:
    """The values at the ends of the scale; different ones, so that it has a length."""
    if name == ERROR_LAYER:
        return 0.0, BRIGHTEST
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return 0.0, 1.0
    low, high = 0.0 if name in _COUNTS else float(finite.min()), float(finite.max())
    # 1 is lost in numbers of 17 digits.
    return (low, high) if high > low else (low, low + max(1.0, float(np.spacing(abs(low)))))


def _scaled(values: NDArray[Any], low: float, high: float) -> Codes:
    """``values`` by their place between ``low`` and ``high``; those that are not finite in a colour of their own."""
    there = np.isfinite(values)
    places = (np.where(there, values, low).astype(np.float64) - low) / (high - low)
    codes: Codes = quantize(in_false_color(places), 8, "linear").astype(np.uint8)
    codes[~there] = EMPTY_CODE
    return codes


def _origin_codes(status: NDArray[Any]) -> Codes:
    codes: Codes = np.empty((*status.shape, 3), dtype=np.uint8)
    codes[:] = EMPTY_CODE
    for value, _, code in _ORIGINS:
        codes[status == value] = code
    return codes
