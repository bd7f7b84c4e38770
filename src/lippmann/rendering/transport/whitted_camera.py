"""Rays of the camera of a Whitted-style scene."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from lippmann.device.sobol import hash32
from lippmann.device.types import Float64, Point2f, Ray3f, UInt32, Vector3d
from lippmann.rendering.transport.ray_source import OnePicture, opaque
from lippmann.scene.values.whitted_scene import ClassicCamera, Handedness


class WhittedCameraRays(OnePicture):
    """Rays of the camera of a Whitted-style scene; pixel (0, 0) is at the top left.

    Samples fill a square of one pixel about the pixel's reference point: its upper right corner (Tachyon) or its
    centre. With depth of field they also fill the aperture, except for the sample at the reference point.

    Parameters
    ----------
    camera:
        The camera.
    handedness:
        That of the scene. Rays are in the right-handed world: z is negated for a left-handed scene.
    width, height:
        Size of the picture in pixels.
    """

    def __init__(self, camera: ClassicCamera, handedness: Handedness, width: int, height: int) -> None:
        self.camera = camera
        self.width = width
        self.height = height
        self.channels = 1
        self._flip = -1.0 if handedness == "left" else 1.0

    def rays(self, column: UInt32, row: UInt32, channel: UInt32, jitter: Point2f) -> Ray3f:
        """As :meth:`~lippmann.rendering.transport.ray_source.RaySource.rays`."""
        del channel
        camera = self.camera
        left, right, bottom, top = opaque(*camera.window(self.width, self.height))
        width, height, aperture = opaque(self.width, self.height, camera.aperture)
        shift = (0.5, -0.5) if camera.pixel_point == "upper-right" else (0.0, 0.0)
        x = left + (mi.Float64(column) + mi.Float64(jitter.x) + shift[0]) * ((right - left) / width)
        y = top - (mi.Float64(row) + mi.Float64(jitter.y) + shift[1]) * ((top - bottom) / height)
        center, across, up, view = (mi.Vector3d(opaque(*axis)) for axis in (camera.center, *camera.frame()))
        o = center + mi.Vector3d(dr.zeros(mi.Float64, dr.width(x)))
        if camera.projection == "orthographic":
            o += across * x + up * y
            d = view + mi.Vector3d(dr.zeros(mi.Float64, dr.width(x)))
        elif camera.projection == "fisheye":
            d = (view * dr.cos(x) + across * dr.sin(x)) * dr.cos(y) + up * dr.sin(y)
        elif camera.projection == "perspective-dof":
            a, b = _lens_point(column, row, jitter)
            x0, y0 = a * (aperture * (right - left)), b * (aperture * (top - bottom))
            o += across * x0 + up * y0
            d = dr.normalize(view + across * (x - x0) + up * (y - y0))
        else:
            d = dr.normalize(view + across * x + up * y)
        return mi.Ray3f(mi.Point3f(self._world(o)), mi.Vector3f(self._world(d)))

    def _world(self, v: Vector3d) -> Vector3d:
        return mi.Vector3d(v.x, v.y, v.z * self._flip)


def _lens_point(column: UInt32, row: UInt32, jitter: Point2f) -> tuple[Float64, Float64]:
    """Point of the aperture in [-0.5, 0.5)^2, hashed from a pixel and its jitter; 0 where the jitter is 0.5."""
    bits = [dr.reinterpret_array(mi.UInt32, mi.Float(part)) for part in (jitter.x, jitter.y)]
    first = hash32(bits[0] ^ hash32(bits[1] ^ hash32(mi.UInt32(column) ^ hash32(mi.UInt32(row)))))
    middle = (jitter.x == 0.5) & (jitter.y == 0.5)
    a, b = (mi.Float64(number >> 8) * 2.0**-24 - 0.5 for number in (first, hash32(first ^ 0x68BC21EB)))
    return dr.select(middle, 0, a), dr.select(middle, 0, b)
