"""The classic light models: Tachyon's, and Haines' for NFF.

A surface sends back its own colour (``render/classic/shading.py``), a mirrored ray and a ray that goes through. Both
are followed, depth first: the second waits on a small stack of each lane. All weights are single numbers, for no
surface tints what it mirrors or lets through.

Ray depth: the primary ray has ``depth``, each further ray one less. Where a ray of depth 1 needs another, Tachyon takes
the background as that ray's own would see it, without the surface's factor; under NFF's rules nothing is added.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import drjit as dr
import mitsuba as mi

from lippmann.device.sobol import SampleStream
from lippmann.device.whitted.background_fog import background_color, clearness
from lippmann.device.whitted.geometry import FAR, NONE, Hit, Surface
from lippmann.device.whitted.materials import LEAST, Finish
from lippmann.device.whitted.scene import BuiltClassic
from lippmann.rendering.transport.integrator import FirstHit, RayCounts

#: Rays that may wait on a lane's stack. More would take 2^32 rays a pixel to need.
DEEPEST_STACK = 32
#: Rays of less weight are not followed: a thousandth of a step of an 8-bit picture.
LEAST_WEIGHT = 4e-6


@dataclass
class _Ray:
    """A ray on its way: what it will count for, and what it has behind it."""

    o: Any
    d: Any
    weight: Any
    depth: Any
    path: Any  # way from the eye, for image textures
    surfaces: Any  # transparent surfaces that may still be shaded


class ClassicIntegrator:
    """Light along rays in a classic scene.

    World space is right-handed: a scene of a left-handed format lies in it with its z negated.
    """

    # Not a dataclass: Dr.Jit would take it for loop state and write its fields.
    def __init__(self, built: BuiltClassic, depth: int) -> None:
        self.name = "classic"
        self.depth = depth
        self._built = built
        self._scene = built.scene
        self._mirrored = built.scene.handedness == "left"
        self._nff = built.scene.rules == "nff"
        shading = built.scene.shading
        self._plain = shading.mode in ("low", "lowest")
        materials = built.materials
        self._raster3d = materials.raster3d or shading.raster3d
        self._spawns = not self._plain and (materials.mirrors or materials.lets_through)
        # Total reflection turns what should go through into a mirror: with both there is still but one ray.
        self._branches = self._spawns and materials.branches
        self._limited = shading.max_transparent_surfaces is not None and materials.lets_through

    def sample(self, ray: Any, stream: SampleStream, active: Any) -> tuple[Any, RayCounts]:
        """As :class:`~lippmann.rendering.transport.integrator.Integrator` has it."""
        radiance, counts, _ = self.sample_with_hit(ray, stream, active)
        return radiance, counts

    def sample_with_hit(self, ray: Any, stream: SampleStream, active: Any) -> tuple[Any, RayCounts, FirstHit]:
        """As :meth:`sample`, with what the primary ray hit.

        The colour depends on the direction where a mirrored or transmitted part is in it, a highlight or an outline.
        """
        o, d = mi.Vector3f(ray.o), mi.Vector3f(ray.d)
        if self._mirrored:
            o, d = _mirrored(o), _mirrored(d)
        active = mi.Bool(active)
        surfaces = mi.UInt32(self._scene.shading.max_transparent_surfaces or 0)
        primary = _Ray(o, d, mi.Float(1), mi.UInt32(self.depth), mi.Float(0), surfaces)
        if self._spawns and self.depth > 1:
            radiance, counts, first = self._follow(primary, stream, active)
            return radiance, counts, first
        hit = self._built.geometry.closest(o, d, active, coherent=True)
        radiance, shadow, depends, _ = self._shade(primary, hit, stream, mi.UInt32(0), mi.Bool(True), active)
        none = dr.zeros(mi.UInt32, dr.width(hit.t))
        return radiance, RayCounts(none, shadow), FirstHit(_distance(hit, active), depends)

    @dr.syntax
    def _follow(self, ray: _Ray, stream: SampleStream, active: Any) -> tuple[Any, RayCounts, FirstHit]:
        """Shades a ray and all that come of it."""
        radiance, shadow, secondary = mi.Color3f(0), mi.UInt32(0), mi.UInt32(0)
        distance, view_dependent = mi.Float(dr.inf), mi.Bool(False)
        hits = mi.UInt32(0)
        waiting = mi.UInt32(0)
        if dr.hint(self._branches, mode="scalar"):
            room = min(self.depth - 1, DEEPEST_STACK)
            stack = {f.name: dr.alloc_local(type(getattr(ray, f.name)), room + 1) for f in fields(_Ray)}
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

            goes_on = active & (mirrored.weight > LEAST_WEIGHT)
            passes = active & (through.weight > LEAST_WEIGHT)
            ray = _either(goes_on, mirrored, through)
            if dr.hint(self._branches, mode="scalar"):
                # What does not wait goes to a place of no meaning: conditional writes to local memory lose lanes.
                waits = goes_on & passes & (waiting < room)
                _store(stack, dr.select(waits, waiting, room), through)
                waiting += dr.select(waits, mi.UInt32(1), mi.UInt32(0))
                returns = active & ~goes_on & ~passes & (waiting > 0)
                waiting -= dr.select(returns, mi.UInt32(1), mi.UInt32(0))
                ray = _either(returns, _load(stack, waiting), ray)
                active &= goes_on | passes | returns
            else:
                active &= goes_on | passes
        return radiance, RayCounts(secondary, shadow), FirstHit(distance, view_dependent)

    def _shade(
        self, ray: _Ray, hit: Hit, stream: SampleStream, hits: Any, primary: Any, active: Any
    ) -> tuple[Any, Any, Any, tuple[_Ray, _Ray]]:
        """What a ray brings by itself, weighted; shadow rays; view dependence; the mirrored ray and the one through."""
        built, shading = self._built, self._scene.shading
        met = active & (hit.index != NONE)
        is_lamp, lamp = built.geometry.lamp(hit)
        is_lamp &= met
        met &= ~is_lamp
        surface = built.geometry.surface(hit, ray.o, ray.d, met)
        finish = built.materials.fetch(surface.material, met)
        path = ray.path + hit.t if shading.mode != "low" else mi.Float(FAR)
        color = dr.select(surface.colored, surface.color, finish.color)
        color = built.textures.color(dr.select(surface.colored, -1, finish.texture), color, surface.p, path, met)
        lamp_color = built.lamps.color(lamp, is_lamp)
        behind = background_color(self._scene.background, ray.o, ray.d)
        if self._plain:
            if shading.mode == "lowest":
                color, lamp_color, behind = mi.Color3f(1), mi.Color3f(1), mi.Color3f(0)
            shown = dr.select(met, color, dr.select(is_lamp, lamp_color, behind))
            return shown * ray.weight, mi.UInt32(0), mi.Bool(False), (_dropped(ray), _dropped(ray))

        own, shines, shadow = built.shader.light(surface, finish, color, ray.d, stream, hits, met)
        passed_over = mi.Bool(False)
        if self._limited:
            passed_over = met & (finish.opacity < 1) & (ray.surfaces == 0)
        alpha = self._opacity(surface, finish, ray.d)
        mirrors = met & (finish.specular > (0 if self._nff else LEAST)) & ~passed_over
        lets_through = met & (finish.opacity < 1 - LEAST) & ~passed_over
        kept = dr.select(lets_through, alpha, 1) if shading.local_times_opacity else mi.Float(1)
        mirrored_share = dr.select(mirrors, finish.specular * kept, 0)
        through_share = dr.select(lets_through, 1 - alpha, 0)
        own = dr.select(passed_over, 0, own * kept)

        direction = ray.d
        if self._nff:
            direction, reflected = _refracted(surface, finish, ray.d)
            mirrored_share += dr.select(reflected, through_share, 0)
            through_share = dr.select(reflected, 0, through_share)
        through_share = dr.select(passed_over, 1, through_share)
        ends = ray.depth <= 1
        if not self._nff:
            missing = dr.select(mirrors, kept, 0) + dr.select(lets_through | passed_over, 1, 0)
            own += dr.select(ends & met, behind * missing, 0)

        clear, haze = self._fog(hit, ray.d, met, active & ~met & ~is_lamp, passed_over, primary)
        shown = dr.select(met, own, dr.select(is_lamp, lamp_color, behind)) * clear + haze
        weight = dr.select(ends | ~met, 0, ray.weight * clear)
        mirrored_d = ray.d - surface.n * (2 * dr.dot(surface.n, ray.d))
        mirrored = _Ray(
            surface.start(mirrored_d), mirrored_d, weight * mirrored_share, ray.depth - 1, path, ray.surfaces
        )
        through = _Ray(
            surface.start(direction),
            direction,
            weight * through_share,
            ray.depth - 1,
            path,
            dr.maximum(ray.surfaces, 1) - 1,
        )
        depends = met & (mirrors | lets_through | shines | passed_over)
        if built.materials.outlined:
            depends |= met & (finish.outline > 0)
        return shown * ray.weight, shadow, depends, (mirrored, through)

    def _opacity(self, surface: Surface, finish: Finish, d: Any) -> Any:
        if not self._raster3d:
            return finish.opacity
        by_angle = dr.square(1 + dr.cos(_RASTER3D_PI * (1 - finish.opacity) * dr.dot(surface.n, d))) * 0.25
        return by_angle if self._scene.shading.raster3d else dr.select(finish.raster3d, by_angle, finish.opacity)

    def _fog(self, hit: Hit, d: Any, met: Any, missed: Any, passed_over: Any, primary: Any) -> tuple[Any, Any]:
        """Share of a ray's colour that is seen through the fog, and what the fog adds."""
        fog = self._scene.fog
        if fog is None:
            return mi.Float(1), mi.Color3f(0)
        distance = dr.select(met, hit.t, FAR)
        if fog.planar:
            view = mi.Vector3f(*self._scene.camera.frame()[2].tolist())
            distance = dr.select(primary, distance * dr.dot(d, view), distance)
        foggy = (met & ~passed_over) if fog.planar else (met & ~passed_over) | missed
        clear = dr.select(foggy, clearness(fog, distance), 1)
        return clear, mi.Color3f(*fog.color) * (1 - clear)


#: As Tachyon has it.
_RASTER3D_PI = 3.1415926


def _mirrored(v: Any) -> Any:
    return mi.Vector3f(v.x, v.y, -v.z)


def _store(stack: dict[str, Any], place: Any, ray: _Ray) -> None:
    for name, column in stack.items():
        column[place] = getattr(ray, name)


def _load(stack: dict[str, Any], place: Any) -> _Ray:
    return _Ray(**{name: column[place] for name, column in stack.items()})


def _distance(hit: Hit, active: Any) -> Any:
    return dr.select(active & (hit.index != NONE), hit.t, dr.inf)


def _dropped(ray: _Ray) -> _Ray:
    return _Ray(ray.o, ray.d, mi.Float(0), ray.depth, ray.path, ray.surfaces)


def _either(condition: Any, a: _Ray, b: _Ray) -> _Ray:
    return _Ray(*(dr.select(condition, getattr(a, f.name), getattr(b, f.name)) for f in fields(_Ray)))


def _refracted(surface: Surface, finish: Finish, d: Any) -> tuple[Any, Any]:
    """Direction of the refracted ray by Snell's law, and whether all is reflected instead."""
    ratio = dr.select(dr.dot(surface.face, d) < 0, dr.rcp(finish.ior), finish.ior)
    cosine = -dr.dot(surface.n, d)
    squared = 1 - ratio * ratio * (1 - cosine * cosine)
    bent = d * ratio + surface.n * (ratio * cosine - dr.sqrt(dr.maximum(squared, 0)))
    return dr.normalize(bent), squared < 0
