"""Rays from emitters, and the surface points that they hit: light vertices one bounce away from the emitter."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import to_numpy, upload
from lippmann.device.pbr.even_points import PointOf, evenly, no_point
from lippmann.device.sobol import SampleStream
from lippmann.device.types import Bool, EmitterPtr, Float, MitsubaScene, Point3f, SurfaceInteraction3f, Vector3f
from lippmann.rendering.transport.light_sampling import LightSampler, by_registry, registry_numbers
from lippmann.rendering.transport.sharp_events import facing_normal, lambertian

Floats = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class LitPoints:
    """Points where rays from emitters end; all arrays have ``n`` rows.

    Attributes
    ----------
    position, normal, shading:
        ``(n, 3)``: the point, and the unit geometric and shading normals on the side that is lit; world space.
    glow:
        ``(n, 3)``: radiance that the point scatters, divided by the pdf of such points per area.
    reach:
        ``(n,)``: pdf of such points per area.
    sampled:
        ``(n,)``: pdf with which emitter sampling at the point gives the ray's origin.
    scattered:
        ``(n,)``: ``cos / pi``, the pdf with which Lambertian scattering at the point gives it; 0 for delta emitters.
    """

    position: Floats
    normal: Floats
    shading: Floats
    glow: Floats
    reach: Floats
    sampled: Floats
    scattered: Floats

    def __len__(self) -> int:
        return len(self.reach)


class EmitterRays:
    """Rays from the emitters of a scene that have a place: surfaces, points and spots.

    Rays from surfaces start uniformly over the area, cosine-distributed about the normal, on both sides of two-sided
    emitters. Rays from delta emitters are uniform over all directions.

    Parameters
    ----------
    scene:
        A ``mi.Scene``.
    sampler:
        The light sampler of next-event estimation.
    """

    def __init__(self, scene: MitsubaScene, sampler: LightSampler) -> None:
        self._scene = scene
        self._sampler = sampler
        self._emitters = scene.emitters_dr()
        # Emitter pointers are compared by their registry numbers.
        numbers = registry_numbers(self._emitters)
        flags = np.array(self._emitters.flags()).reshape(-1)
        has_place = (flags & int(mi.EmitterFlags.DeltaPosition)) != 0
        areas = np.zeros(len(numbers))
        starts: dict[int, PointOf] = {}
        for shape in scene.shapes():
            point, area = evenly(shape) if shape.is_emitter() else (None, 0.0)
            if point is not None:
                place = int(np.flatnonzero(numbers == registry_numbers(mi.EmitterPtr(shape.emitter())))[0])
                areas[place], starts[place] = area, point
        self._has_size = areas > 0
        #: Indices of the scene's emitters that send rays.
        self.senders = np.flatnonzero(self._has_size | has_place)
        self._starts = [starts.get(int(place), no_point) for place in self.senders]
        self._two_sided = self._has_size & [bool(getattr(each, "two_sided", False)) for each in scene.emitters()]
        #: Density of rays: per projected area and steradian of a surface, per steradian about a point.
        self._density = np.where(self._has_size, 1 / (np.pi * np.where(self._has_size, areas, 1)), 1 / (4 * np.pi))
        self._density[self._two_sided] /= 2

    def densities(self, chances: NDArray[np.float64]) -> Floats:
        """Rays per emitter and unit of its density, by the emitter's number in Dr.Jit's registry; negative where it is
        two-sided. ``chances`` are the probabilities of the :attr:`senders`.
        """
        values = np.zeros(len(self._density))
        values[self.senders] = (np.where(self._two_sided, -1, 1) * self._density)[self.senders] * chances
        return by_registry(self._emitters, values)

    def meet(
        self, chosen: NDArray[np.int64], chances: NDArray[np.float64], seed: int
    ) -> tuple[LitPoints, NDArray[np.bool_]]:
        """Light vertices, and a mask of the rays that hit one.

        Parameters
        ----------
        chosen:
            Index into :attr:`senders` for each ray.
        chances:
            Share of the rays of each sender.
        seed:
            0 to 2**32 - 1: the same gives the same rays.
        """
        scene, count = self._scene, len(chosen)
        place = self.senders[chosen]
        emitter = dr.gather(mi.EmitterPtr, self._emitters, upload(place.astype(np.uint32)))
        has_size = upload(self._has_size[place].astype(np.uint32)) > 0
        density = upload((self._density[place] * chances[chosen]).astype(np.float32))
        stream = SampleStream.of_pixels(mi.UInt32(0), dr.arange(mi.UInt32, count), dr.opaque(mi.UInt32, seed))
        direction = stream.next_2d(1)
        # Not a virtual call, which would include all shapes of the scene: some cannot be sampled.
        p, n = dr.switch(upload(chosen.astype(np.uint32)), self._starts, stream.next_2d(0))
        n = dr.select((upload(self._two_sided[place].astype(np.uint32)) > 0) & (stream.next_1d(2) < 0.5), -n, n)
        anywhere = dr.zeros(mi.Interaction3f, count)
        anywhere.p = mi.Point3f(scene.bbox().max)
        center = emitter.sample_direction(anywhere, mi.Point2f(0.5), ~has_size)[0].p
        start = dr.zeros(mi.SurfaceInteraction3f, count)
        start.p, start.n = dr.select(has_size, p, center), mi.Normal3f(n)
        from_surface = mi.Frame3f(n).to_world(mi.warp.square_to_cosine_hemisphere(direction))
        from_point = mi.warp.square_to_uniform_sphere(direction)
        ray = dr.select(has_size, start.spawn_ray(from_surface), mi.Ray3f(center, from_point))
        si = scene.ray_intersect(ray, mi.RayFlags.All, False, mi.Bool(True))
        return self._scatter(si, ray.d, emitter, center, has_size, density)

    def _scatter(
        self,
        si: SurfaceInteraction3f,
        along: Vector3f,
        emitter: EmitterPtr,
        center: Point3f,
        has_size: Bool,
        density: Float,
    ) -> tuple[LitPoints, NDArray[np.bool_]]:
        scene = self._scene
        bsdf = si.bsdf()
        lit = si.is_valid()
        albedo = lambertian(si, bsdf, lit)
        normal, shading = facing_normal(si), si.sh_frame.n * dr.sign(si.wi.z)
        cosine, geometric = dr.abs(si.wi.z), dr.dot(normal, -along)
        lit &= ~mi.has_flag(bsdf.flags(), mi.BSDFFlags.Null)
        lit &= (dr.max(albedo) > 0) & (cosine > 0) & (geometric > 0)
        # Seen from the back, a one-sided surface reflects nothing: it scatters no light.
        mirrored = mi.Vector3f(-si.wi.x, -si.wi.y, si.wi.z)
        lit &= dr.max(bsdf.eval(mi.BSDFContext(), si, mirrored, lit)) > 0
        # Emitted radiance toward the point, and the pdf of emitter sampling.
        back = scene.ray_intersect(si.spawn_ray(-along), mi.RayFlags.All, False, lit & has_size)
        ds = mi.DirectionSample3f(scene, si=back, ref=si)
        of_surface = dr.select(ds.emitter == emitter, mi.Color3f(emitter.eval(back, lit & has_size)), 0)
        sampled = self._sampler.pdf_direction(si, ds, lit & has_size)
        _, of_point = emitter.sample_direction(si, mi.Point2f(0.5), lit & ~has_size)
        squared = dr.squared_norm(center - si.p)
        light = dr.select(has_size, of_surface, mi.Color3f(of_point))
        density = dr.select(has_size, density, density / squared)
        sampled = dr.select(has_size, sampled, self._sampler.probability(emitter))
        lit &= dr.max(light) > 0
        glow = dr.select(lit, albedo * dr.inv_pi * light * (cosine / geometric) / density, 0)
        dr.eval(si.p, normal, shading, glow, geometric, density, sampled, cosine, lit)
        kept = np.array(lit).reshape(-1)

        def rows(values: Float | Vector3f) -> Floats:
            return np.asarray(to_numpy(values, len(kept))[kept])

        return LitPoints(
            rows(si.p),
            rows(normal),
            rows(shading),
            rows(glow),
            rows(density * geometric),
            rows(sampled),
            rows(dr.select(has_size, cosine * dr.inv_pi, 0)),
        ), kept
