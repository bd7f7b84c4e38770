"""The built-in studio: product-shot light for scenes that bring none."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from types import ModuleType
from typing import Any

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

#: Rows of directions over which its light is summed. Half of them change its brightness by 0.5 %, double by 0.06 %.
HEIGHT = 64

# Radiance of the walls straight down, at the horizon and straight up, before scaling.
_FLOOR, _HORIZON, _CEILING = 0.1, 0.25, 0.35
#: That of a line from floor to ceiling is in proportion to 1 + SLOPE y. Sampled so, the walls' light has a relative
#: variance of 0.003; with half the slope 0.04, with a slope of 0.9 0.07.
SLOPE = (_CEILING - _FLOOR) / (_CEILING + _FLOOR)

# A white diffuse surface that faces the viewer, tilted this much upwards (degrees), comes out at radiance 1.
_CALIBRATION_TILT = 30.0


@dataclass(frozen=True)
class SoftBox:
    """A bright rectangle at infinity: azimuth to the right of the viewer's own direction, elevation, half its width and
    height (degrees), and its radiance before scaling. Its edges fade over a fifth of its half size."""

    azimuth: float
    elevation: float
    half_width: float
    half_height: float
    radiance: float

    @cached_property
    def frame(self) -> NDArray[np.float64]:
        """``(3, 3)``: its middle on a plane at distance 1, and from there the ways to its right and its upper edge."""
        azimuth, elevation = np.radians(self.azimuth), np.radians(self.elevation)
        right = np.array([np.cos(azimuth), 0.0, -np.sin(azimuth)])
        center = np.array([np.sin(azimuth) * np.cos(elevation), np.sin(elevation), np.cos(azimuth) * np.cos(elevation)])
        width, height = np.tan(np.radians([self.half_width, self.half_height]))
        return np.stack([center, right * width, np.cross(center, right) * height])

    @property
    def area(self) -> float:
        """The integral of both fades of :meth:`meet` over that plane."""
        _, right, up = self.frame
        return float((2 * FULL + FADE) ** 2 * np.linalg.norm(right) * np.linalg.norm(up))

    def meet(self, lib: ModuleType, x: Any, y: Any, z: Any) -> tuple[Any, Any, Any]:
        """Where a direction meets that plane: two fades across and along it, and the cosine that it was met at.

        A fade is 1 inside and falls evenly to 0 at the edges, and is 0 behind. Arguments as those of :func:`radiance`.
        """

        def along(axis: NDArray[np.float64]) -> Any:
            return float(axis[0]) * x + float(axis[1]) * y + float(axis[2]) * z

        center, right, up = self.frame
        ahead = lib.maximum(along(center), 1e-6)
        offsets = (lib.abs(along(axis / (axis @ axis)) / ahead) for axis in (right, up))
        across, upwards = (lib.minimum(lib.maximum((1 - offset) / FADE, 0), 1) for offset in offsets)
        return across, upwards, ahead


#: Shares of half a soft box that are evenly bright, and that fade.
FULL, FADE = 0.8, 0.2

BOXES = (
    SoftBox(azimuth=-50.0, elevation=45.0, half_width=22.0, half_height=18.0, radiance=14.0),  # key, on the left
    SoftBox(azimuth=65.0, elevation=15.0, half_width=14.0, half_height=30.0, radiance=1.8),  # fill, on the right
    SoftBox(azimuth=0.0, elevation=80.0, half_width=30.0, half_height=10.0, radiance=3.0),  # overhead
    SoftBox(azimuth=150.0, elevation=25.0, half_width=8.0, half_height=28.0, radiance=10.0),  # rim, from behind
)


@dataclass(frozen=True, eq=False)
class Studio(Environment):
    """The studio with its radiance times ``scale``: renderers evaluate :func:`radiance`, all else takes ``pixels``."""

    scale: float = 1.0

    def brighten(self, factor: float) -> Studio:
        return replace(self, pixels=super().brighten(factor).pixels, scale=self.scale * factor)


def studio_for(scene: SceneDescription) -> Studio:
    """The studio as it lights a scene: brighter before dark models, up to :data:`BRIGHTEST` times.

    A scene whose surfaces are darker than a quarter of white in the mean (:func:`mean_reflectance`) gets as much more
    light, as a photographer would give it; all others get 1.
    """
    reflectance = mean_reflectance(scene)
    if reflectance is None or reflectance >= _DARK:
        return studio()
    return studio(min(BRIGHTEST, round(_DARK / max(reflectance, 1e-3), 2)))


@lru_cache(maxsize=4)
def studio(strength: float = 1.0) -> Studio:
    """Soft boxes on a grey gradient.

    The viewer is taken to look along -z with +y up: the key light hangs over the viewer's left shoulder, the fill on
    the right, one box overhead, a narrow one behind the scene on the right. All light is white. It is scaled so that
    a white diffuse surface facing the viewer and 30 degrees upwards has radiance 1, times ``strength``.
    """
    directions, solid_angles = directions_of(HEIGHT)
    grey = radiance(np, *np.moveaxis(directions, -1, 0))
    tilt = np.radians(_CALIBRATION_TILT)
    cosine = np.maximum(directions @ np.array([0.0, np.sin(tilt), np.cos(tilt)]), 0.0)
    scale = strength * np.pi / float((grey * cosine * solid_angles).sum())
    pixels = np.repeat(scale * grey[..., None], 3, axis=-1).astype(np.float32)
    pixels.setflags(write=False)
    return Studio(pixels, name=NAME, follows_viewer=True, scale=scale)


def radiance(lib: ModuleType, x: Any, y: Any, z: Any) -> Any:
    """Radiance before scaling toward unit directions, in the frame of :func:`studio`.

    ``lib`` is the library of the arrays: NumPy, or Dr.Jit.
    """
    value = shell(lib, y)
    for box in BOXES:
        across, upwards, _ = box.meet(lib, x, y, z)
        both = across * upwards
        value = value + box.radiance * (both * both * (3 - 2 * across) * (3 - 2 * upwards))  # smooth steps
    return value


def shell(lib: ModuleType, up: Any) -> Any:
    """Radiance of the walls before scaling, by the y of unit directions."""
    middle, half = (_CEILING + _FLOOR) / 2 - _HORIZON, (_CEILING - _FLOOR) / 2
    return _HORIZON + (middle + half * lib.sign(up)) * lib.abs(up) ** 0.7


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
