"""Light vertices: surface points that emitters light directly, to which paths from the eye are joined.

A wall beside a small emitter is bright and lights the rest of the room in turn. BSDF sampling seldom hits such a wall;
rays from the emitter hit it at once. So each vertex of a path is joined to one of the points that such rays hit (the
bidirectional strategy of two light vertices; Veach 1997, chapter 10.2), sampled from a store that all pixels share
(Davidovic et al. 2014, light vertex cache). Next-event estimation at the path's own vertices and paths that hit the
emitter sample the same light, so MIS combines the three.

Only the Lambertian part of the scattering at light vertices is used, so that a store holds numbers alone. ``reach`` is
the density per area of light vertices over that of the path's own vertices there. The MIS pdfs of the three strategies
are, per steradian at the point:

* ``reach``: light vertices,
* the pdf of emitter sampling at the point,
* ``cos / pi``: BSDF sampling there.
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
from lippmann.rendering.transport.light_sampling import LightSampler, mis_weight
from lippmann.rendering.transport.photon_map import are_inside
from lippmann.rendering.transport.sharp_events import lambertian_share
from lippmann.rendering.transport.tuning import TUNING

Floats = NDArray[np.float32]


@dataclass
class JointLight:
    """State of the path loop for MIS: the light at a path vertex that light vertices sample as well.

    Attributes
    ----------
    share:
        Lambertian share in [0, 1] of the light.
    reach:
        Reciprocal of the pdf per area of the path's vertex, times the cosine between its geometric normal and the
        direction to the emitter; 0 where light vertices sample nothing.
    cosine:
        The cosine with the shading normal.
    """

    share: Spectrum
    reach: Float
    cosine: Float


class Arrival:
    """A path vertex as light vertices need it for MIS.

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
        """State after scattering to ``wo``, in the world ``direction``; ``scattered`` is the BSDF times the cosine."""
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
        """MIS weight of an emitter sample at ``si`` with ``pdf``; ``scattered`` is the BSDF times the cosine.

        ``plain`` is the weight without light vertices. It holds where the way to the emitter is not ``is_direct``: rays
        from emitters do not pass holes and panes.
        """
        joint = self.joint(si, mi.Color3f(scattered), si.to_local(ds.d), ds.d)
        joint.reach = dr.select(is_direct, joint.reach, 0)
        scattered_pdf = dr.select(ds.delta, 0, joint.cosine * dr.inv_pi)
        return self.vertices.weight(joint, ds, plain, pdf, scattered_pdf, self.half, active)


def reach_of(si: SurfaceInteraction3f, bsdf: BSDFPtr, d: Vector3f, pdf: Float, active: Bool) -> Float:
    """Reciprocal of the pdf per area of a path vertex ``si`` that was sampled along ``d`` with ``pdf`` per steradian.

    0 where ``pdf`` is 0, and on surfaces that let light straight through, which hold no light vertices.
    """
    arrival = pdf * dr.abs(dr.dot(si.n, d))
    is_whole = active & ~mi.has_flag(bsdf.flags(), mi.BSDFFlags.Null)
    return dr.select(is_whole & (arrival > 0), dr.square(si.t) / arrival, 0)


class LightVertices:
    """Two independent sets of light vertices, one for each half of a picture's samples.

    Parameters
    ----------
    scene:
        Where they are.
    halves:
        The points.
    rays:
        Rays from emitters of each half, those without a light vertex included; above 0.
    densities:
        See :meth:`~lippmann.rendering.transport.emitter_rays.EmitterRays.densities`.
    """

    def __init__(
        self, scene: MitsubaScene, halves: tuple[LitPoints, LitPoints], rays: int, densities: NDArray[np.float32]
    ) -> None:
        self._scene = scene
        kept = np.array([len(half) for half in halves])
        # A join samples one of the stored points, so each stands for rays / points rays.
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
        # Rows of four numbers are fetched at once.
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
            The part that light vertices sample, too.
        plain:
            The weight without light vertices.
        other:
            Pdf of the other strategy (emitter or BSDF sampling), per steradian at the point; see the module.
        """
        reach = joint.reach * self._densities_at(ds, half, active)
        return plain + dr.select(reach > 0, joint.share * (mis_weight(own, other, reach) - plain), 0)

    def _densities_at(self, ds: DirectionSample3f, half: UInt32, active: Bool) -> Float:
        """Density of light vertices per projected area at a point lit from ``ds``; 0 where no rays come from there."""
        number = dr.reinterpret_array(mi.UInt32, ds.emitter)
        signed_density = dr.gather(mi.Float, self._densities, number + half * self._emitters, active)
        active = active & (ds.delta | (signed_density < 0) | (dr.dot(ds.n, ds.d) < 0))
        density = dr.abs(signed_density)
        return dr.select(active, dr.select(ds.delta, density / dr.square(ds.dist), density), 0)

    def join(
        self, si: SurfaceInteraction3f, bsdf: BSDFPtr, choice: Float, half: UInt32, active: Bool, through: bool
    ) -> tuple[Spectrum, UInt32]:
        """Radiance toward ``si.wi`` by way of the light vertex that ``choice`` selects, and the shadow rays traced.

        Without ``through``, only light vertices on the side of ``si.wi`` count.
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
    """Light vertices of a picture in independent passes, each for the next samples of every pixel.

    Parameters
    ----------
    scene, sampler:
        As of :class:`~lippmann.rendering.transport.emitter_rays.EmitterRays`.
    pass_samples:
        Samples of one pixel that each pass serves.
    seed:
        0 to 2**32 - 1: the same gives the same light vertices.
    region:
        Corners ``(2, 3)`` of the visible box: emitters get rays in proportion to their light there.
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
            chosen, chances = _deal_emitters(self._chances, TUNING.light_vertices)
            seeds = (named_seed("light vertices", self._seed, number, half) for half in range(2))
            first, second = (self._rays.meet(chosen, chances, seed)[0] for seed in seeds)
            densities = self._rays.densities(chances)
            self._current = number, LightVertices(self._scene, (first, second), TUNING.light_vertices, densities)
        return self._current[1]

    def _pilot(self, region: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
        """Sampling probabilities of the emitters, by a few rays of each into the region; None for no light."""
        senders = len(self._rays.senders)
        if senders == 0:
            return None
        even = np.full(senders, 1 / senders)
        chosen, chances = _deal_emitters(even, TUNING.light_vertices)
        points, met = self._rays.meet(chosen, chances, named_seed("pilot of light vertices", self._seed))
        inside = are_inside(points.position, region)
        if not inside.any():
            return None
        power = points.glow[inside].max(axis=1).astype(np.float64)
        sums = np.bincount(chosen[met][inside], power, minlength=senders)
        return np.asarray(TUNING.uniform_share * even + (1 - TUNING.uniform_share) * sums / sums.sum())


def _deal_emitters(chances: NDArray[np.float64], count: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Give ``count`` light vertices to emitters in proportion to ``chances``.

    Returns the shuffled emitter indices ``(count,)``, and the share of each emitter after rounding.
    """
    edges = np.round(np.cumsum(chances) / chances.sum() * count).astype(np.int64)
    each = np.diff(edges, prepend=0)
    number = np.repeat(np.arange(len(chances)), each)
    # Shuffled, so that each emitter gets points from all over the stratified sequence.
    return np.random.default_rng(0).permutation(number), each / count
