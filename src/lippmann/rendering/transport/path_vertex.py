"""Vertices of a path, as its loop and its techniques see them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import drjit as dr
import mitsuba as mi

from lippmann.device.pbr.surface_lobes import is_sharp_event
from lippmann.device.sobol import SampleStream
from lippmann.device.types import (
    Bool,
    BSDFPtr,
    BSDFSample3f,
    Color3f,
    Float,
    Point3f,
    Ray3f,
    Spectrum,
    SurfaceInteraction3f,
    UInt32,
    Vector3f,
)
from lippmann.rendering.transport.light_vertices import Arrival
from lippmann.rendering.transport.sharp_events import has_wide_lobes, lambertian, sharp_lobe

#: Sample dimensions of one vertex of any path, chain or photon: none of them uses more.
DIMENSIONS = 8


@dataclass
class LastVertex:
    """Where a path last scattered; straight-through surfaces do not count.

    ``pdf`` per steradian is that of the direction taken there, ``is_delta`` says that the lobe had no width;
    ``emitter_samples`` is how many are taken at the point ``p``.
    """

    p: Point3f
    pdf: Float
    is_delta: Bool
    emitter_samples: UInt32

    @classmethod
    def eye(cls) -> LastVertex:
        """The eye: BSDF sampling has MIS weight 1 there."""
        return cls(mi.Point3f(0), mi.Float(1), mi.Bool(True), mi.UInt32(1))


class Vertex:
    """A surface that a path has met.

    Attributes
    ----------
    si, bsdf:
        The point, and its BSDF.
    trail, depth:
        How the path came here, and its ``depth``.
    active:
        Lanes that go on from here.
    throughput:
        Of the path up to here.
    stream, dimension:
        Random numbers, and the first sample dimension of this vertex.
    states:
        Of the path's techniques.
    is_in_clear:
        Whether the ray came through a medium that absorbs nothing.
    arrival:
        Weighs emitter samples against light vertices by MIS; None without light vertices.
    """

    def __init__(
        self,
        si: SurfaceInteraction3f,
        bsdf: BSDFPtr,
        trail: Trail,
        active: Bool,
        throughput: Spectrum,
        stream: SampleStream,
        states: list[Any],
    ) -> None:
        self.si, self.bsdf, self.trail, self.states = si, bsdf, trail, states
        self.active, self.throughput, self.stream = active, throughput, stream
        self.depth, self.dimension = trail.depth, (trail.depth * 2 + trail.crossings) * DIMENSIONS + 1
        self.is_in_clear: Bool = mi.Bool(True)
        self.arrival: Arrival | None = None

    @property
    def smooth(self) -> Bool:
        """Whether emitters are sampled here."""
        return self.active & mi.has_flag(self.bsdf.flags(), mi.BSDFFlags.Smooth)

    # Evaluated at first use: outside the loop over emitter samples, see Technique.reads.
    @cached_property
    def lobe(self) -> Vector3f:
        return sharp_lobe(self.si, self.bsdf, self.active)

    @cached_property
    def albedo(self) -> Color3f:
        """Albedo of the Lambertian part of the surface's BSDF."""
        return lambertian(self.si, self.bsdf, self.active)

    @cached_property
    def has_wide_lobes(self) -> Bool:
        return has_wide_lobes(self.si, self.bsdf, self.active)


class Scattering:
    """A direction that a path takes from a vertex: the BSDF sample ``bs``, and its ``weight``."""

    def __init__(self, vertex: Vertex, bs: BSDFSample3f, weight: Spectrum) -> None:
        self.bs, self.weight = bs, weight
        self.passes = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
        self.is_event = vertex.active & ~self.passes

    @cached_property
    def is_rough(self) -> Bool:
        """Whether the event is neither sharp nor straight through."""
        return self.is_event & ~is_sharp_event(self.bs)

    @property
    def scattered(self) -> Color3f:
        """The BSDF times the cosine."""
        return mi.Color3f(self.weight) * self.bs.pdf


@dataclass
class Trail:
    """How a path has come from the eye to its current ray, from ``o`` along ``d`` in world space.

    ``depth`` and ``crossings`` count the surfaces hit so far, those that scattered and those passed straight through.
    ``last`` is where it last scattered. ``all_specular`` says that no emitter has been sampled yet.
    """

    o: Point3f
    d: Vector3f
    depth: UInt32
    crossings: UInt32
    last: LastVertex
    all_specular: Bool

    @classmethod
    def along(cls, ray: Ray3f) -> Trail:
        """That of a path that begins with ``ray``."""
        o, d = mi.Point3f(ray.o), mi.Vector3f(ray.d)
        return cls(o, d, mi.UInt32(0), mi.UInt32(0), LastVertex.eye(), mi.Bool(True))

    @property
    def ray(self) -> Ray3f:
        """The current ray."""
        return mi.Ray3f(self.o, self.d)

    def extend(self, vertex: Vertex, scattering: Scattering, samples: UInt32) -> Trail:
        """The trail after ``vertex``, where ``samples`` emitter samples are taken."""
        bs, passes = scattering.bs, scattering.passes
        onward = vertex.si.spawn_ray(vertex.si.to_world(bs.wo))
        here = LastVertex(mi.Point3f(vertex.si.p), bs.pdf, mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta), samples)
        return Trail(
            mi.Point3f(onward.o),
            mi.Vector3f(onward.d),
            self.depth + dr.select(passes, mi.UInt32(0), 1),
            self.crossings + dr.select(passes, mi.UInt32(1), 0),
            dr.select(passes, self.last, here),
            self.all_specular & (passes | ~mi.has_flag(vertex.bsdf.flags(), mi.BSDFFlags.Smooth)),
        )
