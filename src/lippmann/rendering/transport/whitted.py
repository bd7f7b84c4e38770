"""Whitted ray tracing: by Tachyon's light model, and by Haines' for NFF.

A surface has a local colour (``device/whitted/shading.py``), a reflected ray and a transmitted ray. Both rays are
followed depth first, the second one waiting on a small stack in each lane. Weights of rays are single numbers, because
no surface tints reflection or transmission.

Ray depth: the primary ray has ``depth``, each further ray one less. Where a ray of depth 1 would need another, Tachyon
adds the background along the ray that hit the surface, without the surface's factor; NFF adds nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import drjit as dr
import mitsuba as mi

from lippmann.device.sobol import SampleStream
from lippmann.device.syntax import syntax
from lippmann.device.types import Array, Bool, Color3f, Float, Ray3f, UInt32, Vector3f
from lippmann.device.whitted.background_fog import clearness
from lippmann.device.whitted.geometry import FAR, Hit, Surface
from lippmann.device.whitted.materials import LEAST, Finish
from lippmann.device.whitted.scene import BuiltClassic
from lippmann.rendering.transport.integrator import FirstHit, RayCounts

#: Entries of each lane's stack of pending rays; a binary tree of 2^32 rays needs no more.
MAX_STACK = 32
#: Rays of less weight are not followed: a thousandth of a step of an 8-bit picture.
MIN_WEIGHT = 4e-6


@dataclass
class _Ray:
    """A ray of the tree, with its weight in the pixel."""

    o: Vector3f
    d: Vector3f
    weight: Float
    depth: UInt32
    path: Float  # distance from the camera along the path, for image textures
    surfaces: UInt32  # transparent surfaces that may still be shaded


class WhittedIntegrator:
    """Whitted ray tracing of one scene.

    World space is right-handed: a scene of a left-handed format has its z negated in it.

    Parameters
    ----------
    built:
        The scene on the device.
    depth:
        Ray depth of primary rays, at least 1.
    """

    def __init__(self, built: BuiltClassic, depth: int) -> None:
        self.name = "classic"
        self.depth = depth
        self._built = built
        self._scene = built.scene
        self._mirror = built.scene.handedness == "left"
        self._nff = built.scene.rules == "nff"
        shading = built.scene.shading
        self._plain = shading.mode in ("low", "lowest")
        materials = built.materials
        self._raster3d = materials.raster3d or shading.raster3d
        self._spawns = not self._plain and (materials.mirrors or materials.lets_through)
        # Total reflection turns what should go through into a mirror: with both there is still but one ray.
        self._branches = self._spawns and materials.branches
        self._limited = shading.max_transparent_surfaces is not None and materials.lets_through

    def sample(self, ray: Ray3f, stream: SampleStream, active: Bool) -> tuple[Color3f, RayCounts]:
        """As :meth:`lippmann.rendering.transport.integrator.Integrator.sample`."""
        radiance, counts, _ = self.sample_with_hit(ray, stream, active)
        return radiance, counts

    def sample_with_hit(self, ray: Ray3f, stream: SampleStream, active: Bool) -> tuple[Color3f, RayCounts, FirstHit]:
        """As :meth:`sample`, with the first hit.

        Surfaces with reflection, transmission, a highlight or an outline are view-dependent.
        """
        o, d = mi.Vector3f(ray.o), mi.Vector3f(ray.d)
        if self._mirror:
            o, d = _mirror(o), _mirror(d)
        active = mi.Bool(active)
        surfaces = mi.UInt32(self._scene.shading.max_transparent_surfaces or 0)
        primary = _Ray(o, d, mi.Float(1), mi.UInt32(self.depth), mi.Float(0), surfaces)
        if self._spawns and self.depth > 1:
            radiance, counts, first = self._follow(primary, stream, active)
            return radiance, counts, first
        hit = self._built.geometry.closest(o, d, active, coherent=True)
        radiance, shadow, view_dependent, _ = self._shade(primary, hit, stream, mi.UInt32(0), mi.Bool(True), active)
        none = dr.zeros(mi.UInt32, dr.width(hit.t))
        return radiance, RayCounts(none, shadow), FirstHit(_distance(hit, active), view_dependent)

    @syntax
    def _follow(self, ray: _Ray, stream: SampleStream, active: Bool) -> tuple[Color3f, RayCounts, FirstHit]:
        """Trace a ray and the tree of reflected and transmitted rays below it."""
        radiance, shadow, secondary = mi.Color3f(0), mi.UInt32(0), mi.UInt32(0)
        distance, view_dependent = mi.Float(dr.inf), mi.Bool(False)
        hits = mi.UInt32(0)
        waiting = mi.UInt32(0)
        if dr.hint(self._branches, mode="scalar"):
            capacity = min(self.depth - 1, MAX_STACK)
            stack = {f.name: dr.alloc_local(type(getattr(ray, f.name)), capacity + 1) for f in fields(_Ray)}
        while dr.hint(active, label="rays"):
            is_primary = hits == 0
            hit = self._built.geometry.closest(ray.o, ray.d, active, coherent=is_primary)
            color, tests, depends, (mirrored, through) = self._shade(ray, hit, stream, hits, is_primary, active)
            radiance += dr.select(active, color, 0)
            shadow += dr.select(active, tests, 0)
            secondary += dr.select(active & ~is_primary, mi.UInt32(1), mi.UInt32(0))
            distance = dr.select(is_primary, _distance(hit, active), distance)
            view_dependent |= depends & is_primary & active
            hits += 1

            continues = active & (mirrored.weight > MIN_WEIGHT)
            passes = active & (through.weight > MIN_WEIGHT)
            ray = _select_either(continues, mirrored, through)
            if dr.hint(self._branches, mode="scalar"):
                # Rays that do not wait go to a spare entry, because conditional writes to local memory lose lanes.
                waits = continues & passes & (waiting < capacity)
                _store(stack, dr.select(waits, waiting, capacity), through)
                waiting += dr.select(waits, mi.UInt32(1), mi.UInt32(0))
                returns = active & ~continues & ~passes & (waiting > 0)
                waiting -= dr.select(returns, mi.UInt32(1), mi.UInt32(0))
                ray = _select_either(returns, _load(stack, waiting), ray)
                active &= continues | passes | returns
            else:
                active &= continues | passes
        return radiance, RayCounts(secondary, shadow), FirstHit(distance, view_dependent)

    def _shade(
        self, ray: _Ray, hit: Hit, stream: SampleStream, hits: UInt32, primary: Bool, active: Bool
    ) -> tuple[Color3f, UInt32, Bool, tuple[_Ray, _Ray]]:
        """Weighted local radiance; count of shadow rays; view dependence; the reflected and the transmitted ray."""
        built, shading = self._built, self._scene.shading
        on_surface = active & hit.is_valid()
        is_light, light = built.geometry.find_light(hit)
        is_light &= on_surface
        on_surface &= ~is_light
        surface = built.geometry.surface(hit, ray.o, ray.d, on_surface)
        finish = built.materials.fetch(surface.material, on_surface)
        path = ray.path + hit.t if shading.mode != "low" else mi.Float(FAR)
        color = dr.select(surface.colored, surface.color, finish.color)
        color = built.textures.color(dr.select(surface.colored, -1, finish.texture), color, surface.p, path, on_surface)
        light_color = built.lights.color(light, is_light)
        background = self._built.background_color(ray.o, ray.d)
        if self._plain:
            if shading.mode == "lowest":
                color, light_color, background = mi.Color3f(1), mi.Color3f(1), mi.Color3f(0)
            radiance = dr.select(on_surface, color, dr.select(is_light, light_color, background))
            return radiance * ray.weight, mi.UInt32(0), mi.Bool(False), (_drop_throughput(ray), _drop_throughput(ray))

        local, glossy, shadow = built.shader.light(surface, finish, color, ray.d, stream, hits, on_surface)
        skipped = mi.Bool(False)
        if self._limited:
            skipped = on_surface & (finish.opacity < 1) & (ray.surfaces == 0)
        alpha = self._find_opacity(surface, finish, ray.d)
        mirrors = on_surface & (finish.specular > (0 if self._nff else LEAST)) & ~skipped
        lets_through = on_surface & (finish.opacity < 1 - LEAST) & ~skipped
        local_share = dr.select(lets_through, alpha, 1) if shading.local_times_opacity else mi.Float(1)
        reflected_share = dr.select(mirrors, finish.specular * local_share, 0)
        transmitted_share = dr.select(lets_through, 1 - alpha, 0)
        local = dr.select(skipped, 0, local * local_share)

        direction = ray.d
        if self._nff:
            direction, total = _refract(surface, finish, ray.d)
            reflected_share += dr.select(total, transmitted_share, 0)
            transmitted_share = dr.select(total, 0, transmitted_share)
        transmitted_share = dr.select(skipped, 1, transmitted_share)
        last = ray.depth <= 1
        if not self._nff:
            missing = dr.select(mirrors, local_share, 0) + dr.select(lets_through | skipped, 1, 0)
            local += dr.select(last & on_surface, background * missing, 0)

        clear, haze = self._blend_fog(hit, ray.d, on_surface, active & ~on_surface & ~is_light, skipped, primary)
        radiance = dr.select(on_surface, local, dr.select(is_light, light_color, background)) * clear + haze
        weight = dr.select(last | ~on_surface, 0, ray.weight * clear)
        mirrored_d = ray.d - surface.n * (2 * dr.dot(surface.n, ray.d))
        mirrored = _Ray(
            surface.start(mirrored_d), mirrored_d, weight * reflected_share, ray.depth - 1, path, ray.surfaces
        )
        through = _Ray(
            surface.start(direction),
            direction,
            weight * transmitted_share,
            ray.depth - 1,
            path,
            dr.maximum(ray.surfaces, 1) - 1,
        )
        view_dependent = on_surface & (mirrors | lets_through | glossy | skipped)
        if built.materials.outlined:
            view_dependent |= on_surface & (finish.outline > 0)
        return radiance * ray.weight, shadow, view_dependent, (mirrored, through)

    def _find_opacity(self, surface: Surface, finish: Finish, d: Vector3f) -> Float:
        if not self._raster3d:
            return finish.opacity
        by_angle = dr.square(1 + dr.cos(dr.pi * (1 - finish.opacity) * dr.dot(surface.n, d))) * 0.25
        return by_angle if self._scene.shading.raster3d else dr.select(finish.raster3d, by_angle, finish.opacity)

    def _blend_fog(
        self, hit: Hit, d: Vector3f, on_surface: Bool, missed: Bool, skipped: Bool, primary: Bool
    ) -> tuple[Float, Color3f]:
        """Transmittance of the fog along a ray, and the radiance that the fog adds."""
        fog = self._scene.fog
        if fog is None:
            return mi.Float(1), mi.Color3f(0)
        distance = dr.select(on_surface, hit.t, FAR)
        if fog.planar:
            view = mi.Vector3f(*self._scene.camera.frame()[2].tolist())
            distance = dr.select(primary, distance * dr.dot(d, view), distance)
        foggy = (on_surface & ~skipped) if fog.planar else (on_surface & ~skipped) | missed
        clear = dr.select(foggy, clearness(fog, distance), 1)
        return clear, mi.Color3f(*fog.color) * (1 - clear)


def _mirror(v: Vector3f) -> Vector3f:
    return mi.Vector3f(v.x, v.y, -v.z)


def _store(stack: dict[str, Array], entry: UInt32, ray: _Ray) -> None:
    for name, column in stack.items():
        column[entry] = getattr(ray, name)


def _load(stack: dict[str, Array], entry: UInt32) -> _Ray:
    return _Ray(**{name: column[entry] for name, column in stack.items()})


def _distance(hit: Hit, active: Bool) -> Float:
    return dr.select(active & hit.is_valid(), hit.t, dr.inf)


def _drop_throughput(ray: _Ray) -> _Ray:
    return _Ray(ray.o, ray.d, mi.Float(0), ray.depth, ray.path, ray.surfaces)


def _select_either(condition: Bool, a: _Ray, b: _Ray) -> _Ray:
    return _Ray(*(dr.select(condition, getattr(a, f.name), getattr(b, f.name)) for f in fields(_Ray)))


def _refract(surface: Surface, finish: Finish, d: Vector3f) -> tuple[Vector3f, Bool]:
    """Direction of the refracted ray by Snell's law, and whether there is total internal reflection instead."""
    ratio = dr.select(dr.dot(surface.face, d) < 0, dr.rcp(finish.ior), finish.ior)
    cosine = -dr.dot(surface.n, d)
    squared = 1 - ratio * ratio * (1 - cosine * cosine)
    bent = d * ratio + surface.n * (ratio * cosine - dr.sqrt(dr.maximum(squared, 0)))
    return dr.normalize(bent), squared < 0
