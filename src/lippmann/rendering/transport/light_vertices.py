"""Light vertices: surface points that emitters light directly, to which paths from the eye are joined.

What a small emitter lights brightly, such as the wall beside it, lights the rest of a room in turn, and paths that
scatter by the surfaces alone happen upon it seldom. Rays from the emitters find it at once. So each vertex of a path is
joined to one of the points that such rays meet (the bidirectional strategy of two light vertices; Veach 1997, chapter
10.2), drawn from a store that all pixels share (Davidovic et al. 2014, light vertex cache). The same light comes by
next-event estimation at points that a path meets itself, and by paths that meet the emitter: the three share it by MIS.

Only light that points scatter as Lambertian surfaces do is taken, so that a store holds numbers alone. With ``reach``
the density of light vertices per area over that of the path's own points there, the weights of the three are as

* ``reach``, in units of density per steradian about the point: of points met by rays from emitters,
* the pdf of emitter sampling at the point,
* ``cos / pi``, in place of the pdf by which the scattering there is sampled.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import upload
from lippmann.device.sobol import named_seed
from lippmann.device.types import (
    Bool,
    BSDFPtr,
    Color3f,
    DirectionSample3f,
    Float,
    MitsubaScene,
    Spectrum,
    SurfaceInteraction3f,
    UInt32,
    Vector3f,
)
from lippmann.rendering.transport.emitter_rays import EmitterRays, LitPoints
from lippmann.rendering.transport.light_sampling import LightSampler
from lippmann.rendering.transport.path_weights import mis_weight
from lippmann.rendering.transport.photon_map import are_inside
from lippmann.rendering.transport.sharp_events import lambertian_share
from lippmann.rendering.transport.tuning import TUNING

Floats = NDArray[np.float32]


@dataclass
class JointLight:
    """Light of a point that light vertices bring, too; state of the path loop.

    Attributes
    ----------
    share:
        Of the light.
    reach:
        1 over the density per area with which the path came to the point, times the cosine between the point's
        geometric normal and the way to the emitter; 0 where light vertices bring nothing.
    cosine:
        The same of the shading normal.
    """

    share: Spectrum
    reach: Float
    cosine: Float


class Arrival:
    """How a path came to a surface, for light there that light vertices bring, too.

    Attributes
    ----------
    vertices:
        The light vertices.
    albedo:
        Of the Lambertian part of the surface's scattering.
    reach:
        See :func:`reach_of`.
    half:
        Of the picture.
    """

    def __init__(self, vertices: LightVertices, albedo: Color3f, reach: Float, half: UInt32) -> None:
        self.vertices = vertices
        self.albedo = albedo
        self.reach = reach
        self.half = half

    def joint(self, si: SurfaceInteraction3f, scattered: Color3f, wo: Vector3f, direction: Vector3f) -> JointLight:
        """Of what the surface scatters from ``wo``, ``direction`` in the world: the BSDF times the cosine."""
        share = lambertian_share(si, self.albedo, scattered, wo)
        return JointLight(share, self.reach * dr.abs(dr.dot(si.n, direction)), dr.abs(wo.z))

    def weigh(
        self,
        si: SurfaceInteraction3f,
        ds: DirectionSample3f,
        scattered: Spectrum,
        plain: Float,
        pdf: Float,
        is_direct: Bool,
        active: Bool,
    ) -> Spectrum:
        """MIS weight of an emitter sample at ``si`` that was taken with ``pdf`` and scatters as said.

        ``plain`` is the weight where light vertices bring nothing, as they do where the way to the emitter is not
        ``is_direct``: rays from emitters do not pass holes and panes.
        """
        joint = self.joint(si, mi.Color3f(scattered), si.to_local(ds.d), ds.d)
        joint.reach = dr.select(is_direct, joint.reach, 0)
        scattered_pdf = dr.select(ds.delta, 0, joint.cosine * dr.inv_pi)
        return self.vertices.weight(joint, ds, plain, pdf, scattered_pdf, self.half, active)


def reach_of(si: SurfaceInteraction3f, bsdf: BSDFPtr, d: Vector3f, pdf: Float, active: Bool) -> Float:
    """1 over the density per area with which a path comes to ``si`` along ``d``, which it samples with ``pdf``.

    0 where ``pdf`` is, and on surfaces that let light straight through, which hold no light vertices.
    """
    arrival = pdf * dr.abs(dr.dot(si.n, d))
    is_whole = active & ~mi.has_flag(bsdf.flags(), mi.BSDFFlags.Null)
    return dr.select(is_whole & (arrival > 0), dr.square(si.t) / arrival, 0)


class LightVertices:
    """Two sets of light vertices that know nothing of each other, one for either half of a picture's samples.

    Parameters
    ----------
    scene:
        Where they are.
    halves:
        The points.
    rays:
        From emitters, of each half, which met these points and nothing else that counts; above 0.
    densities:
        See :meth:`~lippmann.rendering.transport.emitter_rays.EmitterRays.densities`.
    """

    def __init__(
        self, scene: MitsubaScene, halves: tuple[LitPoints, LitPoints], rays: int, densities: NDArray[np.float32]
    ) -> None:
        self._scene = scene
        kept = np.array([len(half) for half in halves])
        # A join draws one of the points that are kept, which are as dense as all rays together.
        scales = rays / np.maximum(kept, 1)
        self._count = upload(kept.astype(np.uint32))
        self._first = upload(np.array([0, kept[0]], np.uint32))
        self._densities = upload(np.concatenate([densities * scale for scale in scales]))
        self._emitters = dr.opaque(mi.UInt32, len(densities))
        rows = []
        for half, scale in zip(halves, scales, strict=True):
            columns = (
                *(half.position, half.reach * scale),
                *(half.normal, half.sampled),
                *(half.shading, half.scattered),
                *(half.glow / scale, np.zeros(len(half))),
            )
            rows.append(np.column_stack(columns))
        # Four numbers a row: such are fetched at once.
        table = np.concatenate([*rows, np.zeros((1, 16))])  # gathers need something to point at
        self._place, self._normal, self._shading, self._glow = (upload(table[:, k : k + 4]) for k in (0, 4, 8, 12))

    def weight(
        self,
        joint: JointLight,
        ds: DirectionSample3f,
        plain: Float,
        own: Float,
        other: Float,
        half: UInt32,
        active: Bool,
    ) -> Spectrum:
        """MIS weight of light from ``ds`` that a path found with pdf ``own``, in a sample of the ``half``.

        Parameters
        ----------
        joint:
            What of it light vertices bring, too.
        plain:
            The weight where they bring nothing.
        other:
            Pdf of the other of emitter sampling and scattering; both per steradian at the point, see the module.
        """
        reach = joint.reach * self._densities_at(ds, half, active)
        return plain + dr.select(reach > 0, joint.share * (mis_weight(own, other, reach) - plain), 0)

    def _densities_at(self, ds: DirectionSample3f, half: UInt32, active: Bool) -> Float:
        """Density of light vertices per projected area at a point that is lit as ``ds`` says, in 1 per area.

        0 where no rays come from there.
        """
        number = dr.reinterpret_array(mi.UInt32, ds.emitter)
        told = dr.gather(mi.Float, self._densities, number + half * self._emitters, active)
        active = active & (ds.delta | (told < 0) | (dr.dot(ds.n, ds.d) < 0))
        density = dr.abs(told)
        return dr.select(active, dr.select(ds.delta, density / dr.square(ds.dist), density), 0)

    def join(
        self, si: SurfaceInteraction3f, bsdf: BSDFPtr, choice: Float, half: UInt32, active: Bool, through: bool
    ) -> tuple[Spectrum, UInt32]:
        """Radiance toward ``si.wi`` by way of a light vertex that ``choice`` draws, and the shadow rays traced.

        Not ``through`` the surface, only those on the side of ``si.wi`` count.
        """
        count = dr.gather(mi.UInt32, self._count, half, active)
        active = active & (count > 0)
        index = dr.minimum(mi.UInt32(choice * mi.Float(count)), count - 1)
        index += dr.gather(mi.UInt32, self._first, half, active)
        place, normal, shading, glow = (
            dr.gather(mi.Vector4f, table, index, active)
            for table in (self._place, self._normal, self._shading, self._glow)
        )
        way = mi.Vector3f(place.xyz) - si.p
        squared = dr.squared_norm(way)
        toward = way * dr.rsqrt(squared)
        cosine = -dr.dot(normal.xyz, toward)
        active &= (squared > 0) & (cosine > 0) & (dr.dot(shading.xyz, toward) < 0)
        wo = si.to_local(toward)
        if not through:
            active &= wo.z * si.wi.z > 0
        value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, wo, active)
        geometry = cosine / squared
        weight = mis_weight(place.w, normal.w * (pdf * geometry), shading.w * (pdf * geometry))
        light = value * mi.Color3f(glow.xyz) * (geometry * weight)
        active &= dr.max(light) > 0
        end = mi.Point3f(place.xyz)
        blocked = self._scene.ray_test(si.spawn_ray_to(end), active)
        return dr.select(active & ~blocked, light, 0), dr.select(active, mi.UInt32(1), mi.UInt32(0))


class LightVertexPasses:
    """Light vertices of a picture in passes, each for the next samples of every pixel; they know nothing of each other.

    Parameters
    ----------
    scene, sampler:
        As of :class:`~lippmann.rendering.transport.emitter_rays.EmitterRays`.
    pass_samples:
        Samples of one pixel that each pass serves.
    seed:
        0 to 2**32 - 1: the same gives the same light vertices.
    region:
        Corners ``(2, 3)`` of the box that is seen: emitters send rays by what they bring there.
    """

    def __init__(
        self,
        scene: MitsubaScene,
        sampler: LightSampler,
        pass_samples: int,
        seed: int,
        region: NDArray[np.float64] | None,
    ) -> None:
        self._scene = scene
        self._rays = EmitterRays(scene, sampler)
        self.pass_samples = pass_samples
        self._seed = seed
        self._current: tuple[int, LightVertices] | None = None
        self._chances = self._pilot(region)

    @property
    def are_none(self) -> bool:
        """Whether a few rays from each emitter met nothing that scatters light within the region."""
        return self._chances is None

    def of_pass(self, number: int) -> LightVertices:
        """The light vertices of pass ``number``, from 0 on."""
        assert self._chances is not None
        if self._current is None or self._current[0] != number:
            chosen, chances = _dealt(self._chances, TUNING.light_vertices)
            seeds = (named_seed("light vertices", self._seed, number, half) for half in range(2))
            first, second = (self._rays.meet(chosen, chances, seed)[0] for seed in seeds)
            densities = self._rays.densities(chances)
            self._current = number, LightVertices(self._scene, (first, second), TUNING.light_vertices, densities)
        return self._current[1]

    def _pilot(self, region: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
        """Chances of the senders, as what their rays bring within the region."""
        senders = len(self._rays.senders)
        if senders == 0:
            return None
        even = np.full(senders, 1 / senders)
        chosen, chances = _dealt(even, TUNING.light_vertices)
        points, met = self._rays.meet(chosen, chances, named_seed("pilot of light vertices", self._seed))
        seen = are_inside(points.position, region)
        if not seen.any():
            return None
        power = points.glow[seen].max(axis=1).astype(np.float64)
        sums = np.bincount(chosen[met][seen], power, minlength=senders)
        return np.asarray(TUNING.uniform_share * even + (1 - TUNING.uniform_share) * sums / sums.sum())


def _dealt(chances: NDArray[np.float64], count: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """``count`` numbers of senders as near to their chances as whole numbers are, mixed; and their true chances."""
    edges = np.round(np.cumsum(chances) / chances.sum() * count).astype(np.int64)
    each = np.diff(edges, prepend=0)
    number = np.repeat(np.arange(len(chances)), each)
    # Points of a stratified sequence are not to fall into few emitters' hands.
    return np.random.default_rng(0).permutation(number), each / count
