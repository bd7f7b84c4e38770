"""Where rays start: one class per kind of picture, all asked the same way for the pixels of a grid."""

from __future__ import annotations

from typing import Any, Protocol

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.render.device_ops import DEVICE
from lippmann.scene.description import Camera

Matrix = NDArray[np.float64]


class RaySource(Protocol):
    """Rays through the pixels of a picture.

    ``channels`` is 1 where a pixel's colours share their rays, 3 where each sub-pixel has its own.
    """

    width: int
    height: int
    channels: int

    def rays(self, column: Any, row: Any, channel: Any, jitter: Any) -> Any:
        """World-space rays (``mi.Ray3f``) through ``jitter`` (Point2f in [0, 1)^2) of the (sub-)pixels named."""
        ...


class DisplayRays:
    """The light lines of a display's pixels, or of its sub-pixels, placed into a scene.

    A pixel's samples fill its square; a sub-pixel's fill a third of its width about the sub-pixel's own place.
    """

    def __init__(self, display: Display, world_from_display: Matrix, subpixels: bool = False) -> None:
        self.display = display
        self.width = display.panel.width
        self.height = display.panel.height
        self.channels = 3 if subpixels else 1
        self.world_from_display = np.asarray(world_from_display, dtype=np.float64)

    def rays(self, column: Any, row: Any, channel: Any, jitter: Any) -> Any:
        u = mi.Float64(column) + mi.Float64(jitter.x)
        v = mi.Float64(row) + mi.Float64(jitter.y)
        if self.channels == 3:
            u = mi.Float64(column) + 0.5 + (mi.Float64(jitter.x) - 0.5) / 3
            x, y = self.display.subpixel_point(u, v, mi.Float64(channel), DEVICE)
        else:
            x, y = self.display.panel_point(u, v, DEVICE)
        origin, direction = self.display.light_ray(x, y, DEVICE)
        return _world_ray(self.world_from_display, origin, direction)


class CameraRays:
    """A pinhole or parallel camera, pixel (0, 0) at the top left."""

    def __init__(self, camera: Camera, width: int, height: int) -> None:
        self.camera = camera
        self.width = width
        self.height = height
        self.channels = 1

    def rays(self, column: Any, row: Any, channel: Any, jitter: Any) -> Any:
        del channel
        x = (mi.Float64(column) + mi.Float64(jitter.x)) * (2 / self.height) - self.width / self.height
        y = 1 - (mi.Float64(row) + mi.Float64(jitter.y)) * (2 / self.height)
        zero = dr.zeros(mi.Float64, dr.width(x))
        if self.camera.fov_y is not None:
            slope = float(np.tan(self.camera.fov_y / 2))
            origin, direction = (zero, zero, zero), (x * slope, y * slope, zero - 1)
        else:
            half = (self.camera.height or 2.0) / 2
            origin, direction = (x * half, y * half, zero), (zero, zero, zero - 1)
        return _world_ray(np.asarray(self.camera.world_from_camera, dtype=np.float64), origin, direction)


def _world_ray(matrix: Matrix, origin: tuple[Any, Any, Any], direction: tuple[Any, Any, Any]) -> Any:
    o = [sum((m * a for m, a in zip(row[:3], origin, strict=True)), mi.Float64(row[3])) for row in matrix[:3].tolist()]
    d = [sum((m * a for m, a in zip(row[:3], direction, strict=True)), mi.Float64(0)) for row in matrix[:3].tolist()]
    length = dr.rsqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    return mi.Ray3f(mi.Point3f(*(mi.Float(a) for a in o)), mi.Vector3f(*(mi.Float(a * length) for a in d)))
