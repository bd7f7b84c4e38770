"""First hits without light, in world space: for ground-truth layers, and as feature buffers of a denoiser.

Layers describe the first surface. Feature buffers describe the first surface that is not a mirror or clear glass,
because the edges in a reflection are those of the reflected objects.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.device.pbr import BuiltScene
from lippmann.device.syntax import syntax
from lippmann.device.types import (
    Bool,
    BSDFPtr,
    BSDFSample3f,
    Color3f,
    Float,
    Normal3f,
    Point3f,
    PreliminaryIntersection3f,
    Ray3f,
    Spectrum,
    SurfaceInteraction3f,
    UInt32,
    Vector3f,
)
from lippmann.rendering.transport.light_sampling import MAX_CROSSINGS
from lippmann.rendering.transport.sharp_events import MOST_EVENTS

if TYPE_CHECKING:
    from lippmann.device.whitted.scene import BuiltClassic

#: Surfaces with a null transmittance above this are skipped, as if they were not there.
MAX_NULL_TRANSMITTANCE = 0.5
#: Distance of the environment, in units of the scene.
ENVIRONMENT_DISTANCE = 1e6
#: Sample at the middle of a lobe, so that surfaces up to that null transmittance count as opaque here, too.
_MIDDLE = float(np.nextafter(np.float32(MAX_NULL_TRANSMITTANCE), np.float32(0)))


@dataclass
class SurfaceHit:
    """Surface at the first hit of each ray; all 0 where ``hit`` is False.

    ``n`` is the unit shading normal at the point ``p``, on the side that the ray comes from; ``albedo`` the reflectance
    in [0, 1]; ``shape`` the index of the shape.
    """

    hit: Bool
    p: Point3f
    n: Normal3f
    albedo: Color3f
    shape: UInt32


class Surfaces(Protocol):
    """The surfaces of one scene on the device."""

    def first_hit(self, ray: Ray3f) -> SurfaceHit:
        """The first surface that ``ray`` hits."""
        ...

    def first_point(self, ray: Ray3f) -> tuple[Bool, Point3f]:
        """Whether ``ray`` hits a surface, and where; cheaper than :meth:`first_hit`."""
        ...

    def features(self, ray: Ray3f) -> tuple[Color3f, Normal3f, Float, Bool]:
        """Denoising features of the first surface that is not purely specular.

        Returns
        -------
        Color3f, Normal3f, Float, Bool
            Albedo plus emitted radiance, clipped to [0, 1] and tinted by the specular surfaces on the way; the unit
            shading normal, 0 where nothing is hit; the length of the path there in units of the scene,
            :data:`ENVIRONMENT_DISTANCE` where nothing is hit; whether ``ray`` hits any surface at all.
        """
        ...


def make_surfaces(built: BuiltScene | BuiltClassic) -> Surfaces:
    """Make the surfaces of a built scene."""
    return PhysicalSurfaces(built) if isinstance(built, BuiltScene) else WhittedSurfaces(built)


class PhysicalSurfaces:
    """Surfaces of a Mitsuba scene; ``shape`` is an index into ``mi.Scene.shapes()``."""

    def __init__(self, built: BuiltScene) -> None:
        self._scene = built.mitsuba
        self._background = built.background
        self._has_null = built.has_null
        pointers = np.array(dr.reinterpret_array(mi.UInt32, self._scene.shapes_dr()))
        numbers = np.zeros(int(pointers.max(initial=0)) + 1, dtype=np.uint32)
        numbers[pointers] = np.arange(len(pointers))
        self._numbers = mi.UInt32(numbers)

    def first_hit(self, ray: Ray3f) -> SurfaceHit:
        """The first surface that ``ray`` hits, without those of high null transmittance."""
        ray, pi = self._first(ray)
        si = pi.compute_surface_interaction(ray, mi.RayFlags.All)
        hit = si.is_valid()
        bsdf = si.bsdf(ray)
        instance = dr.reinterpret_array(mi.UInt32, si.instance)
        pointer = dr.select(instance != 0, instance, dr.reinterpret_array(mi.UInt32, si.shape))
        return SurfaceHit(
            hit,
            dr.select(hit, mi.Point3f(si.p), 0),
            dr.select(hit, _normal(si, bsdf, hit), 0),
            _albedo(si, bsdf, _central_sample(si, bsdf, hit & ~_has_reflectance(bsdf))[1], hit),
            dr.gather(mi.UInt32, self._numbers, pointer, hit),
        )

    def first_point(self, ray: Ray3f) -> tuple[Bool, Point3f]:
        """As :meth:`Surfaces.first_point`."""
        ray, pi = self._first(ray)
        return pi.is_valid(), ray(pi.t)

    def _first(self, ray: Ray3f) -> tuple[Ray3f, PreliminaryIntersection3f]:
        ray = mi.Ray3f(ray)
        pi = self._scene.ray_intersect_preliminary(ray)
        return self._skip_null(ray, pi) if self._has_null else (ray, pi)

    @syntax
    def _skip_null(self, ray: Ray3f, pi: PreliminaryIntersection3f) -> tuple[Ray3f, PreliminaryIntersection3f]:
        """Ray and hit behind the surfaces of high null transmittance."""
        crossings = mi.UInt32(0)
        active = pi.is_valid()
        o, d = mi.Point3f(ray.o), mi.Vector3f(ray.d)
        while dr.hint(active, label="null surfaces", exclude=[d]):
            toward = mi.Ray3f(o, d)
            si = pi.compute_surface_interaction(toward, mi.RayFlags.All)
            through = si.bsdf(toward).eval_null_transmission(si, active)
            active &= (dr.mean(through) > MAX_NULL_TRANSMITTANCE) & (crossings < MAX_CROSSINGS)
            onward = si.spawn_ray(d)
            if active:
                o = mi.Point3f(onward.o)
                pi = self._scene.ray_intersect_preliminary(onward, coherent=False, active=active)
                active &= pi.is_valid()
            crossings += 1
        return mi.Ray3f(o, d), pi

    @syntax
    def features(self, ray: Ray3f) -> tuple[Color3f, Normal3f, Float, Bool]:
        """As :meth:`Surfaces.features`."""
        o, d = mi.Point3f(ray.o), mi.Vector3f(ray.d)  # current ray
        active = mi.Bool(True)
        albedo, normal = mi.Color3f(0), mi.Vector3f(0)
        distance = mi.Float(0)  # length of the path so far
        tint = mi.Color3f(1)  # of the specular surfaces so far
        steps = mi.UInt32(0)  # specular surfaces so far
        pi = self._scene.ray_intersect_preliminary(ray, active=active)
        covered = mi.Bool(pi.is_valid())
        while dr.hint(active, label="to the first rough surface"):
            toward = mi.Ray3f(o, d)
            si = pi.compute_surface_interaction(toward, mi.RayFlags.All)
            hit = si.is_valid()
            bsdf = si.bsdf(toward)
            shows_backdrop = (steps == 0) & ~hit & mi.Bool(self._background is not None)
            emission = si.emitter(self._scene).eval(si, active & ~shows_backdrop)
            if dr.hint(self._background is not None, mode="scalar"):
                emission = dr.select(shows_backdrop, mi.Color3f(self._background), emission)
            # In branches, so that the processor skips them for a vector of lanes that have met rough surfaces alone.
            lobe, weight, wo = mi.UInt32(0), mi.Color3f(0), mi.Vector3f(0)
            if hit & (_has_specular_lobe(bsdf.flags()) | ~_has_reflectance(bsdf)):
                bs, sampled = _central_sample(si, bsdf, hit)
                lobe, weight, wo = mi.UInt32(bs.sampled_type), mi.Color3f(sampled), mi.Vector3f(bs.wo)
            specular = _has_specular_lobe(lobe)
            color = dr.clip(tint * (_albedo(si, bsdf, weight, hit) + emission), 0, 1)
            continues = hit & specular & (steps < MOST_EVENTS) & (dr.max(weight) > 0)
            albedo = dr.select(active & ~continues, color, albedo)
            normal = dr.select(active & ~continues & hit, mi.Vector3f(_normal(si, bsdf, hit)), normal)
            distance += dr.select(active, dr.select(hit, si.t, ENVIRONMENT_DISTANCE), 0)
            tint *= weight
            steps += 1
            active &= continues
            if active:
                onward = si.spawn_ray(si.to_world(wo))
                o, d = mi.Point3f(onward.o), mi.Vector3f(onward.d)
                pi = self._scene.ray_intersect_preliminary(onward, coherent=False, active=active)
        return albedo, normal, distance, covered


def _has_specular_lobe(flags: UInt32) -> Bool:
    return mi.has_flag(flags, mi.BSDFFlags.Delta) | mi.has_flag(flags, mi.BSDFFlags.Null)


def _central_sample(si: SurfaceInteraction3f, bsdf: BSDFPtr, active: Bool) -> tuple[BSDFSample3f, Spectrum]:
    """BSDF sample at the middle of the likeliest lobe, and its weight in [0, 1].

    The sample is fixed, because a random one would put noise into feature buffers.
    """
    # Radiance is scaled where it enters glass; importance is not, so that its weights are shares of energy.
    context = mi.BSDFContext(mi.TransportMode.Importance)
    bs, weight = bsdf.sample(context, si, mi.Float(_MIDDLE), mi.Point2f(_MIDDLE), active)
    return bs, weight


def _normal(si: SurfaceInteraction3f, bsdf: BSDFPtr, active: Bool) -> Normal3f:
    """Shading normal, normal map included, on the side that the ray comes from."""
    plain = dr.select(si.wi.z < 0, -si.sh_frame.n, si.sh_frame.n)
    mapped = active & bsdf.has_attribute("normal", active)
    return dr.select(mapped, mi.Normal3f(bsdf.eval_attribute_3("normal", si, mapped)), plain)


def _has_reflectance(bsdf: BSDFPtr) -> Bool:
    """Whether a BSDF knows a base colour or diffuse reflectance."""
    return bsdf.has_attribute("base_color") | mi.has_flag(bsdf.flags(), mi.BSDFFlags.Diffuse)


def _albedo(si: SurfaceInteraction3f, bsdf: BSDFPtr, tint: Color3f, active: Bool) -> Color3f:
    """Base colour where the surface has one, else diffuse reflectance, else the ``tint`` of a specular surface."""
    has_base = active & bsdf.has_attribute("base_color", active)
    diffuse = active & ~has_base & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Diffuse)
    value = dr.select(diffuse, bsdf.eval_diffuse_reflectance(si, diffuse), tint)
    value = dr.select(has_base, bsdf.eval_attribute_3("base_color", si, has_base), value)
    return dr.select(active, dr.clip(mi.Color3f(value), 0, 1), 0)


class WhittedSurfaces:
    """Surfaces of a Whitted-style scene.

    All triangles of a material are one shape, with the index of that material. Every other primitive is a shape of its
    own, with the indices that follow. Reflection and transparency are ignored.
    """

    def __init__(self, built: BuiltClassic) -> None:
        self._built = built
        self._mirrored = built.scene.handedness == "left"
        self._triangles = len(built.scene.triangles.material)
        self._materials = len(built.scene.materials)
        centers = [light.center for light in built.scene.lights] or [(0.0, 0.0, 0.0)]
        self._light_centers = mi.Float(np.array(centers, dtype=np.float32).ravel())

    def first_hit(self, ray: Ray3f) -> SurfaceHit:
        """The first surface that ``ray`` hits."""
        return self._first_hit(self._mirror(mi.Vector3f(ray.o)), self._mirror(mi.Vector3f(ray.d)))

    def first_point(self, ray: Ray3f) -> tuple[Bool, Point3f]:
        """As :meth:`Surfaces.first_point`."""
        o, d = self._mirror(mi.Vector3f(ray.o)), self._mirror(mi.Vector3f(ray.d))
        closest = self._built.geometry.closest(o, d, mi.Bool(True), coherent=True)
        return closest.is_valid(), mi.Point3f(self._mirror(o + d * closest.t))

    def features(self, ray: Ray3f) -> tuple[Color3f, Normal3f, Float, Bool]:
        """As :meth:`Surfaces.features`, of the first surface whatever it is."""
        o, d = self._mirror(mi.Vector3f(ray.o)), self._mirror(mi.Vector3f(ray.d))
        first = self._first_hit(o, d)
        behind = dr.clip(self._built.background_color(o, d), 0, 1)
        distance = dr.select(first.hit, dr.norm(mi.Point3f(first.p) - mi.Point3f(ray.o)), ENVIRONMENT_DISTANCE)
        return dr.select(first.hit, first.albedo, behind), first.n, distance, first.hit

    def _first_hit(self, o: Vector3f, d: Vector3f) -> SurfaceHit:
        built = self._built
        closest = built.geometry.closest(o, d, mi.Bool(True), coherent=True)
        hit = closest.is_valid()
        is_light, light = built.geometry.find_light(closest)
        is_light &= hit
        on_surface = hit & ~is_light
        surface = built.geometry.surface(closest, o, d, on_surface)
        finish = built.materials.fetch(surface.material, on_surface)
        color = dr.select(surface.colored, surface.color, finish.color)
        texture = dr.select(surface.colored, -1, finish.texture)
        color = built.textures.color(texture, color, surface.p, closest.t, on_surface)
        p = o + d * closest.t
        outward = dr.normalize(p - dr.gather(mi.Vector3f, self._light_centers, light, is_light))
        n = dr.normalize(dr.select(is_light, outward, surface.n))
        n = dr.select(dr.dot(n, d) > 0, -n, n)
        single = closest.index - self._triangles + self._materials
        return SurfaceHit(
            hit,
            dr.select(hit, mi.Point3f(self._mirror(dr.select(is_light, p, mi.Vector3f(surface.p)))), 0),
            dr.select(hit, self._mirror(n), 0),
            dr.select(on_surface, dr.clip(color, 0, 1), 0),
            dr.select(closest.index < self._triangles, surface.material, single),
        )

    def _mirror(self, v: Vector3f) -> Vector3f:
        """``v`` from the right-handed world to the scene's own frame, or back."""
        return mi.Vector3f(v.x, v.y, -v.z) if self._mirrored else v
