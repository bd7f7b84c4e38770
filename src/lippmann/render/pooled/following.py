"""The way from a pixel to where light can be shared, through mirrors, glass and sharp reflections."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from lippmann.render.integrators.path import MAX_CROSSINGS, PathIntegrator, mis_weight
from lippmann.render.pooled.surfaces import Kinds, Split
from lippmann.render.sampling import SampleStream

#: Sample dimensions used at one surface of the way.
DIMENSIONS = 6


@dataclass
class Way:
    """State of a way, to be carried through a loop.

    ``pi`` is what ``ray`` meets; ``throughput`` what of the light there reaches the pixel; ``vertex`` the last surface
    that scattered, for the density of emitter sampling; ``alive`` whether there is any light left to follow.
    """

    ray: mi.Ray3f
    pi: mi.PreliminaryIntersection3f
    throughput: mi.Color3f
    absorption: mi.Color3f
    depth: mi.UInt32
    crossings: mi.UInt32
    vertex: mi.Interaction3f
    vertex_pdf: mi.Float
    vertex_delta: mi.Bool
    distance: mi.Float
    alive: mi.Bool
    secondary: mi.UInt32
    shadow: mi.UInt32

    def dimension(self) -> Any:
        """First sample dimension of the next surface."""
        return (self.depth + self.crossings) * DIMENSIONS + 1


class Follower:
    """Follows ways through one scene: the steps that gathering and looking have in common."""

    # Not a dataclass: Dr.Jit would take it for loop state and write its fields.
    def __init__(self, path: PathIntegrator) -> None:
        self.path = path
        self.kinds = Kinds.of(path.scene, path.traits.has_null)

    def start(self, ray: Any) -> Way:
        """The way of primary rays."""
        ray = mi.Ray3f(ray)
        return Way(
            ray=ray,
            pi=self.path.scene.ray_intersect_preliminary(ray, coherent=True),
            throughput=mi.Color3f(1),
            absorption=mi.Color3f(0),
            depth=mi.UInt32(0),
            crossings=mi.UInt32(0),
            vertex=dr.zeros(mi.Interaction3f),
            vertex_pdf=mi.Float(1),
            vertex_delta=mi.Bool(True),
            distance=mi.Float(0),
            alive=mi.Bool(True),
            secondary=mi.UInt32(0),
            shadow=mi.UInt32(0),
        )

    def cosine(self, si: Any, split: Split, direction: Any) -> Any:
        """What a white diffuse surface sends back of light from ``direction``, over its radiance."""
        above = si.to_local(direction).z * dr.select(si.wi.z < 0, -1.0, 1.0) > 0
        return dr.select(above, dr.maximum(dr.dot(split.normal, direction), 0) * dr.inv_pi, 0)

    def emission(self, way: Way, si: Any) -> Any:
        """Light that what the ray met gives off by itself, as it reaches the pixel."""
        path = self.path
        if path.traits.has_absorption:
            way.throughput = way.throughput * dr.exp(-way.absorption * dr.select(si.is_valid(), si.t, 0))
        ds = mi.DirectionSample3f(path.scene, si=si, ref=way.vertex)
        density = path.scene.pdf_emitter_direction(way.vertex, ds, ~way.vertex_delta)
        emitted = ds.emitter.eval(si) * mis_weight(way.vertex_pdf, density)
        if path.traits.background is not None:
            emitted = dr.select((way.depth == 0) & ~si.is_valid(), mi.Color3f(path.traits.background), emitted)
        return way.throughput * emitted

    def direct(self, way: Way, si: Any, bsdf: Any, split: Split, stream: SampleStream, active: Any) -> Any:
        """Light of lamps in a sharp reflection, as it reaches the pixel."""
        path = self.path
        lit = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        ds, light = path.scene.sample_emitter_direction(si, stream.next_2d(way.dimension()), False, lit)
        value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, si.to_local(ds.d), lit)
        rest = value / split.opacity - split.diffuse * self.cosine(si, split, ds.d)
        weight = dr.select(ds.delta, 1, mis_weight(ds.pdf, pdf / split.opacity))
        arriving = way.throughput * rest * light * weight
        lit &= (ds.pdf != 0) & (dr.max(dr.abs(arriving)) > 1e-4)
        visible, tests = path.visibility(si, ds, lit)
        way.shadow = way.shadow + tests
        return dr.select(lit, arriving * visible, 0)

    def step(
        self,
        way: Way,
        si: Any,
        bsdf: Any,
        split: Split,
        stream: SampleStream,
        opaque: Any,
        active: Any,
        stays: Any,
    ) -> None:
        """On to the next surface; ways that ``stays`` holds keep their place."""
        path = self.path
        dimension = way.dimension()
        u = stream.next_1d(dimension + 1)
        flags = bsdf.flags()
        smooth = mi.has_flag(flags, mi.BSDFFlags.Smooth)
        # Whether the surface is there at this point has been decided: the draw must agree.
        partly = split.opacity < 1
        u = dr.select(partly, dr.select(opaque, u * split.opacity, split.opacity + u * (1 - split.opacity)), u)
        bs, weight = bsdf.sample(mi.BSDFContext(), si, u, stream.next_2d(dimension + 2), active)
        passes = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
        delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        direction = si.to_world(bs.wo)
        pdf = dr.select(passes, bs.pdf, bs.pdf / split.opacity)
        shared = split.diffuse * self.cosine(si, split, direction) / pdf
        kept = dr.select(smooth & ~delta & ~passes, weight - shared, weight)
        kept = dr.select(pdf > 0, kept, 0)
        onward = self.onward(way, si, bs, direction, pdf)
        goes = active & (passes | split.follows_rest) & (dr.max(dr.abs(kept * way.throughput)) > 1e-4)
        goes &= onward.crossings < MAX_CROSSINGS
        pi = path.scene.ray_intersect_preliminary(onward.ray, coherent=False, active=goes)
        for name in ("ray", "absorption", "depth", "crossings", "vertex", "vertex_pdf", "vertex_delta", "distance"):
            setattr(way, name, dr.select(stays, getattr(way, name), getattr(onward, name)))
        way.pi = dr.select(stays, way.pi, pi)
        way.throughput = dr.select(stays, way.throughput, way.throughput * kept)
        way.alive = goes
        way.secondary = way.secondary + dr.select(goes, mi.UInt32(1), mi.UInt32(0))

    def onward(self, way: Way, si: Any, bs: Any, direction: Any, pdf: Any) -> Way:
        """The way that leaves ``si`` along ``direction``; what it meets is not looked for."""
        traits = self.path.traits
        passes = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
        absorption = way.absorption
        if traits.has_absorption:
            crosses = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Transmission) & ~passes
            inside = dr.select(bs.wo.z < 0, traits.absorption_of(si.shape), 0)
            absorption = dr.select(crosses, inside, absorption)
        one, none = mi.UInt32(1), mi.UInt32(0)
        return Way(
            ray=si.spawn_ray(direction),
            pi=way.pi,
            throughput=way.throughput,
            absorption=mi.Color3f(absorption),
            depth=way.depth + dr.select(passes, none, one),
            crossings=way.crossings + dr.select(passes, one, none),
            vertex=dr.select(passes, way.vertex, mi.Interaction3f(si)),
            vertex_pdf=dr.select(passes, way.vertex_pdf, pdf),
            vertex_delta=dr.select(passes, way.vertex_delta, mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)),
            distance=way.distance + si.t,
            alive=way.alive,
            secondary=way.secondary,
            shadow=way.shadow,
        )
