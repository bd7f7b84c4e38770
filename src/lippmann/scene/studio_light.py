"""The built-in studio: product-shot light for scenes that bring none."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.reflectance import mean_reflectance
from lippmann.scene.values.description import Color, Environment, SceneDescription

NAME = "studio"

#: Backdrop of a scene that the studio lights. Even, because a panel shows nothing at infinite depth sharply:
#: the soft boxes themselves would only smear. A middle grey stands apart from black and white objects alike.
BACKDROP: Color = (0.18, 0.18, 0.18)

#: The most by which the studio is brightened for dark models.
BRIGHTEST = 2.5

_DARK = 0.25

_HEIGHT = 256

# Radiance of the walls straight down, at the horizon and straight up, before scaling.
_FLOOR, _HORIZON, _CEILING = 0.1, 0.25, 0.35

# A white diffuse surface that faces the viewer, tilted this much upwards (degrees), comes out at radiance 1.
_CALIBRATION_TILT = 30.0


@dataclass(frozen=True)
class _SoftBox:
    """A bright rectangle at infinity: azimuth to the right of the viewer's own direction, elevation, half its width and
    height (degrees), and its radiance before scaling. Its edges fade over a fifth of its size."""

    azimuth: float
    elevation: float
    half_width: float
    half_height: float
    radiance: float


_BOXES = (
    _SoftBox(azimuth=-50.0, elevation=45.0, half_width=22.0, half_height=18.0, radiance=14.0),  # key, on the left
    _SoftBox(azimuth=65.0, elevation=15.0, half_width=14.0, half_height=30.0, radiance=1.8),  # fill, on the right
    _SoftBox(azimuth=0.0, elevation=80.0, half_width=30.0, half_height=10.0, radiance=3.0),  # overhead
    _SoftBox(azimuth=150.0, elevation=25.0, half_width=8.0, half_height=28.0, radiance=10.0),  # rim, from behind
)


def studio_for(scene: SceneDescription) -> Environment:
    """The studio as it lights a scene: brighter before dark models, up to :data:`BRIGHTEST` times.

    A scene whose surfaces are darker than a quarter of white in the mean (:func:`mean_reflectance`) gets as much more
    light, as a photographer would give it; all others get 1.
    """
    reflectance = mean_reflectance(scene)
    if reflectance is None or reflectance >= _DARK:
        return studio()
    return studio(min(BRIGHTEST, round(_DARK / max(reflectance, 1e-3), 2)))


@lru_cache(maxsize=4)
def studio(strength: float = 1.0) -> Environment:
    """Soft boxes on a grey gradient, as an environment of 512 x 256 texels.

    The viewer is taken to look along -z with +y up: the key light hangs over the viewer's left shoulder, the fill on
    the right, one box overhead, a narrow one behind the scene on the right. All light is white. It is scaled so that
    a white diffuse surface facing the viewer and 30 degrees upwards has radiance 1, times ``strength``.
    """
    directions, solid_angles = directions_of(_HEIGHT)
    up = directions[..., 1]
    towards = np.where(up < 0.0, _FLOOR, _CEILING)
    radiance = _HORIZON + (towards - _HORIZON) * np.abs(up) ** 0.7
    for box in _BOXES:
        radiance += box.radiance * _coverage(box, directions)
    tilt = np.radians(_CALIBRATION_TILT)
    cosine = np.maximum(directions @ np.array([0.0, np.sin(tilt), np.cos(tilt)]), 0.0)
    radiance *= strength * np.pi / (radiance * cosine * solid_angles).sum()
    pixels = np.repeat(radiance[..., None], 3, axis=-1).astype(np.float32)
    pixels.setflags(write=False)
    return Environment(pixels, name=NAME, follows_viewer=True)


def directions_of(height: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit directions ``(height, 2 height, 3)`` and solid angles (sr) of the texels of an environment.

    Row 0 lies at +y and the middle column at -z, ahead of a viewer who looks that way; columns run to the right (+x).
    """
    theta = np.pi * (np.arange(height) + 0.5) / height
    phi = np.pi * (np.arange(2 * height) + 0.5) / height
    sine = np.sin(theta)[:, None]
    directions = np.stack(
        [-sine * np.sin(phi), np.broadcast_to(np.cos(theta)[:, None], (height, 2 * height)), sine * np.cos(phi)],
        axis=-1,
    )
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    solid_angles = np.broadcast_to((edges[:-1] - edges[1:])[:, None] * (np.pi / height), (height, 2 * height))
    return directions, solid_angles


def _coverage(box: _SoftBox, directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coverage of each direction by the box, 0 to 1: its shape on a plane in front of it."""
    azimuth, elevation = np.radians(box.azimuth), np.radians(box.elevation)
    right = np.array([np.cos(azimuth), 0.0, -np.sin(azimuth)])
    center = np.array([np.sin(azimuth) * np.cos(elevation), np.sin(elevation), np.cos(azimuth) * np.cos(elevation)])
    ahead = directions @ center
    safe = np.maximum(ahead, 1e-6)
    across = np.abs(directions @ right) / safe / np.tan(np.radians(box.half_width))
    along = np.abs(directions @ np.cross(center, right)) / safe / np.tan(np.radians(box.half_height))
    coverage: NDArray[np.float64] = np.where(ahead > 0.0, _fade(across) * _fade(along), 0.0)
    return coverage


def _fade(distance: NDArray[np.float64]) -> NDArray[np.float64]:
    """1 inside, 0 outside, smooth from 0.8 to 1 of the half size."""
    t = np.clip((1.0 - distance) / 0.2, 0.0, 1.0)
    smooth: NDArray[np.float64] = t * t * (3.0 - 2.0 * t)
    return smooth
