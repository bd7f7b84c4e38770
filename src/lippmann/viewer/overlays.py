"""Layers of a picture (error, samples per pixel, depth, ...) in false colour, for overlays in the viewer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.types import Pixels
from lippmann.color.transfer import quantize
from lippmann.image import Picture
from lippmann.metrics.error_image import BRIGHTEST, SCALE, in_false_color
from lippmann.rendering.estimate.psnr import ERROR_LAYER
from lippmann.rendering.reprojection.point_image import INTERPOLATED, REPROJECTED, STATUS_LAYER, TRACED
from lippmann.viewing.diagnostic_maps import EMPTY_CODE, INTERPOLATED_CODE, REPROJECTED_CODE, TRACED_CODE

Codes = NDArray[np.uint8]
#: Rows and columns of a window.
Part = tuple[slice, slice]

#: Layers of three channels that are displayed as red, green and blue: unit vectors, and reflectances.
_NORMAL, _ALBEDO = "normal", "albedo"

#: Layers of identifiers, which no colour scale can display.
_NO_PICTURE = ("shape",)

#: Origins of pixels: status, label of the legend, colour.
_ORIGINS = (
    (REPROJECTED, "reprojected", REPROJECTED_CODE),
    (TRACED, "traced", TRACED_CODE),
    (INTERPOLATED, "interpolated", INTERPOLATED_CODE),
)

#: Titles of layers in the order of the menu; other layers follow by name.
_TITLES = {
    STATUS_LAYER: "Origin of pixels",
    ERROR_LAYER: "Error",
    "samples": "Samples per pixel",
    "depth": "Depth",
    _NORMAL: "Normals",
    _ALBEDO: "Albedo",
}

_UNITS = {ERROR_LAYER: "RMS, share of full scale", "depth": "mm"}

#: Layers of counts, whose scale begins at zero.
_COUNTS = ("samples",)


@dataclass(frozen=True)
class Overlay:
    """One layer in false colour.

    ``description`` holds plain values for JSON: ``name``, ``title`` and the legend. The legend of a scale is ``range``
    (values at its ends), ``colors`` (``[r, g, b]`` at even steps over the range) and ``unit``; that of a classification
    is ``classes``, a list of ``{"label", "color"}``. A layer whose values are colours has no legend.

    ``codes(part)`` computes the ``(rows, columns, 3)`` uint8 codes of a window.
    """

    description: dict[str, object]
    codes: Callable[[Part], Codes]


def overlays(image: Picture) -> dict[str, Overlay]:
    """Overlays of a picture by layer name, in the order of the menu."""
    order = [name for name in _TITLES if name in image.maps]
    order += sorted(name for name in image.maps if name not in _TITLES and name not in _NO_PICTURE)
    candidates = {name: _overlay(image, name) for name in order}
    return {name: overlay for name, overlay in candidates.items() if overlay is not None}


def _overlay(image: Picture, name: str) -> Overlay | None:
    values = image.maps[name]
    head: dict[str, object] = {"name": name, "title": _TITLES.get(name, name.replace("_", " ").capitalize())}
    if values.ndim == 3:
        return _color_overlay(head, values) if values.shape[2] == 3 else None
    if name == STATUS_LAYER:
        present = [(label, code) for status, label, code in _ORIGINS if (values == status).any()]
        classes = [{"label": label, "color": list(code)} for label, code in present]
        return Overlay({**head, "classes": classes}, lambda part: _origin_codes(values[part]))
    low, high = _range(name, values)
    colors = np.rint(255 * SCALE).astype(int).tolist()
    description = {**head, "range": [low, high], "unit": _UNITS.get(name, ""), "colors": colors}
    # An estimate is a mean squared error, the layer of a comparison its root.
    if name == ERROR_LAYER and image.provenance.method != "error map":
        return Overlay(description, lambda part: _false_color(np.sqrt(np.maximum(values[part], 0)), low, high))
    return Overlay(description, lambda part: _false_color(values[part], low, high))


def _color_overlay(head: dict[str, object], values: Pixels) -> Overlay | None:
    """Overlay of a layer of three channels; None if they have no meaning as colours."""
    if head["name"] == _NORMAL:
        return Overlay(
            head, lambda part: quantize(np.asarray(0.5 + 0.5 * values[part], np.float32), 8, "linear").astype(np.uint8)
        )
    if head["name"] == _ALBEDO:
        return Overlay(head, lambda part: quantize(values[part], 8, "srgb").astype(np.uint8))
    return None


def _range(name: str, values: Pixels) -> tuple[float, float]:
    """Values at the two ends of the scale, never equal."""
    if name == ERROR_LAYER:
        return 0.0, BRIGHTEST
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return 0.0, 1.0
    low, high = 0.0 if name in _COUNTS else float(finite.min()), float(finite.max())
    # Adding 1 may not change a large value.
    return (low, high) if high > low else (low, low + max(1.0, float(np.spacing(abs(low)))))


def _false_color(values: Pixels, low: float, high: float) -> Codes:
    """Codes of ``values`` on the scale from ``low`` to ``high``; values that are not finite get :data:`EMPTY_CODE`."""
    finite = np.isfinite(values)
    places = (np.where(finite, values, low).astype(np.float64) - low) / (high - low)
    codes: Codes = quantize(in_false_color(places), 8, "linear").astype(np.uint8)
    codes[~finite] = EMPTY_CODE
    return codes


def _origin_codes(status: Pixels) -> Codes:
    codes: Codes = np.empty((*status.shape, 3), dtype=np.uint8)
    codes[:] = EMPTY_CODE
    for value, _, code in _ORIGINS:
        codes[status == value] = code
    return codes
