"""The built-in studio as a Mitsuba emitter, evaluated and sampled in closed form.

As a picture it would be the largest table of most kernels: looking it up took a fifth of their time.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.device.types import (
    Bool,
    BoundingBox3f,
    Color3f,
    DirectionSample3f,
    Emitter,
    Float,
    Interaction3f,
    Point2f,
    Properties,
    SurfaceInteraction3f,
    Vector3f,
)
from lippmann.scene import studio_light

#: Distance of what lights from infinity, in units of the scene: Mitsuba tells no emitter in Python how large that is.
#: Shadow rays go so far, beyond all that a scene holds; double and half give the same picture.
_BEYOND = 1e12


def studio_emitter(scale: float, to_world: Any) -> Emitter:
    """The studio with its radiance times ``scale``.

    ``to_world`` is a ``mi.ScalarTransform4f``, as that of Mitsuba's ``envmap``.
    """
    import mitsuba as mi

    return _emitter_class(mi.variant())(mi.Properties("lippmann_studio"), scale, to_world)


@functools.cache
def _emitter_class(variant: str) -> type[Emitter]:
    """The plugin class of one variant: Mitsuba's base classes differ between them."""
    import drjit as dr
    import mitsuba as mi

    assert variant == mi.variant()
    boxes = studio_light.BOXES
    slope = studio_light.SLOPE
    shares = _shares()
    starts = [float(start) for start in np.cumsum(shares) - shares]

    class StudioEmitter(mi.Emitter):  # type: ignore[misc, unused-ignore]
        """Directions are sampled from the soft boxes and from the walls, each by its share of the light."""

        def __init__(self, props: Properties, scale: float, to_world: Any) -> None:
            super().__init__(props)
            self.m_flags = mi.EmitterFlags.Infinite | mi.EmitterFlags.SpatiallyVarying
            self.built_scale, self.scale = dr.opaque(mi.Float, scale), dr.opaque(mi.Float, 1)
            self.to_world = mi.Transform4f(to_world.matrix)
            dr.make_opaque(self.to_world)

        def traverse(self, callback: Any) -> None:
            callback.put("scale", self.scale, mi.ParamFlags.Differentiable)
            callback.put("to_world", self.to_world, mi.ParamFlags.NonDifferentiable)

        def parameters_changed(self, keys: Sequence[str] = ()) -> None:
            dr.make_opaque(self.scale, self.to_world)

        def eval(self, si: SurfaceInteraction3f, active: Bool = True) -> Color3f:
            return self._radiance(self._to_studio(-si.wi)) & active

        def sample_direction(
            self, it: Interaction3f, sample: Point2f, active: Bool = True
        ) -> tuple[DirectionSample3f, Color3f]:
            del active
            start, share, frame = mi.Float(starts[0]), mi.Float(float(shares[0])), boxes[0].frame
            center, right, up = (mi.Vector3f(*part.tolist()) for part in frame)
            for box, first, its_share in zip(boxes[1:], starts[1:], shares[1:], strict=False):
                is_here = sample.x >= first
                start, share = dr.select(is_here, first, start), dr.select(is_here, float(its_share), share)
                center, right, up = (
                    dr.select(is_here, mi.Vector3f(*part.tolist()), before)
                    for part, before in zip(box.frame, (center, right, up), strict=True)
                )
            on_shell = sample.x >= starts[-1]
            start, share = dr.select(on_shell, starts[-1], start), dr.select(on_shell, float(shares[-1]), share)
            point = mi.Point2f((sample.x - start) / share, sample.y)
            in_box = dr.normalize(center + right * _sample_fade(point.x) + up * _sample_fade(point.y))
            d = dr.select(on_shell, _on_shell(point), in_box)

            ds = dr.zeros(mi.DirectionSample3f)
            ds.d = self.to_world @ mi.Vector3f(-d.x, d.y, -d.z)
            ds.dist = mi.Float(_BEYOND)
            ds.p, ds.n = it.p + ds.d * ds.dist, mi.Normal3f(-ds.d)
            ds.time, ds.pdf, ds.emitter = it.time, _pdf(d), mi.EmitterPtr(self)
            return ds, self._radiance(d) / ds.pdf

        def pdf_direction(self, it: Interaction3f, ds: DirectionSample3f, active: Bool = True) -> Float:
            del it
            return _pdf(self._to_studio(ds.d)) & active

        def eval_direction(self, it: Interaction3f, ds: DirectionSample3f, active: Bool = True) -> Color3f:
            del it
            return self._radiance(self._to_studio(ds.d)) & active

        def bbox(self) -> BoundingBox3f:
            return mi.BoundingBox3f()

        def to_string(self) -> str:
            return "StudioEmitter[]"

        def _to_studio(self, d: Vector3f) -> Vector3f:
            m = self.to_world.matrix  # a rotation
            x, y, z = (m[0, axis] * d.x + m[1, axis] * d.y + m[2, axis] * d.z for axis in range(3))
            return mi.Vector3f(-x, y, -z)

        def _radiance(self, d: Vector3f) -> Color3f:
            return mi.Color3f(studio_light.radiance(dr, d.x, d.y, d.z) * (self.built_scale * self.scale))

    def _pdf(d: Vector3f) -> Float:
        pdf = float(shares[-1] / (4 * np.pi)) * (1 + slope * d.y)
        for box, share in zip(boxes, shares, strict=False):
            across, upwards, ahead = box.meet(dr, d.x, d.y, d.z)
            pdf += float(share / box.area) * across * upwards / (ahead * ahead * ahead)
        return pdf

    def _on_shell(point: Point2f) -> Vector3f:
        """A direction whose density is linear in its y, as the brightness of the walls nearly is."""
        y = (dr.sqrt((1 - slope) ** 2 + 4 * slope * point.x) - 1) / slope
        sine, cosine = dr.sincos(2 * np.pi * point.y)
        radius = dr.safe_sqrt(1 - y * y)
        return mi.Vector3f(radius * cosine, y, radius * sine)

    def _sample_fade(number: Float) -> Float:
        """A place in [-1, 1] whose density is that of a box's fade, from a number in [0, 1)."""
        full, fade = studio_light.FULL, studio_light.FADE
        mean = full + fade / 2
        signed = 2 * number - 1
        size = dr.abs(signed)
        edge = 1 - dr.sqrt(2 * fade * mean * (1 - size))
        return dr.select(size * mean < full, signed * mean, dr.copysign(edge, signed))

    return StudioEmitter


def _shares() -> NDArray[np.float64]:
    """Shares of the light of each box, and last of the walls."""
    directions, solid_angles = studio_light.directions_of(studio_light.HEIGHT)
    x, y, z = np.moveaxis(directions, -1, 0)
    walls = (studio_light.shell(np, y) * solid_angles).sum()
    fluxes = []
    for box in studio_light.BOXES:
        across, upwards, _ = box.meet(np, x, y, z)
        fluxes.append(box.radiance * (across * upwards * solid_angles).sum())
    shares: NDArray[np.float64] = np.array([*fluxes, walls]) / (sum(fluxes) + walls)
    return shares
