"""Rays of a classic scene's own camera."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from lippmann.scene.classic import ClassicCamera, Handedness


class ClassicCameraRays:
    """Pixels of a picture as the scene's camera sees it, pixel (0, 0) at the top left.

    Samples fill a pixel's square about the point where its first sample lies: the upper right corner (Tachyon) or the
    center. ``handedness`` is the scene's; rays come in the right-handed world, z negated for a left-handed scene.
    """

    def __init__(self, camera: ClassicCamera, handedness: Handedness, width: int, height: int) -> None:
        self.camera = camera
        self.width = width
        self.height = height
        self.channels = 1
        self._flip = -1.0 if handedness == "left" else 1.0

    def rays(self, column: Any, row: Any, channel: Any, jitter: Any) -> Any:
        del channel
        camera = self.camera
        left, right, bottom, top = camera.window(self.width, self.height)
        shift = (0.5, -0.5) if camera.pixel_point == "upper-right" else (0.0, 0.0)
        x = left + (mi.Float64(column) + mi.Float64(jitter.x) + shift[0]) * ((right - left) / self.width)
        y = top - (mi.Float64(row) + mi.Float64(jitter.y) + shift[1]) * ((top - bottom) / self.height)
        across, up, view = (mi.Vector3d(*axis.tolist()) for axis in camera.frame())
        o = mi.Vector3d(*camera.center) + mi.Vector3d(dr.zeros(mi.Float64, dr.width(x)))
        if camera.projection == "orthographic":
            o += across * x + up * y
            d = view + mi.Vector3d(dr.zeros(mi.Float64, dr.width(x)))
        elif camera.projection == "fisheye":
            d = (view * dr.cos(x) + across * dr.sin(x)) * dr.cos(y) + up * dr.sin(y)
        else:
            d = dr.normalize(view + across * x + up * y)
        return mi.Ray3f(mi.Point3f(self._world(o)), mi.Vector3f(self._world(d)))

    def _world(self, v: Any) -> Any:
        return mi.Vector3d(v.x, v.y, v.z * self._flip)
