"""What a ray sees, apart from light: the first surface, and the first one that is not a mirror or clear glass.

The first is the truth that layers tell; the second is what a denoiser wants to know, for the edges in a mirror are
those of the things that it shows. Both speak of world space.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.device.whitted.background_fog import background_color
from lippmann.device.whitted.geometry import NONE
from lippmann.device.whitted.scene import BuiltClassic
from lippmann.rendering.transport.path import MAX_CROSSINGS

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene

#: A surface that lets more than this share of the light straight through is looked through.
SEEN_THROUGH = 0.5
#: Mirrors and panes that one ray is followed along.
MOST_FOLLOWED = 8
#: How far away (in units of the scene) the sky is.
FAR_AWAY = 1e6
#: Sample that draws the middle of a lobe, on the near side of the half at which partly opaque surfaces count as there.
_MIDDLE = 0.49


@dataclass
class Seen:
    """A surface where a ray meets it, all 0 where ``hit`` is False.

    ``p`` is the point, ``n`` the unit normal that light is scattered by, on the side that the ray comes from;
    ``albedo`` the reflectance in [0, 1]; ``shape`` (UInt32) the number of the shape.
    """

    hit: Any
    p: Any
    n: Any
    albedo: Any
    shape: Any


class Surfaces(Protocol):
    """The surfaces of one scene on the device."""

    def first(self, ray: Any, active: Any) -> Seen:
        """What the ray meets first."""
        ...

    def guide(self, ray: Any, active: Any) -> tuple[Any, Any, Any]:
        """Albedo (or, of what glows, colour) in [0, 1] and normal of what a denoiser should know the pixel by.

        And how far light has come from there, as multiples of the ray's direction: :data:`FAR_AWAY` from nowhere.
        """
        ...


def surfaces_of(built: BuiltScene | BuiltClassic) -> Surfaces:
    """The surfaces of a built scene."""
    return ClassicSurfaces(built) if isinstance(built, BuiltClassic) else PhysicalSurfaces(built)


class PhysicalSurfaces:
    """Surfaces of a Mitsuba scene; ``shape`` counts ``mi.Scene.shapes()``."""

    def __init__(self, built: BuiltScene) -> None:
        self._scene = built.mitsuba
        self._background = built.background
        self._has_null = built.has_null
        pointers = np.array(dr.reinterpret_array(mi.UInt32, self._scene.shapes_dr()))
        numbers = np.zeros(int(pointers.max()) + 1, dtype=np.uint32)
        numbers[pointers] = np.arange(len(pointers))
        self._numbers = mi.UInt32(numbers)

    def first(self, ray: Any, active: Any) -> Seen:
        ray = mi.Ray3f(ray)
        pi = self._scene.ray_intersect_preliminary(ray, coherent=True, active=active)
        if self._has_null:
            ray, pi = self._past_openings(ray, pi)
        si = pi.compute_surface_interaction(ray, mi.RayFlags.All)
        hit = active & si.is_valid()
        bsdf = si.bsdf(ray)
        placed = dr.reinterpret_array(mi.UInt32, si.instance)
        pointer = dr.select(placed != 0, placed, dr.reinterpret_array(mi.UInt32, si.shape))
        return Seen(
            hit,
            dr.select(hit, mi.Point3f(si.p), 0),
            dr.select(hit, _normal(si, bsdf, hit), 0),
            dr.select(hit, _albedo(si, bsdf, hit), 0),
            dr.gather(mi.UInt32, self._numbers, pointer, hit),
        )

    @dr.syntax
    def _past_openings(self, ray: Any, pi: Any) -> tuple[Any, Any]:
        """Ray and hit behind all that is looked through."""
        crossings = mi.UInt32(0)
        active = pi.is_valid()
        while dr.hint(active, label="openings"):
            si = pi.compute_surface_interaction(ray, mi.RayFlags.All)
            through = si.bsdf(ray).eval_null_transmission(si, active)
            active &= (dr.mean(through) > SEEN_THROUGH) & (crossings < MAX_CROSSINGS)
            if active:
                ray = si.spawn_ray(ray.d)
                pi = self._scene.ray_intersect_preliminary(ray, coherent=False, active=active)
                active &= pi.is_valid()
            crossings += 1
        return ray, pi

    @dr.syntax
    def guide(self, ray: Any, active: Any) -> tuple[Any, Any, Any]:
        ray = mi.Ray3f(ray)  # current ray
        active = mi.Bool(active)
        albedo, normal = mi.Color3f(0), mi.Vector3f(0)
        distance = mi.Float(0)  # along the way so far
        tint = mi.Color3f(1)  # of the mirrors and panes on the way
        steps = mi.UInt32(0)  # mirrors and panes met so far
        pi = self._scene.ray_intersect_preliminary(ray, coherent=True, active=active)
        while dr.hint(active, label="to the first rough surface"):
            si = pi.compute_surface_interaction(ray, mi.RayFlags.All)
            hit = si.is_valid()
            bsdf = si.bsdf(ray)
            glow = si.emitter(self._scene).eval(si)
            if dr.hint(self._background is not None, mode="scalar"):
                glow = dr.select((steps == 0) & ~hit, mi.Color3f(self._background), glow)
            found = dr.clip(tint * (_albedo(si, bsdf, hit) + glow), 0, 1)

            may_show = mi.has_flag(bsdf.flags(), mi.BSDFFlags.Delta) | mi.has_flag(bsdf.flags(), mi.BSDFFlags.Null)
            bs, weight = _likeliest(si, bsdf, hit & may_show)
            shows = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta) | mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
            goes_on = hit & shows & (steps < MOST_FOLLOWED) & (dr.max(weight) > 0)
            albedo = dr.select(active & ~goes_on, found, albedo)
            normal = dr.select(active & ~goes_on & hit, mi.Vector3f(_normal(si, bsdf, hit)), normal)
            distance += dr.select(active, dr.select(hit, si.t, FAR_AWAY), 0)
            tint *= weight
            steps += 1
            ray = si.spawn_ray(si.to_world(bs.wo))
            active &= goes_on
            pi = self._scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        return albedo, normal, distance


def _likeliest(si: Any, bsdf: Any, active: Any) -> tuple[Any, Any]:
    """The middle of the lobe that most light takes at a mirror or pane, and the share of the light in it.

    Always the same one: what is drawn by chance would put noise into guides.
    """
    # Weights of radiance change where it enters glass; those of importance are shares of light.
    context = mi.BSDFContext(mi.TransportMode.Importance)
    bs, weight = bsdf.sample(context, si, mi.Float(_MIDDLE), mi.Point2f(_MIDDLE), active)
    return bs, weight


def _normal(si: Any, bsdf: Any, active: Any) -> Any:
    """Normal that light is scattered by, normal map and all, on the viewer's side."""
    plain = dr.select(si.wi.z < 0, -si.sh_frame.n, si.sh_frame.n)
    mapped = active & bsdf.has_attribute("normal", active)
    return dr.select(mapped, mi.Normal3f(bsdf.eval_attribute_3("normal", si, mapped)), plain)


def _albedo(si: Any, bsdf: Any, active: Any) -> Any:
    """Base colour where the surface has one, else diffuse reflectance, else the tint of a mirror or of glass."""
    based = active & bsdf.has_attribute("base_color", active)
    diffuse = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Diffuse)
    value = dr.select(diffuse, bsdf.eval_diffuse_reflectance(si, diffuse & ~based), 0)
    sharp = active & ~based & ~diffuse
    value = dr.select(sharp, _likeliest(si, bsdf, sharp)[1], value)
    value = dr.select(based, bsdf.eval_attribute_3("base_color", si, based), value)
    return dr.clip(mi.Color3f(value), 0, 1)


class ClassicSurfaces:
    """Surfaces of a classic scene.

    All triangles of a material count as one shape, as its number says; every other primitive is a shape of its own,
    with numbers from there on. What a surface lets through or mirrors is not looked at.
    """

    def __init__(self, built: BuiltClassic) -> None:
        self._built = built
        self._mirrored = built.scene.handedness == "left"
        self._triangles = len(built.scene.triangles.material)
        self._materials = len(built.scene.materials)
        centers = [light.center for light in built.scene.lights] or [(0.0, 0.0, 0.0)]
        self._lamps = mi.Float(np.array(centers, dtype=np.float32).ravel())

    def first(self, ray: Any, active: Any) -> Seen:
        o, d = self._turned(mi.Vector3f(ray.o)), self._turned(mi.Vector3f(ray.d))
        return self._first(o, d, mi.Bool(active))

    def guide(self, ray: Any, active: Any) -> tuple[Any, Any, Any]:
        o, d = self._turned(mi.Vector3f(ray.o)), self._turned(mi.Vector3f(ray.d))
        seen = self._first(o, d, mi.Bool(active))
        behind = dr.clip(background_color(self._built.scene.background, o, d), 0, 1)
        distance = dr.select(seen.hit, dr.norm(mi.Point3f(seen.p) - mi.Point3f(ray.o)), FAR_AWAY)
        return dr.select(seen.hit, seen.albedo, behind), seen.n, distance

    def _first(self, o: Any, d: Any, active: Any) -> Seen:
        built = self._built
        found = built.geometry.closest(o, d, active, coherent=True)
        hit = active & (found.index != NONE)
        is_lamp, lamp = built.geometry.lamp(found)
        is_lamp &= hit
        on_surface = hit & ~is_lamp
        surface = built.geometry.surface(found, o, d, on_surface)
        finish = built.materials.fetch(surface.material, on_surface)
        color = dr.select(surface.colored, surface.color, finish.color)
        texture = dr.select(surface.colored, -1, finish.texture)
        color = built.textures.color(texture, color, surface.p, found.t, on_surface)
        p = o + d * found.t
        outward = dr.normalize(p - dr.gather(mi.Vector3f, self._lamps, lamp, is_lamp))
        n = dr.normalize(dr.select(is_lamp, outward, surface.n))
        n = dr.select(dr.dot(n, d) > 0, -n, n)
        single = found.index - self._triangles + self._materials
        return Seen(
            hit,
            dr.select(hit, mi.Point3f(self._turned(dr.select(is_lamp, p, mi.Vector3f(surface.p)))), 0),
            dr.select(hit, self._turned(n), 0),
            dr.select(on_surface, dr.clip(color, 0, 1), 0),
            dr.select(found.index < self._triangles, surface.material, single),
        )

    def _turned(self, v: Any) -> Any:
        """Between the scene's own frame and the right-handed world."""
        return mi.Vector3f(v.x, v.y, -v.z) if self._mirrored else v
