"""Light that an eye gets through real lenses, as plain values for the viewer: its switch *Real lens* draws by them.

The page weighs sub-pixels as :mod:`lippmann.viewing.optical_replay` does. The eye moves without a server,
so weights of all directions in which the eye may stand are given at once.
"""

from __future__ import annotations

import base64

import numpy as np

from lippmann.display import Display
from lippmann.optics.eye_light import EyeLight, eye_light
from lippmann.optics.lens import Real
from lippmann.viewing.optical_replay import PUPIL
from lippmann.viewing.replay import default_eye

#: The page's eye: so many half widths of the view zone aside, and as near as this share of the usual distance (eye.js).
_ASIDE, _NEAREST = 2.5, 0.25

#: Places are interpolated so much finer than the directions whose weights are known: the page does it linearly.
FINER = 8

#: Largest slope of a direction, 63 degrees aside; the light of more slanting ones is taken for that of these.
_SLOPE = 2.0


def lens_light(display: Display) -> dict[str, object] | None:
    """Light of a display's lenses as types of JSON; None for a display that gives no lens.

    ``slope`` is the largest slope both ways, of which there are ``columns`` across and ``rows`` along the lenses,
    evenly spaced; cylinders are alike both ways along, so that their rows begin at 0. Each has a tile of ``width`` x
    ``height`` weights ``step`` mm apart, see :class:`~lippmann.optics.eye_light.EyeLight`; the places (mm) are those of
    ``finer`` steps between directions. Both are base64: the places of float32, the weights of uint16 codes of which
    65535 means ``largest``. ``cells`` are those of the panel, ``pupil`` is an eye's in mm.
    """
    if display.lens is None:
        return None
    light = light_everywhere(display)
    rows, columns, height, width = light.weights.shape
    largest = float(light.weights.max())
    return {
        "slope": float(light.slopes_x[-1]),
        "columns": columns,
        "rows": rows,
        "width": width,
        "height": height,
        "step": light.step,
        "finer": FINER,
        "places": _base64(finer_places(light).astype("<f4")),
        "largest": largest,
        "weights": _base64(np.rint(light.weights * (65535.0 / largest)).astype("<u2")),
        "cells": [[[list(pair) for pair in cell] for cell in row] for row in display.panel.cells],
        "pupil": PUPIL,
    }


def light_everywhere(display: Display) -> EyeLight:
    """The light of a display with a lens for all places of the page's eye; of cylinders the rows begin at slope 0."""
    slope = _largest_slope(display)
    if display.lens_array.layout == "lenticular":
        halves = (0.0, 0.5 * slope), (0.5 * slope, slope)
        return _join(*(eye_light(display, (-slope, slope), half) for half in halves))
    return eye_light(display, (-slope, slope), (-slope, slope))


def _largest_slope(display: Display) -> float:
    """Slope from the panel's edge to the eye, farthest aside at the usual distance or nearest in the middle."""
    distance, half = default_eye(display)[2], 0.5 * max(display.size_mm)
    aside = _ASIDE * 0.5 * display.micro_image_pitch * display.edge_factor / display.gap
    return min(_SLOPE, max(aside + half / distance, half / (_NEAREST * distance)))


def _join(low: EyeLight, high: EyeLight) -> EyeLight:
    """The light of slopes along cylinders of which ``high`` begins where ``low`` ends."""
    width = max(light.weights.shape[3] for light in (low, high))
    sides = [((width - light.weights.shape[3]) // 2,) * 2 for light in (low, high)]
    weights = [
        np.pad(light.weights, ((0, 0), (0, 0), (0, 0), pad)) for light, pad in zip((low, high), sides, strict=True)
    ]
    return EyeLight(
        low.slopes_x,
        np.concatenate([low.slopes_y, high.slopes_y[1:]]),
        np.concatenate([low.places, high.places[1:]]),
        np.concatenate([weights[0], weights[1][1:]]),
        low.step,
    )


def finer_places(light: EyeLight) -> Real:
    """Middles of the light at :data:`FINER` steps between directions, ``(rows, columns, 2)`` in mm."""
    from scipy.interpolate import RectBivariateSpline

    slopes = (light.slopes_y, light.slopes_x)
    order_y, order_x = (min(3, len(each) - 1) for each in slopes)
    dense = [np.linspace(each[0], each[-1], FINER * (len(each) - 1) + 1) for each in slopes]
    parts = [RectBivariateSpline(*slopes, light.places[..., k], kx=order_y, ky=order_x)(*dense) for k in (0, 1)]
    return np.stack(parts, axis=-1)


def _base64(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
