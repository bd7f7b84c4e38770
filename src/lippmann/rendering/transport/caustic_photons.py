"""Photons from emitters by way of mirrors, glass and smooth gloss to the rough surfaces where they make caustics.

Paths from the eye meet such light only where they happen upon the emitter: hardly ever a small one, and never a point
or a direction. Photons start at the *caster*, the surface that bends the light: a point on it, a direction to the
emitter, and back along it. So none misses, and every emitter works that can be sampled.

What is gathered is exactly what :class:`~lippmann.rendering.transport.path.PathIntegrator` leaves out: light that comes
by sharp events alone (:mod:`lippmann.rendering.transport.sharp_events`), one at least and :data:`MOST_EVENTS` at most,
from an emitter other than the environment to a rough surface of a camera path, and is scattered there by lobes that are
wide enough to be told from photons.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import divide, upload
from lippmann.device.sobol import SampleStream
from lippmann.device.types import (
    Bool,
    Color3f,
    DirectionSample3f,
    MitsubaScene,
    Spectrum,
    SurfaceInteraction3f,
    UInt32,
)
from lippmann.rendering.transport.casters import CasterPoints, Casters
from lippmann.rendering.transport.pass_schedule import PassSchedule
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
_FEWEST_OF_PAIR = 64
#: Share of the emissions that goes to all pairs alike, whatever the pilot met.
_UNIFORM_SHARE = 0.1
#: Emissions of each half: one for so many samples of the picture, within limits.
SAMPLES_OF_EMISSION, FEWEST, MOST = 4, 1 << 16, 1 << 21
#: Photons within the radius of a look-up, as a rule, where there are so many emissions.
NEIGHBOURS, EMISSIONS_OF_NEIGHBOURS = 50, 1 << 18
#: Photons by which the radius is found.
_PROBED = 2000
_SEED_STEPS = (0xB5297A4D, 0x68E31DA4)
_PILOT_STEP, _PASS_STEP, _LOOK_STEP = 0x1B56C4E9, 0x632BE5AB, 0x7F4A7C15
#: Directions to emitters by which their radiance is found: in all, and of one emitter and caster.
_LOOKS, _MOST_LOOKS_OF_PAIR = 1 << 14, 256
#: How far a ray goes on behind a straight-through surface, relative to its coordinates.
_CLEARANCE = 1e-4
#: Share of what met the casters below which a pilot's light is followed no further: it tells little, and each event of
#: a wavefront has a cost of its own.
_PILOT_ENDS = 1 / 16
#: Dimensions of the sample stream at one surface.
_DIMENSIONS = 2
_NONE = Photons.dark(0)
IsMissed = Callable[[Photons, NDArray[np.float64]], bool]


def no_photons() -> PhotonMap:
    """A map in place of paths to which nothing comes."""
    return PhotonMap((_NONE, _NONE), 1.0)


def emissions(samples: int) -> int:
    """Emissions of each half for a picture of so many samples in all."""
    return int(np.clip(samples // SAMPLES_OF_EMISSION, FEWEST, MOST))


class CausticPhotons:
    """Photons of a picture's caustics in passes, each for the next samples of every pixel.

    Passes know nothing of each other, and their radii shrink (Knaus and Zwicker 2011, with alpha = 2/3), so that the
    mean over them comes to have neither noise nor blur. Passes of more photons have smaller radii, too.

    Parameters
    ----------
    scene, features, casters:
        What they are shot in.
    samples:
        Of all pixels together for which the photons of the first pass are.
    schedule:
        Samples of one pixel that each pass serves; None where one pass is for all.
    seed:
        0 to 2**32 - 1: the same gives the same photons.
    region:
        Corners ``(2, 3)`` of the box that is seen: emitters and casters are given photons by what they bring there.
    kept:
        Passes whose photons are kept for others that ask, at least 1.
    is_missed:
        Asked of the pilot's photons that are seen, with the radiance of each one's emitter: whether they are worth it.
    """

    def __init__(
        self,
        scene: MitsubaScene,
        features: SceneFeatures,
        casters: Casters,
        *,
        samples: int,
        seed: int,
        schedule: PassSchedule | None = None,
        region: NDArray[np.float64] | None = None,
        kept: int = 1,
        is_missed: IsMissed | None = None,
    ) -> None:
        self._shooter = PhotonShooter(scene, features, casters)
        self.schedule = schedule or PassSchedule(1 << 32, 1 << 32)
        self._samples = samples
        self._seed = seed
        self._region = region
        self._kept = kept
        self._maps: dict[int, PhotonMap] = {}
        self._radius = 0.0
        self._chances = self._pilot(casters, is_missed)

    @property
    def are_none(self) -> bool:
        """Whether a few emissions of each emitter and caster brought nothing that is seen, or missed."""
        return self._chances is None

    def relative_radius(self, number: int) -> float:
        """Radius of a look-up in pass ``number`` over that in the first."""
        # The area of a look-up is as the number of photons in it, the root of all, over their density.
        return radius_of_pass(number) * math.sqrt(math.sqrt(self._emissions(0) / self._emissions(number)))

    def _emissions(self, number: int) -> int:
        """Of each half in a pass."""
        return emissions(self._samples * self.schedule.samples(number) // self.schedule.first)

    def of_pass(self, number: int) -> PhotonMap:
        """The photons of pass ``number``, from 0 on; a map without any where there are none."""
        if self._chances is None:
            return no_photons()
        if not self._radius and number > 0:
            self.of_pass(0)  # which tells the radius
        if number not in self._maps:
            while len(self._maps) >= self._kept:
                del self._maps[next(iter(self._maps))]
            seeds = [(self._seed + step + number * _PASS_STEP) % 2**32 for step in _SEED_STEPS]
            count = self._emissions(number)
            first, second = (self._shooter.shoot(count, self._chances, seed)[0] for seed in seeds)
            if number == 0 and not self._radius:
                neighbours = NEIGHBOURS * math.sqrt(count / EMISSIONS_OF_NEIGHBOURS)
                self._radius = _radius(first.inside(self._region), neighbours)
            self._maps[number] = PhotonMap((first, second), self._radius * self.relative_radius(number))
        return self._maps[number]

    def _pilot(self, casters: Casters, is_missed: IsMissed | None) -> NDArray[np.float64] | None:
        """Shares of the emissions of each emitter and caster: as the roots of the second moments of what they bring."""
        if casters.pairs == 0:
            return None
        count = min(PILOT_OF_PAIR, max(_FEWEST_OF_PAIR, PILOT // casters.pairs)) * casters.pairs
        even = np.full(casters.pairs, 1 / casters.pairs)
        photons, pair = self._shooter.shoot(count, even, (self._seed + _PILOT_STEP) % 2**32, _PILOT_ENDS)
        seen = photons.are_inside(self._region)
        if not seen.any():
            return None
        if is_missed is not None:
            radiance = self._shooter.radiances((self._seed + _PILOT_STEP) % 2**32)
            if not is_missed(photons.chosen(seen), radiance[pair[seen] % len(casters.emitters)]):
                return None
        power = photons.power[seen].astype(np.float64)
        roots = np.sqrt(np.bincount(pair[seen], np.square(power).sum(axis=1), minlength=casters.pairs))
        return np.asarray(_UNIFORM_SHARE * even + (1 - _UNIFORM_SHARE) * roots / roots.sum())


def radius_of_pass(number: int) -> float:
    """Radius in a pass over that in the first, of as many photons: Knaus and Zwicker 2011, eq. 20."""
    squares = [(k + 2 / 3) / (k + 1) for k in range(1, number + 1)]
    return math.sqrt(math.prod(squares))


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
        self._emitter_numbers = mi.UInt32(casters.emitters)

    def shoot(
        self, count: int, chances: NDArray[np.float64], seed: int, ends: float = 0.0
    ) -> tuple[Photons, NDArray[np.int64]]:
        """``count`` emissions of pairs drawn by ``chances``: photons that landed, and their pairs.

        Light is followed until no more than the share ``ends`` of what met the casters goes on.
        """
        # Every pair gets its number of emissions, not a chance of them.
        each = np.maximum(1, np.round(chances * count)).astype(np.int64)
        pair = np.repeat(np.arange(len(each)), each)
        landed: list[Photons] = []
        pairs: list[NDArray[np.int64]] = []
        for first in range(0, len(pair), 1 << 18):
            part = pair[first : first + (1 << 18)]
            for photons, lanes in self._wavefront(part, each, first, seed, ends):
                landed.append(photons)
                pairs.append(part[lanes])
        return Photons.joined([_NONE, *landed]), np.concatenate([np.zeros(0, np.int64), *pairs])

    def radiances(self, seed: int) -> NDArray[np.float64]:
        """The greatest radiance that each emitter is found to show to the casters; infinite for those without size."""
        pairs = self._casters.pairs
        pair = np.repeat(np.arange(pairs), min(_MOST_LOOKS_OF_PAIR, max(1, _LOOKS // pairs)))
        stream = SampleStream.of_pixels(
            mi.UInt32(0), dr.arange(mi.UInt32, len(pair)), dr.opaque(mi.UInt32, (seed + _LOOK_STEP) % 2**32)
        )
        _, ds, light = self._lit_points(pair, stream)
        shown = dr.select((ds.pdf > 0) & (dr.max(light) > 0), dr.select(ds.delta, dr.inf, dr.max(light) * ds.pdf), 0)
        greatest = np.zeros(len(self._casters.emitters))
        np.maximum.at(greatest, pair % len(greatest), np.array(shown, dtype=np.float64))
        return greatest

    def _lit_points(
        self, pair: NDArray[np.int64], stream: SampleStream
    ) -> tuple[CasterPoints, DirectionSample3f, Spectrum]:
        """For each pair a point on the caster, a direction to the emitter, and radiance over the direction's pdf."""
        numbers, scene = upload(pair.astype(np.uint32)), self._scene
        caster, source = divide(numbers, len(self._casters.emitters))
        emitter = dr.gather(mi.EmitterPtr, scene.emitters_dr(), dr.gather(mi.UInt32, self._emitter_numbers, source))
        point = CasterPoints(scene, self._casters, caster, stream.next_2d(0), stream.next_1d(2))
        ds, light = emitter.sample_direction(point.reference(), stream.next_2d(1), mi.Bool(True))
        return point, ds, light

    def _wavefront(
        self, pair: NDArray[np.int64], each: NDArray[np.int64], first: int, seed: int, ends: float
    ) -> list[tuple[Photons, NDArray[np.int64]]]:
        """Photons that land after one sharp event, after two and so on, and the lanes of each."""
        scene, lanes = self._scene, len(pair)
        share = mi.Float((1.0 / each[pair]).astype(np.float32))
        # What differs from wavefront to wavefront is opaque to the compiler, so that all share their kernels.
        index = dr.arange(mi.UInt32, lanes) + dr.opaque(mi.UInt32, first)
        stream = SampleStream.of_pixels(mi.UInt32(0), index, dr.opaque(mi.UInt32, seed))
        point, ds, light = self._lit_points(pair, stream)
        active = (ds.pdf > 0) & (dr.max(light) > 0)
        power = mi.Color3f(light) * share
        # From the emitter to the point: tells whether one sees the other, and what surface is met there.
        ray = mi.Ray3f(point.p + ds.d * (ds.dist * (1 - 1e-3)), -ds.d)
        si = scene.ray_intersect(ray, mi.RayFlags.All, False, active)
        for _ in range(_MOST_CROSSINGS if self._features.has_null else 0):
            other = active & si.is_valid() & ~point.is_met(si, ds.dist)
            through = si.bsdf(ray).eval_null_transmission(si, other)
            power = dr.select(other, power * through, power)
            active &= ~other | (dr.max(through) > 0)
            # Along the ray, not along the normal as the engine's own offset is: it is to end at the point.
            step = _CLEARANCE * (1 + dr.max(dr.abs(si.p)))
            beyond = mi.Ray3f(si.p + ray.d * step, ray.d)
            again = scene.ray_intersect(beyond, mi.RayFlags.All, False, other & active)
            si = dr.select(other, again, si)
        active &= si.is_valid() & point.is_met(si, ds.dist)
        power *= point.cosine(si, ds.d) * point.area

        found = []
        events, absorption = dr.zeros(mi.UInt32, lanes), dr.zeros(mi.Color3f, lanes)
        dr.eval(si, power, events, absorption, active)
        few = ends * int(dr.count(active)[0])
        for step in range(MOST_EVENTS + (_MOST_CROSSINGS if self._features.has_null else 0)):
            si, power, events, absorption, active = self._next_surface(
                si, power, events, absorption, active, stream, dr.opaque(mi.UInt32, 3 + _DIMENSIONS * step)
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
            if int(dr.count(active)[0]) <= few:
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
