"""Light sources and local shading in the classic models: ambient, diffuse, highlights, hard shadows, sky light."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.device.kernel_ops import upload
from lippmann.device.sobol import SampleStream
from lippmann.device.syntax import syntax
from lippmann.device.types import Bool, Color3f, Float, Point3f, UInt32, Vector3f
from lippmann.device.whitted.geometry import FAR, Geometry, Surface
from lippmann.device.whitted.intersections import xyz
from lippmann.device.whitted.materials import LEAST, Finish, MaterialTable
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_surfaces import AmbientOcclusion, ClassicLight

#: First sample dimension of sky light; those below place the sample in its pixel and lens.
_SKY_DIMENSION = 8


@dataclass
class Illumination:
    """Light from one source at a point: unit direction ``toward`` it, its ``distance``, its ``strength`` there."""

    toward: Vector3f
    distance: Float
    strength: Float
    color: Color3f


class LightTable:
    """The light sources of a scene, as one table on the device."""

    def __init__(self, lights: Sequence[ClassicLight]) -> None:
        self.count = len(lights)
        rows = [_light_row(light) for light in lights] or [[0.0] * 16]
        self._rows = upload(np.array(rows, np.float32))
        self._directional = any(light.kind == "directional" for light in lights)
        self._attenuated = any(light.attenuation is not None for light in lights)
        self._spots = any(light.kind == "spot" for light in lights)

    def color(self, index: UInt32, active: Bool) -> Color3f:
        """Colour of the visible sphere of a light source."""
        return mi.Color3f(xyz(dr.gather(mi.Vector4f, self._rows, 4 * index + 1, active)))

    def illuminate(self, index: UInt32, p: Point3f, n: Vector3f) -> Illumination:
        """Illumination of ``p`` by a light source; its strength includes the cosine to ``n`` and may be negative."""
        a = dr.gather(mi.Vector4f, self._rows, 4 * index)
        b = dr.gather(mi.Vector4f, self._rows, 4 * index + 1)
        toward = xyz(a) - p
        distance = dr.norm(toward)
        toward *= dr.rcp(distance)
        if self._directional or self._spots:
            c = dr.gather(mi.Vector4f, self._rows, 4 * index + 2)
        if self._directional:
            directional = a.w > 0
            toward = dr.select(directional, -xyz(c), toward)
            distance = dr.select(directional, FAR, distance)
        strength = dr.dot(n, toward)
        if self._attenuated or self._spots:
            d = dr.gather(mi.Vector4f, self._rows, 4 * index + 3)
        if self._attenuated:
            reached = mi.Float(distance)
            if self._directional:
                reached = dr.select(directional, 0, reached)
            strength *= dr.rcp(d.x + (d.y + d.z * reached) * reached)
        if self._spots:
            angle = dr.safe_acos(dr.dot(-xyz(c), toward))
            start, end = c.w, d.w
            inside = 1 - (angle - start) / (end - start)
            strength *= dr.select(angle > start, dr.select(angle > end, 0, inside), 1)
        return Illumination(toward, distance, strength, mi.Color3f(xyz(b)))


class Shader:
    """The local part of the light models: everything but mirrored and transmitted rays."""

    def __init__(self, scene: ClassicScene, geometry: Geometry, lights: LightTable, materials: MaterialTable) -> None:
        self._geometry = geometry
        self._lights = lights
        self._materials = materials
        self._shading = scene.shading
        self._shadows = scene.shading.mode == "full"
        self._sky: AmbientOcclusion | None = scene.ambient_occlusion if self._shadows else None

    def light(
        self,
        surface: Surface,
        finish: Finish,
        color: Color3f,
        d: Vector3f,
        stream: SampleStream,
        hits: UInt32,
        active: Bool,
    ) -> tuple[Color3f, Bool, UInt32]:
        """Colour that the surface sends back along -``d`` by itself, whether a highlight is in it, and shadow rays."""
        diffuse, highlight, shadow = self._direct_light(surface, finish, color, d, active)
        if self._sky is not None:
            share, rays = self._open_sky(self._sky.samples, surface, stream, hits, active & self._sees_light(finish))
            diffuse += mi.Color3f(*self._sky.color) * share
            shadow += rays
        factor = finish.diffuse
        if self._materials.outlined:
            factor *= dr.select(finish.outline > 0, _outline(surface, finish, d), 1)
        result = color * (diffuse * factor + finish.ambient)
        shines = mi.Bool(False)
        if self._materials.shines:
            result += highlight
            shines = dr.max(highlight) > 0
        return result, shines, shadow

    def _sees_light(self, finish: Finish) -> Bool:
        return (finish.diffuse > LEAST) | (finish.phong > LEAST)

    @syntax
    def _direct_light(
        self, surface: Surface, finish: Finish, color: Color3f, d: Vector3f, active: Bool
    ) -> tuple[Color3f, Color3f, UInt32]:
        diffuse, highlight, shadow = mi.Color3f(0), mi.Color3f(0), mi.UInt32(0)
        index = mi.UInt32(0)
        p, n, face, lift = surface.p, surface.n, surface.face, surface.lift
        phong, phong_size, metal = finish.phong, finish.phong_size, finish.metal
        active = active & self._sees_light(finish)
        while dr.hint(active & (index < self._lights.count), label="lights"):
            light = self._lights.illuminate(index, p, n)
            strength = light.strength * self._shading.light_scale
            lit = strength > LEAST
            if dr.hint(self._shadows, mode="scalar"):
                start = p + face * dr.copysign(lift, dr.dot(face, light.toward))
                passes = self._geometry.passing(start, light.toward, light.distance, lit, index)
                shadow += dr.select(lit, mi.UInt32(1), mi.UInt32(0))
                lit &= passes > 0
                strength *= passes
            diffuse += dr.select(lit, light.color * strength, 0)
            if dr.hint(self._materials.shines, mode="scalar"):
                shines = lit & (phong > LEAST)
                tint = dr.select(metal, color, light.color) if self._materials.metal else light.color
                peak = self._peak(light.toward, n, d, phong_size) * (phong * self._shading.light_scale)
                highlight += dr.select(shines, tint * peak, 0)
            index += 1
        return diffuse, highlight, shadow

    def _peak(self, toward: Vector3f, n: Vector3f, d: Vector3f, exponent: Float) -> Float:
        """Shape of a highlight, 0 to 1."""
        if self._shading.highlight == "phong":
            mirrored = n * (2 * dr.dot(n, toward)) - toward
            cosine = -dr.dot(mirrored, d)
            return dr.select(cosine > 0, dr.power(dr.maximum(cosine, 0), exponent), 0)
        half = toward - d
        cosine = dr.dot(n, half)
        return dr.select(cosine > LEAST, dr.power(dr.maximum(cosine, 0) * dr.rsqrt(dr.dot(half, half)), exponent), 0)

    @syntax
    def _open_sky(
        self, samples: int, surface: Surface, stream: SampleStream, hits: UInt32, active: Bool
    ) -> tuple[Float, UInt32]:
        """Twice the mean of the cosine over the half sphere, where it is open; shadow rays."""
        total, shadow, number = mi.Float(0), mi.UInt32(0), mi.UInt32(0)
        p, n, face, lift = surface.p, surface.n, surface.face, surface.lift
        while dr.hint(active & (number < samples), label="sky light"):
            point = stream.next_2d(_SKY_DIMENSION + hits * samples + number)
            d = mi.warp.square_to_uniform_sphere(point)
            cosine = dr.dot(d, n)
            d = mi.Vector3f(dr.mulsign(d, cosine))
            start = p + face * dr.copysign(lift, dr.dot(face, d))
            total += dr.abs(cosine) * self._geometry.passing(start, d, mi.Float(FAR), active)
            shadow += 1
            number += 1
        return total * (2 / samples), shadow


def _outline(surface: Surface, finish: Finish, d: Vector3f) -> Float:
    """Factor that darkens diffuse light toward silhouettes."""
    edge = dr.maximum(1 - dr.square(dr.dot(surface.n, d)), 0)
    share = 1 - dr.power(edge, (1 - finish.outline_width) * 32)
    return 1 - finish.outline + share * finish.outline


def _light_row(light: ClassicLight) -> list[float]:
    """Center, directional | color, - | direction, start of the falloff | attenuation, end of the falloff."""
    spot = light.kind == "spot"
    start, end = (radians(light.falloff_start), radians(light.falloff_end)) if spot else (4.0, 5.0)
    return [
        *light.center,
        float(light.kind == "directional"),
        *light.color,
        0.0,
        *light.direction,
        start,
        *(light.attenuation or (1.0, 0.0, 0.0)),
        end,
    ]
