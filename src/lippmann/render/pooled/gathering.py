"""Paths that bring light to the pool: from a pixel to a surface whose light can be shared, and on from there.

The way to that surface leads through mirrors, glass and sharp reflections only. The light found there is an estimate
of the pixel's own colour, too: the unpooled estimate that pooled pictures are judged by.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from lippmann.render.integrators.path import DIMENSIONS_PER_VERTEX, MAX_CROSSINGS, PathIntegrator, mis_weight
from lippmann.render.pooled.following import Follower
from lippmann.render.pooled.surfaces import split
from lippmann.render.sampling import SampleStream

#: Sample dimensions of the light's own paths begin here, beyond those of the way to the surface.
LIGHT_DIMENSION = 1 << 12
#: Chance of staying with the diffuse part of a surface that has a sharp reflection as well. Paths that leave it bring
#: light to what is seen in the reflection alone.
STAYING = 0.85


@dataclass
class Gathered:
    """What one wavefront of paths brings home.

    Attributes
    ----------
    color:
        Unpooled estimate of the pixel's colour.
    position, split, ray_d, distance:
        Where light was gathered: the point and its surface, the ray that met it, and its distance from the pixel along
        the way.
    diffuse, gloss:
        Light by kind, over what the surface sends back of it.
    weight:
        How much the diffuse light counts in the pool: little where the surface hardly sends any back, for few of its
        paths look for it.
    """

    color: Any
    position: Any
    split: Any
    ray_d: Any
    distance: Any
    diffuse: Any
    gloss: Any
    weight: Any


class Gatherer:
    """Gathers light in one scene, along paths of up to ``depth`` surfaces."""

    # Not a dataclass: Dr.Jit would take it for loop state and write its fields.
    def __init__(self, follower: Follower) -> None:
        self._follower = follower
        self._path: PathIntegrator = follower.path

    @dr.syntax
    def gather(self, ray: Any, stream: SampleStream) -> tuple[Gathered, Any, Any]:
        """Light for every lane; further, rays traced (secondary and shadow)."""
        path, follow = self._path, self._follower

        # ---- to the surface ----
        way = follow.start(ray)
        color = mi.Color3f(0)
        stopped = mi.Bool(False)
        share = mi.Float(1)  # chance of having gathered here, of the ways there were
        active = mi.Bool(True)
        while dr.hint(active, label="ways"):
            si = way.pi.compute_surface_interaction(way.ray, ray_flags=mi.RayFlags.All)
            bsdf = si.bsdf(way.ray)
            color += dr.select(active, follow.emission(way, si), 0)
            s = split(si, bsdf, follow.kinds, active & si.is_valid())
            dimension = way.dimension()
            going_on = active & si.is_valid() & (way.depth < path.depth)
            opaque = stream.next_1d(dimension + 3) < s.opacity
            shares = going_on & opaque & (s.shares_diffuse | s.shares_rest)
            both = shares & s.follows_rest
            chance = dr.select(both, mi.Float(STAYING), 1)
            stops = shares & (stream.next_1d(dimension + 4) < chance)
            stopped |= stops
            share = dr.select(stops, chance, share)
            going_on &= ~stops
            color += follow.direct(way, si, bsdf, s, stream, going_on & opaque & s.follows_rest)
            follow.step(way, si, bsdf, s, stream, opaque, going_on, stops)
            active = going_on & way.alive
        gathered: tuple[Gathered, Any, Any] = self._light(way, color, stopped, share, stream)
        return gathered

    @dr.syntax
    def _light(self, way: Any, color: Any, stopped: Any, share: Any, stream: SampleStream) -> Any:
        path = self._path
        scene = path.scene
        context = mi.BSDFContext()

        # ---- light that falls straight on it ----
        ray, secondary, shadow = mi.Ray3f(way.ray), way.secondary, way.shadow
        si = way.pi.compute_surface_interaction(ray, ray_flags=mi.RayFlags.All)
        bsdf = si.bsdf(ray)
        s = split(si, bsdf, self._follower.kinds, stopped)
        first = LIGHT_DIMENSION
        ds, light = scene.sample_emitter_direction(si, stream.next_2d(first), False, stopped)
        lit = stopped & (ds.pdf != 0) & (dr.max(light) > 0)
        wo = si.to_local(ds.d)
        value, pdf, bs, _ = bsdf.eval_pdf_sample(
            context, si, wo, stream.next_1d(first + 1) * s.opacity, stream.next_2d(first + 2), stopped
        )
        cosine = self._follower.cosine(si, s, ds.d)
        rest = value / s.opacity - s.diffuse * cosine
        weight = dr.select(ds.delta, 1, mis_weight(ds.pdf, pdf / s.opacity))
        lit &= (cosine > 0) | (dr.max(value) > 0)
        visible, tests = path.visibility(si, ds, lit)
        arriving = dr.select(lit, light * weight * visible, 0)
        shadow += tests
        diffuse = arriving * cosine
        gloss = arriving * rest

        # ---- where the path goes on ----
        direction = si.to_world(bs.wo)
        value, pdf = bsdf.eval_pdf(context, si, bs.wo, stopped)
        pdf /= s.opacity
        going_on = stopped & (pdf > 0)
        inverse = dr.select(going_on, dr.rcp(pdf), 0)
        cosine = self._follower.cosine(si, s, direction)
        weight_diffuse = cosine * inverse
        weight_gloss = (value / s.opacity - s.diffuse * cosine) * inverse
        way_on = self._follower.onward(way, si, bs, direction, pdf)
        arriving, more_secondary, more_shadow = self._arriving(way_on, stream, going_on)
        diffuse += arriving * weight_diffuse
        gloss += arriving * weight_gloss
        # Where there was a choice, the rest is estimated either way: each counts by the chance of its being taken.
        color += dr.select(stopped, way.throughput * (s.diffuse * diffuse / share + gloss), 0)
        gloss = dr.select(s.shares_rest, gloss, 0)
        chance = dr.max(s.diffuse) / (dr.max(s.diffuse) + dr.select(s.shares_rest, dr.max(s.gloss), 0))
        gathered = Gathered(
            color=color,
            position=mi.Point3f(si.p),
            split=s,
            ray_d=mi.Vector3f(ray.d),
            distance=way.distance + si.t,
            diffuse=dr.select(s.shares_diffuse, diffuse, 0),
            gloss=gloss / s.gloss,
            weight=dr.maximum(chance, 1e-3),
        )
        return gathered, secondary + more_secondary, shadow + more_shadow

    @dr.syntax
    def _arriving(self, way: Any, stream: SampleStream, active: Any) -> tuple[Any, Any, Any]:
        """Light that comes along the ray of ``way``, by the plain path loop."""
        path = self._path
        scene = path.scene
        context = mi.BSDFContext()
        active = mi.Bool(active)
        ray, depth, crossings = mi.Ray3f(way.ray), mi.UInt32(way.depth), mi.UInt32(0)
        vertex, vertex_pdf, vertex_delta = way.vertex, mi.Float(way.vertex_pdf), mi.Bool(way.vertex_delta)
        absorption = mi.Color3f(way.absorption)
        radiance, throughput, eta = mi.Color3f(0), mi.Color3f(1), mi.Float(1)
        bounces = mi.UInt32(0)
        secondary, shadow = mi.UInt32(0), mi.UInt32(0)
        while dr.hint(active, label="light"):
            pi = scene.ray_intersect_preliminary(ray, coherent=False, active=active)
            secondary += dr.select(active, mi.UInt32(1), mi.UInt32(0))
            si = pi.compute_surface_interaction(ray, ray_flags=mi.RayFlags.All)
            bsdf = si.bsdf(ray)
            if dr.hint(path.traits.has_absorption, mode="scalar"):
                throughput *= dr.exp(-absorption * dr.select(si.is_valid(), si.t, 0))
            ds = mi.DirectionSample3f(scene, si=si, ref=vertex)
            weight = mis_weight(vertex_pdf, scene.pdf_emitter_direction(vertex, ds, ~vertex_delta))
            radiance += dr.select(active, throughput * ds.emitter.eval(si) * weight, 0)

            going_on = active & si.is_valid() & (depth < path.depth)
            dimension = LIGHT_DIMENSION + (bounces * 2 + crossings + 1) * DIMENSIONS_PER_VERTEX
            lit = going_on & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
            light, tests = path.drawn_light(si, bsdf, stream.next_2d(dimension), lit)
            radiance += throughput * light
            bs, bsdf_weight = bsdf.sample(
                context, si, stream.next_1d(dimension + 1), stream.next_2d(dimension + 2), going_on
            )
            shadow += tests

            passes = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
            throughput *= bsdf_weight
            eta *= bs.eta
            if dr.hint(path.traits.has_absorption, mode="scalar"):
                crosses = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Transmission) & ~passes
                inside = bs.wo.z < 0
                absorption = dr.select(crosses, dr.select(inside, path.traits.absorption_of(si.shape), 0), absorption)
            ray = si.spawn_ray(si.to_world(bs.wo))
            if ~passes:
                vertex = mi.Interaction3f(si)
                vertex_pdf = bs.pdf
                vertex_delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
                depth += 1
                bounces += 1
            else:
                crossings += 1
            going_on &= (dr.max(throughput) > 0) & (crossings < MAX_CROSSINGS)
            survival = dr.minimum(dr.max(throughput) * dr.square(eta), 0.95)
            at_stake = going_on & (depth >= path.roulette_depth) & ~passes
            throughput = dr.select(at_stake, throughput * dr.rcp(survival), throughput)
            going_on &= ~at_stake | (stream.next_1d(dimension + 3) < survival)
            active = going_on
        return radiance, secondary, shadow
