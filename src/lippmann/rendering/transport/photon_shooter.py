"""Shoots photons from emitters along specular chains; see :mod:`.caustic_photons` for their use."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide, to_numpy, upload
from lippmann.device.pbr.scene import SceneFeatures
from lippmann.device.pbr.surface_lobes import is_sharp_event
from lippmann.device.sobol import SampleStream
from lippmann.device.syntax import syntax
from lippmann.device.types import (
    Bool,
    Color3f,
    DirectionSample3f,
    MitsubaScene,
    Point3f,
    Ray3f,
    Spectrum,
    SurfaceInteraction3f,
    UInt32,
    Vector3f,
)
from lippmann.rendering.transport.casters import CasterPoints, Casters
from lippmann.rendering.transport.path_vertex import DIMENSIONS
from lippmann.rendering.transport.photon_map import Photons
from lippmann.rendering.transport.sharp_events import (
    MOST_EVENTS,
    facing_normal,
    has_wide_lobes,
    lambertian,
)
from lippmann.rendering.transport.tuning import TUNING


class PhotonShooter:
    """Shoots photons of one scene."""

    def __init__(self, scene: MitsubaScene, features: SceneFeatures, casters: Casters) -> None:
        self._scene = scene
        self._features = features
        self._casters = casters
        self._emitter_numbers = upload(casters.emitters)

    def shoot(self, count: int, chances: NDArray[np.float64], seed: int) -> tuple[Photons, NDArray[np.int64]]:
        """Photons of ``count`` emissions, shared among the pairs by ``chances``, and the pair of each photon."""
        # Each pair gets a fixed number of emissions, not a random one.
        each = np.maximum(1, np.round(chances * count)).astype(np.int64)
        pair = np.repeat(np.arange(len(each)), each)
        landed: list[Photons] = []
        pairs: list[NDArray[np.int64]] = []
        for first in range(0, len(pair), TUNING.lanes):
            part = pair[first : first + TUNING.lanes]
            photons, lanes = self._shoot_wavefront(part, each, first, seed)
            landed.append(photons)
            pairs.append(part[lanes])
        return Photons.join(landed), np.concatenate(pairs)

    def _lit_points(
        self, pair: NDArray[np.int64], stream: SampleStream
    ) -> tuple[CasterPoints, DirectionSample3f, Spectrum]:
        """Point on the caster, sampled direction to the emitter, and radiance over pdf, for each pair."""
        numbers, scene = upload(pair.astype(np.uint32)), self._scene
        caster, source = divide(numbers, len(self._casters.emitters))
        emitter = dr.gather(mi.EmitterPtr, scene.emitters_dr(), dr.gather(mi.UInt32, self._emitter_numbers, source))
        point = CasterPoints(scene, self._casters, caster, stream.next_2d(0), stream.next_1d(2))
        ds, light = emitter.sample_direction(point.reference(), stream.next_2d(1), mi.Bool(True))
        return point, ds, light

    def _shoot_wavefront(
        self, pair: NDArray[np.int64], each: NDArray[np.int64], first: int, seed: int
    ) -> tuple[Photons, NDArray[np.int64]]:
        """Photons of one wavefront that land on rough surfaces, and the lane of each."""
        lanes, features = len(pair), self._features
        share = upload((1.0 / each[pair]).astype(np.float32))
        # Opaque to the compiler, so that all wavefronts share a kernel.
        index = dr.arange(mi.UInt32, lanes) + dr.opaque(mi.UInt32, first)
        stream = SampleStream.of_pixels(mi.UInt32(0), index, dr.opaque(mi.UInt32, seed))
        ray, power = self._emit(pair, share, stream)
        o, d, is_lit = mi.Point3f(ray.o), mi.Vector3f(ray.d), dr.max(power) > 0
        dr.eval(o, d, power, is_lit)
        # Half of the points on a body face away from an emitter, and many lie in shadow: only the others are followed.
        lit = dr.compress(is_lit)
        if not dr.width(lit):
            return Photons.dark(0), np.zeros(0, np.int64)
        o, d, power = (dr.gather(type(each), each, lit) for each in (o, d, power))
        stream = SampleStream(stream.key, dr.gather(mi.UInt32, index, lit))
        surfaces = MOST_EVENTS + (MOST_EVENTS if features.has_null else 0)
        landed = _Landed(dr.width(lit), surfaces)
        self._follow(mi.Ray3f(o, d), power, mi.Bool(True), stream, landed, surfaces)
        photons, lanes_of_photons = landed.photons()
        return photons, np.array(lit, dtype=np.int64)[lanes_of_photons]

    def _emit(self, pair: NDArray[np.int64], share: mi.Float, stream: SampleStream) -> tuple[Ray3f, Color3f]:
        """Rays from emitters to the casters, and the flux along each; 0 where the way is blocked."""
        scene = self._scene
        point, ds, light = self._lit_points(pair, stream)
        active = (ds.pdf > 0) & (dr.max(light) > 0)
        power = mi.Color3f(light) * share
        # From the emitter to the point: tests visibility, and finds the surface there.
        ray = mi.Ray3f(point.p + ds.d * (ds.dist * (1 - 1e-3)), -ds.d)
        si = scene.ray_intersect(ray, mi.RayFlags.All, False, active)
        for _ in range(MOST_EVENTS if self._features.has_null else 0):
            other = active & si.is_valid() & ~point.is_met(si, ds.dist)
            through = si.bsdf(ray).eval_null_transmission(si, other)
            power = dr.select(other, power * through, power)
            active &= ~other | (dr.max(through) > 0)
            # Offset along the ray, not along the normal as Mitsuba's own, so that the ray ends at the point.
            step = TUNING.rounding * (1 + dr.max(dr.abs(si.p)))
            ray = dr.select(other, mi.Ray3f(si.p + ray.d * step, ray.d), ray)
            again = scene.ray_intersect(ray, mi.RayFlags.All, False, other & active)
            si = dr.select(other, again, si)
        active &= si.is_valid() & point.is_met(si, ds.dist)
        return ray, dr.select(active, power * point.cosine(si, ds.d) * point.area, 0)

    @syntax
    def _follow(
        self, ray: Ray3f, power: Color3f, active: Bool, stream: SampleStream, landed: _Landed, surfaces: int
    ) -> None:
        """Follows light along sharp events, and records where it lands after one or more.

        Each iteration is one surface.
        """
        scene, features = self._scene, self._features
        o, d = mi.Point3f(ray.o), mi.Vector3f(ray.d)
        power, active = mi.Color3f(power), mi.Bool(active)
        events, turn = mi.UInt32(0), mi.UInt32(0)
        absorption = None if features.absorption is None else mi.Color3f(0)
        while dr.hint(active, label="photon events", exclude=[scene, features, stream, landed, surfaces]):
            si = scene.ray_intersect(mi.Ray3f(o, d), mi.RayFlags.All, False, active)
            active &= si.is_valid()
            power = _absorb(power, absorption, si)
            landed.note(si, power, events, turn, active & (events > 0))
            active &= turn < surfaces
            o, d, power, events, absorption, active = self._spawn_next(
                si, power, events, absorption, active, stream, DIMENSIONS * (turn + 1)
            )
            turn += 1

    def _spawn_next(
        self,
        si: SurfaceInteraction3f,
        power: Spectrum,
        events: UInt32,
        absorption: Color3f | None,
        active: Bool,
        stream: SampleStream,
        dimension: UInt32,
    ) -> tuple[Point3f, Vector3f, Spectrum, UInt32, Color3f | None, Bool]:
        """The next ray of a photon, and its state after the event; inactive where the event is not sharp."""
        bsdf = si.bsdf()
        context = mi.BSDFContext(mi.TransportMode.Importance)
        bs, weight = bsdf.sample(context, si, stream.next_1d(dimension), stream.next_2d(dimension + 1), active)
        passes = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
        wo = si.to_world(bs.wo)
        # Light that passes the first surface starts at the next.
        active &= ~passes | (events > 0)
        active &= is_sharp_event(bs)
        # Adjoint of shading normals: Veach 1997, eq. 5.19.
        into, out = dr.dot(si.n, si.to_world(si.wi)), dr.dot(si.n, wo)
        active &= passes | ((into * si.wi.z > 0) & (out * bs.wo.z > 0))
        correction = dr.select(passes, 1, dr.abs(si.wi.z * out / (bs.wo.z * into)))
        power = power * weight * correction
        events = events + dr.select(passes, mi.UInt32(0), mi.UInt32(1))
        active &= (dr.max(power) > 0) & (events <= MOST_EVENTS)
        if absorption is not None:
            crosses = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Transmission) & ~passes
            within = dr.select(bs.wo.z < 0, self._features.absorption_of(si.shape), 0)
            absorption = dr.select(crosses, within, absorption)
        ray = si.spawn_ray(wo)
        return ray.o, ray.d, power, events, absorption, active


def _absorb(power: Color3f, absorption: Color3f | None, si: SurfaceInteraction3f) -> Color3f:
    """``power`` after Beer-Lambert absorption on the way to ``si``."""
    return power if absorption is None else power * dr.exp(-absorption * dr.select(si.is_valid(), si.t, 0))


class _Landed:
    """Table of landed photons of one kernel: at most one per lane and surface."""

    def __init__(self, lanes: int, surfaces: int) -> None:
        self._lanes = lanes
        self._number = dr.opaque(mi.UInt32, lanes)
        rows = lanes * surfaces
        #: Sharp events on each photon's path; 0 marks a row without a photon, whose other values are undefined.
        self._events = dr.zeros(mi.UInt32, rows)
        self._values = [dr.empty(mi.Float, 3 * rows) for _ in range(4)]
        dr.eval(self._events, self._values)

    def note(self, si: SurfaceInteraction3f, power: Color3f, events: UInt32, turn: UInt32, active: Bool) -> None:
        """Record light with flux ``power`` that arrives at ``si``, surface number ``turn`` after the first."""
        bsdf = si.bsdf()
        active = active & (dr.max(power) > 0)
        lambert = lambertian(si, bsdf, active)
        active &= (dr.max(lambert) > 0) | has_wide_lobes(si, bsdf, active)
        row = dr.arange(mi.UInt32, self._lanes) + (turn - 1) * self._number
        dr.scatter(self._events, events, row, active)
        vectors = si.p, facing_normal(si), si.to_world(si.wi), power
        for values, vector in zip(self._values, vectors, strict=True):
            dr.scatter(values, mi.Vector3f(vector), row, active)

    def photons(self) -> tuple[Photons, NDArray[np.int64]]:
        """The landed photons, and the lane of each."""
        events = np.array(self._events)
        rows = np.flatnonzero(events)
        lanes = rows % self._lanes
        if not len(rows):
            return Photons.dark(0), lanes
        row = upload(rows.astype(np.uint32))
        vectors = [dr.gather(mi.Point3f, values, row) for values in self._values]
        dr.eval(vectors)
        position, normal, toward, power = (to_numpy(vector, len(rows)) for vector in vectors)
        return Photons(position, normal, toward, power, events[rows]), lanes
