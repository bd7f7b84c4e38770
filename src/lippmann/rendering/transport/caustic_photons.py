"""Photons from emitters by way of mirrors, glass and smooth gloss to the rough surfaces where they make caustics.

Paths from the eye meet such light only where they happen upon the emitter: hardly ever a small one, and never a point
or a direction. Photons start at the *caster*, the surface that bends the light: a point on it, a direction to the
emitter, and back along it. So none misses, and every emitter works that can be sampled.

What is gathered is exactly what :class:`~lippmann.rendering.transport.path.PathIntegrator` leaves out: light that comes
by sharp events alone (:mod:`lippmann.rendering.transport.sharp_events`), one at least and :data:`MOST_EVENTS` at most,
from an emitter other than the environment to the first rough surface of a camera path, and is scattered there by a
Lambertian lobe.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.pbr.gltf_bsdf import SHARP_LOBE
from lippmann.device.sobol import SampleStream
from lippmann.device.types import Bool, Color3f, MitsubaScene, Spectrum, SurfaceInteraction3f, UInt32
from lippmann.rendering.transport.photon_map import PhotonMap, Photons
from lippmann.rendering.transport.scene_features import SceneFeatures
from lippmann.rendering.transport.sharp_events import (
    MOST_EVENTS,
    facing_normal,
    follows_sharply,
    has_wide_lobes,
    lambertian,
    sharp_lobe,
)

#: Straight-through surfaces on its way, at most.
_MOST_CROSSINGS = 4
#: Emissions of the pilot for each emitter and caster, and in all.
PILOT_OF_PAIR, PILOT = 4096, 1 << 20
#: Share of the emissions that goes to all pairs alike, whatever the pilot met.
_UNIFORM_SHARE = 0.1
#: Emissions of each half: one for so many samples of the picture, within limits.
SAMPLES_OF_EMISSION, FEWEST, MOST = 16, 1 << 18, 1 << 21
#: Photons within the radius of a look-up, as a rule, where there are :data:`FEWEST` emissions.
NEIGHBOURS = 50
#: Photons by which the radius is found.
_PROBED = 2000
_SEED_STEPS = (0xB5297A4D, 0x68E31DA4)
_PILOT_STEP = 0x1B56C4E9
#: The point met on the way from an emitter is the one that was drawn if it is nearer than this part of the way, and
#: their normals agree to this cosine: the back of a thin body is another point.
_SAME_POINT, _SAME_SIDE = 1e-5, 0.5
#: How far a ray goes on behind a straight-through surface, relative to its coordinates.
_CLEARANCE = 1e-4
#: Emitters are small whose area is less than this part of the square of the scene's diagonal.
SMALL = 1e-3
#: Dimensions of the sample stream at one surface.
_DIMENSIONS = 2
_NONE = Photons.dark(0)


@dataclass(frozen=True, eq=False)
class Casters:
    """What can make caustics in a scene: indices of emitters and of shapes, and every pair of them.

    ``missing`` says why some could not be used; empty if all can.
    """

    emitters: NDArray[np.uint32]
    shapes: NDArray[np.uint32]
    missing: str = ""

    @property
    def pairs(self) -> int:
        """Number of pairs of an emitter and a caster."""
        return len(self.emitters) * len(self.shapes)


def find_casters(scene: MitsubaScene) -> Casters:
    """Emitters other than the environment, and shapes with lobes that may be sharp."""
    environment = scene.environment()
    emitters = [number for number, each in enumerate(scene.emitters()) if each is not environment]
    shapes, missing = [], ""
    for number, shape in enumerate(scene.shapes()):
        if shape.class_name() == "Instance":  # what it shows lies in its group, and may be sharp
            missing = "instances"
            continue
        if not _may_be_sharp(shape.bsdf()):
            continue
        if not 0 < _area(shape) < math.inf or not _gives_points(shape):
            missing = "curves and other shapes without points of their own"
            continue
        shapes.append(number)
    return Casters(np.array(emitters, np.uint32), np.array(shapes, np.uint32), missing)


def hides_caustics(scene: MitsubaScene) -> bool:
    """Whether a scene has mirrors, glass or smooth gloss, and an emitter so small that paths hardly find it by them."""
    return _has_small_emitter(scene) and any(_may_be_sharp(shape.bsdf()) for shape in scene.shapes())


def _has_small_emitter(scene: MitsubaScene) -> bool:
    if any(mi.has_flag(emitter.flags(), mi.EmitterFlags.Delta) for emitter in scene.emitters()):
        return True
    box = scene.bbox()
    small = SMALL * float(dr.squared_norm(box.max - box.min))
    return any(_area(shape) < small for shape in scene.shapes() if shape.is_emitter())


def _area(shape: mi.Shape) -> float:
    """Area of a shape; not a number for shapes that do not tell it."""
    try:
        return float(np.array(shape.surface_area()).ravel()[0])
    except (RuntimeError, NotImplementedError):
        return math.nan


def _may_be_sharp(bsdf: mi.BSDF) -> bool:
    if int(bsdf.flags()) & int(mi.BSDFFlags.DeltaReflection | mi.BSDFFlags.DeltaTransmission):
        return True
    return bool(np.any(np.array(bsdf.has_attribute(SHARP_LOBE, True))))


def _gives_points(shape: mi.Shape) -> bool:
    try:
        point = shape.sample_position(0.0, mi.Point2f(0.5), True)
        return bool(np.isfinite(np.array(point.p)).all() and np.array(point.pdf).ravel()[0] > 0)
    except (RuntimeError, NotImplementedError):
        return False


def no_photons() -> PhotonMap:
    """A map in place of paths to which nothing comes."""
    return PhotonMap((_NONE, _NONE), 1.0)


def emissions(samples: int) -> int:
    """Emissions of each half for a picture of so many samples in all."""
    return int(np.clip(samples // SAMPLES_OF_EMISSION, FEWEST, MOST))


def shoot_photons(
    scene: MitsubaScene, features: SceneFeatures, casters: Casters, *, samples: int, seed: int
) -> PhotonMap:
    """Photons for a picture of so many samples in all, in two sets; empty where there are no caustics.

    The numbers of emissions of each emitter and caster follow from a pilot: in proportion to the roots of the second
    moments of what they bring, but for a share that all have alike.
    """
    if casters.pairs == 0:
        return no_photons()
    shooter = PhotonShooter(scene, features, casters)
    pilot = min(PILOT_OF_PAIR, max(64, PILOT // casters.pairs)) * casters.pairs
    even = np.full(casters.pairs, 1 / casters.pairs)
    photons, pair = shooter.shoot(pilot, even, (seed + _PILOT_STEP) % 2**32)
    if not len(photons):
        return no_photons()
    moments = np.bincount(pair, np.square(photons.power.astype(np.float64)).sum(axis=1), minlength=casters.pairs)
    roots = np.sqrt(moments)
    chances = _UNIFORM_SHARE * even + (1 - _UNIFORM_SHARE) * roots / roots.sum()
    count = emissions(samples)
    first, second = (shooter.shoot(count, chances, (seed + step) % 2**32)[0] for step in _SEED_STEPS)
    return PhotonMap((first, second), _radius(first, NEIGHBOURS * math.sqrt(count / FEWEST)))


def _radius(photons: Photons, neighbours: float) -> float:
    """The distance to the neighbour of that number, of the middle one of some photons."""
    from scipy.spatial import cKDTree

    number = int(min(max(2, round(neighbours)), max(2, len(photons) // 2)))
    if len(photons) < 3:
        return float(np.ptp(photons.position, axis=0).max()) or 1.0
    probed = photons.position[:: max(1, len(photons) // _PROBED)]
    distances, _ = cKDTree(photons.position).query(probed, k=[number])
    return float(np.median(distances)) or float(distances.max()) or 1.0


class PhotonShooter:
    """Shoots photons of one scene."""

    def __init__(self, scene: MitsubaScene, features: SceneFeatures, casters: Casters) -> None:
        self._scene = scene
        self._features = features
        self._casters = casters
        shapes = scene.shapes()
        areas = [_area(shapes[int(number)]) for number in casters.shapes]
        self._areas = mi.Float(np.array(areas, np.float32))
        self._emitter_numbers, self._shape_numbers = mi.UInt32(casters.emitters), mi.UInt32(casters.shapes)

    def shoot(self, count: int, chances: NDArray[np.float64], seed: int) -> tuple[Photons, NDArray[np.int64]]:
        """``count`` emissions of pairs drawn by ``chances``: photons that landed, and their pairs."""
        # Every pair gets its number of emissions, not a chance of them.
        each = np.maximum(1, np.round(chances * count)).astype(np.int64)
        pair = np.repeat(np.arange(len(each)), each)
        landed: list[Photons] = []
        pairs: list[NDArray[np.int64]] = []
        for first in range(0, len(pair), 1 << 18):
            part = pair[first : first + (1 << 18)]
            for photons, lanes in self._wavefront(part, each, first, seed):
                landed.append(photons)
                pairs.append(part[lanes])
        return Photons.joined([_NONE, *landed]), np.concatenate([np.zeros(0, np.int64), *pairs])

    def _wavefront(
        self, pair: NDArray[np.int64], each: NDArray[np.int64], first: int, seed: int
    ) -> list[tuple[Photons, NDArray[np.int64]]]:
        """Photons that land after one sharp event, after two and so on, and the lanes of each."""
        scene, lanes = self._scene, len(pair)
        numbers = mi.UInt32(pair.astype(np.uint32))
        share = mi.Float((1.0 / each[pair]).astype(np.float32))
        # What differs from wavefront to wavefront is opaque to the compiler, so that all share their kernels.
        index = dr.arange(mi.UInt32, lanes) + dr.opaque(mi.UInt32, first)
        stream = SampleStream.of_pixels(mi.UInt32(0), index, dr.opaque(mi.UInt32, seed))
        caster = numbers // len(self._casters.emitters)
        source = numbers - caster * len(self._casters.emitters)
        shape = dr.gather(mi.ShapePtr, scene.shapes_dr(), dr.gather(mi.UInt32, self._shape_numbers, caster))
        emitter = dr.gather(mi.EmitterPtr, scene.emitters_dr(), dr.gather(mi.UInt32, self._emitter_numbers, source))

        point = shape.sample_position(mi.Float(0), stream.next_2d(0), mi.Bool(True))
        reference = dr.zeros(mi.SurfaceInteraction3f, lanes)
        reference.p, reference.n = point.p, point.n
        ds, light = emitter.sample_direction(reference, stream.next_2d(1), mi.Bool(True))
        active = (ds.pdf > 0) & (dr.max(light) > 0)
        power = mi.Color3f(light) * share
        # From the emitter to the point: tells whether one sees the other, and what surface is met there.
        ray = mi.Ray3f(point.p + ds.d * (ds.dist * (1 - 1e-3)), -ds.d)
        si = scene.ray_intersect(ray, mi.RayFlags.All, False, active)
        for _ in range(_MOST_CROSSINGS if self._features.has_null else 0):
            other = active & si.is_valid() & ~_is_at(si, point, ds.dist)
            through = si.bsdf(ray).eval_null_transmission(si, other)
            power = dr.select(other, power * through, power)
            active &= ~other | (dr.max(through) > 0)
            # Along the ray, not along the normal as the engine's own offset is: it is to end at the point.
            step = _CLEARANCE * (1 + dr.max(dr.abs(si.p)))
            beyond = mi.Ray3f(si.p + ray.d * step, ray.d)
            again = scene.ray_intersect(beyond, mi.RayFlags.All, False, other & active)
            si = dr.select(other, again, si)
        active &= si.is_valid() & _is_at(si, point, ds.dist)
        power *= dr.abs(dr.dot(si.n, ds.d)) * dr.gather(mi.Float, self._areas, caster)

        found = []
        events, absorption = dr.zeros(mi.UInt32, lanes), dr.zeros(mi.Color3f, lanes)
        dr.eval(si, power, events, absorption, active)
        for step in range(MOST_EVENTS + (_MOST_CROSSINGS if self._features.has_null else 0)):
            si, power, events, absorption, active = self._next_surface(
                si, power, events, absorption, active, stream, dr.opaque(mi.UInt32, 2 + _DIMENSIONS * step)
            )
            lambert = lambertian(si, si.bsdf(), active)
            lands = active & (dr.max(power) > 0)
            lands &= (dr.max(lambert) > 0) | has_wide_lobes(si, si.bsdf(), lands)
            normal = facing_normal(si)
            toward = si.to_world(si.wi)
            dr.eval(si, power, events, absorption, active, lands, normal, toward)
            kept = np.flatnonzero(np.array(lands))
            if len(kept):
                found.append((_photons(kept, si, normal, toward, power, events), kept))
            if not dr.any(active):
                break
        return found

    def _next_surface(
        self,
        si: SurfaceInteraction3f,
        power: Spectrum,
        events: UInt32,
        absorption: Color3f,
        active: Bool,
        stream: SampleStream,
        dimension: UInt32,
    ) -> tuple[SurfaceInteraction3f, Spectrum, UInt32, Color3f, Bool]:
        """One event of light that follows sharp ones alone, and the surface after it."""
        bsdf = si.bsdf()
        lobe = sharp_lobe(si, bsdf, active)
        context = mi.BSDFContext(mi.TransportMode.Importance)
        bs, weight = bsdf.sample(context, si, stream.next_1d(dimension), stream.next_2d(dimension + 1), active)
        passes = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
        wo = si.to_world(bs.wo)
        # Light that passes the first surface starts at the next.
        active &= ~passes | (events > 0)
        active &= follows_sharply(si, lobe, bs)
        # Adjoint of shading normals: Veach 1997, eq. 5.19.
        into, out = dr.dot(si.n, si.to_world(si.wi)), dr.dot(si.n, wo)
        active &= passes | ((into * si.wi.z > 0) & (out * bs.wo.z > 0))
        correction = dr.select(passes, 1, dr.abs(si.wi.z * out / (bs.wo.z * into)))
        power = power * weight * correction
        events = events + dr.select(passes, mi.UInt32(0), mi.UInt32(1))
        active &= (dr.max(power) > 0) & (events <= MOST_EVENTS)
        if self._features.has_absorption:
            crosses = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Transmission) & ~passes
            within = dr.select(bs.wo.z < 0, self._features.absorption_of(si.shape), 0)
            absorption = dr.select(crosses, within, absorption)
        ray = si.spawn_ray(wo)
        si = self._scene.ray_intersect(ray, mi.RayFlags.All, False, active)
        active &= si.is_valid()
        if self._features.has_absorption:
            power *= dr.exp(-absorption * dr.select(si.is_valid(), si.t, 0))
        return si, power, events, absorption, active


def _is_at(si: SurfaceInteraction3f, point: mi.PositionSample3f, distance: mi.Float) -> Bool:
    near = dr.squared_norm(si.p - point.p) < dr.square(_SAME_POINT * distance)
    return near & (dr.dot(si.n, point.n) > _SAME_SIDE)


def _photons(
    kept: NDArray[np.int64],
    si: SurfaceInteraction3f,
    normal: mi.Normal3f,
    toward: mi.Vector3f,
    power: Spectrum,
    events: UInt32,
) -> Photons:
    def rows(values: mi.Vector3f) -> NDArray[np.float32]:
        return np.ascontiguousarray(np.array(values, dtype=np.float32).T[kept])

    return Photons(rows(si.p), rows(normal), rows(toward), rows(power), np.array(events)[kept].astype(np.uint32))
