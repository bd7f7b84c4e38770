"""Diffuse surfaces in the pixels of a picture, and their light in another picture of the same scene.

A diffuse surface has the same radiance from all sides. So its irradiance in one picture, times the albedo in another
one, is the light of the same point there.

The views (micro-images, or those of a quilt's cameras) to either side of a pixel's own ray show its point, or the
nearest that they can show. Each gives a bilinear mean of four pixels. Those of another plane or normal, or of no
diffuse surface, do not count. Light between the points that a picture shows is not known. So it is taken only where
all these pixels agree on it, as codes: then no edge of a shadow lies between them, no highlight, and none of them
shows another surface.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Coding
from lippmann.device.kernel_ops import DEVICE, divide, encode, transform_point, transform_vector, upload
from lippmann.device.types import Array, Bool, Float, MitsubaScene, Normal3f, Point2f, Point3f, Ray3f, UInt32, Vector4f
from lippmann.display.nearby_views import NearbyViews
from lippmann.scene.matrices import inverse, rotation_of

Floats = NDArray[np.float32]
Matrix = NDArray[np.float64]

#: Least cosine between normals of the same surface; mean normals of one pixel that are shorter lie on an edge.
_SAME_NORMAL = 0.97
#: Distance from a surface's plane, as a share of its height, plus a share of the gap.
_OFF_PLANE = 0.02, 0.1
#: That of the point in the middle of a pixel, as a share of it: farther off, other surfaces are mixed in.
_OFF_MIDDLE = 0.25
#: Pixels from the mean of the points that views show to the point itself: it is to lie between them.
_ASIDE = 0.5
#: Largest difference of codes between pixels that agree.
_AGREEMENT = 0.02


class DiffusePixels:
    """What the pixels of a picture show, and which of them show one diffuse surface and nothing of an edge.

    Parameters
    ----------
    scene:
        The scene.
    rays:
        Returns world-space rays by columns, rows, channels (not read) and points in [0, 1)^2 of the pixels.
    frame_from_world:
        ``(4, 4)`` affine map to the picture's frame (mm).
    height, normal:
        ``(H, W)`` z in mm of that frame, and ``(H, W, 3)`` normals along its axes: means of each pixel.
    albedo:
        ``(H, W, C)`` in [0, 1], C 3, or 1 where each pixel shows one colour alone.
    """

    def __init__(
        self,
        scene: MitsubaScene,
        rays: Callable[[UInt32, UInt32, UInt32, Point2f], Ray3f],
        frame_from_world: Matrix,
        height: Floats,
        normal: Floats,
        albedo: Floats,
    ) -> None:
        self._scene, self._rays = scene, rays
        self.frame_from_world = frame_from_world
        self.color = mi.Color3f if albedo.shape[2] == 3 else mi.Color1f
        self._width = dr.opaque(mi.UInt32, albedo.shape[1])
        self._height, self._normal, self.all_albedo = (upload(part) for part in (height, normal, albedo))
        self._rotation = rotation_of(inverse(frame_from_world))[:3]

    def place(self, pixel: UInt32) -> tuple[UInt32, UInt32]:
        """Column and row of pixels by their numbers."""
        row, column = divide(pixel, self._width)
        return column, row

    def ray(self, pixel: UInt32) -> Ray3f:
        """The world-space rays through the centres of pixels."""
        return self._rays(*self.place(pixel), mi.UInt32(0), mi.Point2f(0.5))

    def point(self, pixel: UInt32, ray: Ray3f) -> Point3f:
        """The world-space points that pixels show."""
        origin, direction = (transform_vector(self.frame_from_world[2:3], part)[0] for part in (ray.o, ray.d))
        offset = dr.opaque(mi.Float, self.frame_from_world[2, 3])
        return ray((dr.gather(mi.Float, self._height, pixel) - offset - origin) / direction)

    def normal(self, pixel: UInt32) -> Normal3f:
        """Mean normals of pixels in world space, at most of length 1."""
        return mi.Normal3f(*transform_vector(self._rotation, dr.gather(mi.Normal3f, self._normal, pixel)))

    def albedo(self, pixel: UInt32) -> Array:
        """Albedo of pixels."""
        return dr.gather(self.color, self.all_albedo, pixel)

    def is_diffuse(self, ray: Ray3f, normal: Normal3f, point: Point3f, off_plane: Float) -> Bool:
        """Whether each pixel shows a single surface, which is diffuse and emits no light.

        The middle's hit lies no farther from the plane of the mean point than a share of ``off_plane``, world units.
        """
        si = self._scene.ray_intersect(ray)
        flags = si.bsdf(ray).flags()
        directional = (flags & int(mi.BSDFFlags.Glossy | mi.BSDFFlags.Delta | mi.BSDFFlags.Null)) != 0
        is_dark = dr.max(si.emitter(self._scene).eval(si)) == 0
        is_single = dr.squared_norm(normal) > _SAME_NORMAL**2
        is_single &= dr.abs(dr.dot(normal, si.p - point)) < _OFF_MIDDLE * off_plane
        return si.is_valid() & ~directional & is_dark & is_single


class KeyPicture:
    """A picture whose light the pixels of other pictures of the same scene take.

    Parameters
    ----------
    pixels:
        What it shows.
    colors:
        ``(H, W, C)`` linear, as many channels as the albedo has.
    views:
        Those of the picture.
    step:
        Columns from a pixel to the next of the same colours.
    """

    def __init__(self, pixels: DiffusePixels, colors: Floats, views: NearbyViews, step: int) -> None:
        self._color, self._albedo, self._colors = pixels.color, pixels.all_albedo, upload(colors)
        self._to_frame, self._width = pixels.frame_from_world, colors.shape[1]
        self._views, self._step = views, step
        self._unit = dr.opaque(mi.Float, float(np.linalg.norm(inverse(self._to_frame)[:3, 0])))  # of 1 mm
        pixel = dr.arange(mi.UInt32, colors.shape[0] * colors.shape[1])
        ray, normal = pixels.ray(pixel), pixels.normal(pixel)
        point = pixels.point(pixel, ray)
        is_diffuse = pixels.is_diffuse(
            ray, normal, point, self._find_off_plane(transform_point(self._to_frame, point)[2])
        )
        # No normal of a surface is like the zero of pixels that show no diffuse surface.
        normal = dr.select(is_diffuse, dr.normalize(normal), 0)
        self._planes = dr.ravel(mi.Vector4f(*normal, dr.dot(normal, point)))
        dr.eval(self._planes)

    def irradiance(self, others: DiffusePixels, coding: Coding, pixel: UInt32) -> Vector4f:
        """Light over albedo of other pixels by their numbers, and 1 where it is known, else 0."""
        ray, normal = others.ray(pixel), others.normal(pixel)
        point, albedo = others.point(pixel, ray), others.albedo(pixel)
        to_key = self._to_frame
        in_key = [mi.Float64(value) for value in transform_point(to_key, point)]
        off_plane = self._find_off_plane(mi.Float(in_key[2]))
        is_known = others.is_diffuse(ray, normal, point, off_plane)
        normal = dr.normalize(normal)
        origin, direction = transform_point(to_key, ray.o), transform_vector(to_key, ray.d)
        slopes = [mi.Float64(direction[axis] / -direction[2]) for axis in (0, 1)]
        x, y = (mi.Float64(origin[axis]) + mi.Float64(origin[2]) * slopes[axis] for axis in (0, 1))
        phase = others.place(pixel)[0] % self._step if self._step > 1 else mi.UInt32(0)
        mean, total = self._color(0), mi.Float(0)
        least, most = self._color(dr.inf), self._color(0)
        aside = mi.Vector2f(0)
        for view in self._views.places(x, y, slopes[0], tuple(in_key), DEVICE):
            place, weight = (mi.Float(view.u), mi.Float(view.v)), mi.Float(view.weight)
            inside = mi.Int32(view.left), mi.Int32(view.top), mi.Int32(view.right), mi.Int32(view.bottom)
            is_known, irradiance, low, high = self._mean(place, inside, phase, point, normal, off_plane, is_known)
            least, most = dr.minimum(least, low), dr.maximum(most, high)
            # Else light would move on the surface with each frame that passes it on.
            mean += weight * irradiance
            total += weight
            aside += weight * mi.Vector2f(mi.Float(view.across), mi.Float(view.down))
        is_known &= dr.max(dr.abs(aside)) < _ASIDE * total
        low, high, mean = (mi.Color3f(part if len(part) == 3 else part.x) for part in (least, most, mean / total))
        reflected = mi.Color3f(albedo if len(albedo) == 3 else albedo.x)
        apart = encode(high * reflected, coding) - encode(low * reflected, coding)
        return mi.Vector4f(*mean, dr.select(is_known & (dr.max(apart) < _AGREEMENT), mi.Float(1), 0))

    def _find_off_plane(self, height: Float) -> Float:
        """Largest distance from a surface's plane, world units, at a ``height`` in mm."""
        return (_OFF_PLANE[0] * dr.abs(height) + _OFF_PLANE[1] * self._views.display.gap) * self._unit

    def _mean(
        self,
        place: tuple[Float, Float],
        inside: tuple[Array, Array, Array, Array],
        phase: UInt32,
        point: Point3f,
        normal: Normal3f,
        off_plane: Float,
        active: Bool,
    ) -> tuple[Bool, Array, Array, Array]:
        """Whether any pixels around a place in a view count; their mean, least and largest irradiance."""
        left, top, right, bottom = inside
        step, width = self._step, self._width
        # Colours of their own stand side by side in a pixel.
        u, v = place[0] - 0.5 - (mi.Float(phase) - (step - 1) / 2) / step, place[1] - 0.5
        first_u, first_v = dr.floor(u), dr.floor(v)
        total, light, albedo = mi.Float(0), self._color(0), self._color(0)
        least, most = self._color(dr.inf), self._color(0)
        for across, down in product((0, 1), repeat=2):
            column, row = mi.Int32(first_u) + across, mi.Int32(first_v) + down
            is_there = active & (column >= left) & (column < right) & (row >= top) & (row < bottom)
            there = mi.UInt32(dr.select(is_there, (row * (width // step) + column) * step, 0)) + phase
            *own_normal, offset = dr.gather(mi.Vector4f, self._planes, there, is_there)
            is_same = is_there & (dr.dot(mi.Normal3f(own_normal), normal) > _SAME_NORMAL)
            is_same &= dr.abs(dr.dot(mi.Normal3f(own_normal), mi.Normal3f(point)) - offset) < off_plane
            weight = (1 - dr.abs(u - mi.Float(column))) * (1 - dr.abs(v - mi.Float(row)))
            weight = dr.select(is_same, weight, 0)
            own_light = dr.gather(self._color, self._colors, there, is_same)
            own_albedo = dr.gather(self._color, self._albedo, there, is_same)
            irradiance = own_light / dr.maximum(own_albedo, 1e-6)
            least = dr.select(weight > 0, dr.minimum(least, irradiance), least)
            most = dr.select(weight > 0, dr.maximum(most, irradiance), most)
            total += weight
            light += weight * own_light
            albedo += weight * own_albedo
        return active & (total > 0), light / dr.maximum(albedo, 1e-6), least, most
