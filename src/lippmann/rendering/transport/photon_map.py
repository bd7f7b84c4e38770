"""Photons of caustics in cells, and the irradiance that they bring to a point.

Photons are sorted by cell, so that a look-up goes through short runs of them, and sums never depend on the order of
threads. Cells are hashed into buckets; a bucket may hold photons of other cells, which are told apart one by one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.types import Bool, Color3f, Float, Point3f, SurfaceInteraction3f, UInt32, Vector3f
from lippmann.rendering.transport.sharp_events import is_sharp

Floats = NDArray[np.float32]

#: The least cosine between the normals of a photon and of the point, and how far photons may lie from the tangent plane
#: there, in radii.
LEAST_AGREEMENT, FARTHEST_FROM_PLANE = 0.7, 0.4
#: Limit on what interpolated normals may add to light that grazes the true surface.
STEEPEST = 4.0
_PRIMES = (73856093, 19349663, 83492791)


@dataclass(frozen=True, eq=False)
class Photons:
    """Photons where they land; all arrays have ``n`` rows.

    Attributes
    ----------
    position, normal, toward:
        ``(n, 3)``: the point, the unit geometric normal on the side that the light comes from, and the unit direction
        that it comes from; world space.
    power:
        ``(n, 3)``: flux that each stands for.
    surfaces:
        ``(n,)``: sharp events between the emitter and the point.
    """

    position: Floats
    normal: Floats
    toward: Floats
    power: Floats
    surfaces: NDArray[np.uint32]

    def __len__(self) -> int:
        return len(self.surfaces)

    def are_inside(self, region: NDArray[np.float64] | None) -> NDArray[np.bool_]:
        """``(n,)``: which lie in the box with these corners ``(2, 3)``; all where it is None."""
        if region is None:
            return np.ones(len(self), bool)
        inside: NDArray[np.bool_] = ((self.position >= region[0]) & (self.position <= region[1])).all(axis=1)
        return inside

    def inside(self, region: NDArray[np.float64] | None) -> Photons:
        """Those that lie in a box."""
        return self.chosen(self.are_inside(region))

    def chosen(self, which: NDArray[np.generic]) -> Photons:
        """Some of them, by a mask or by numbers."""
        return Photons(*(getattr(self, each.name)[which] for each in fields(self)))

    @staticmethod
    def dark(count: int) -> Photons:
        """So many photons without power, at the origin."""
        point = np.zeros((count, 3), np.float32)
        return Photons(point, point, point, point, np.zeros(count, np.uint32))

    @staticmethod
    def joined(parts: list[Photons]) -> Photons:
        """All photons of several sets."""
        return Photons(*(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(Photons)))


class Gathered:
    """Light that photons bring to a point.

    Attributes
    ----------
    irradiance:
        On a Lambertian surface of the point's shading normal.
    toward:
        World-space unit direction to where one of the photons came from, chosen by its share.
    flux:
        Irradiance on a surface of the shading normal, if all came from ``toward``: its product with the BSDF there is
        an unbiased estimate of the sum over all photons.
    """

    # Not a dataclass: Dr.Jit would take it for loop state and write its fields.
    def __init__(self, irradiance: Color3f, toward: Vector3f, flux: Color3f) -> None:
        self.irradiance = irradiance
        self.toward = toward
        self.flux = flux


class PhotonMap:
    """Two sets of photons that know nothing of each other, one for either half of a picture's samples.

    Parameters
    ----------
    halves:
        The photons.
    radius:
        Of a look-up, in world units.
    """

    # Not a dataclass: Dr.Jit would take it for loop state and write its fields.
    def __init__(self, halves: tuple[Photons, Photons], radius: float) -> None:
        self.radius = radius
        self.halves = halves
        most = max(1, *(len(half) for half in halves))
        self._mask = (1 << max(1, math.ceil(math.log2(most)))) - 1
        # Opaque to the compiler, so that all sets of photons share a kernel.
        self._last_bucket = dr.opaque(mi.UInt32, self._mask)
        starts, ordered, before = [], [], 0
        for half in halves:
            bucket = self._bucket_numbers(half.position)
            order = np.argsort(bucket, kind="stable")
            edges = np.searchsorted(bucket[order], np.arange(self._mask + 2))
            starts.append(edges + before)
            before += len(half)
            ordered.append(half.chosen(order))
        photons = Photons.joined(ordered)
        if not len(photons):  # gathers need something to point at
            photons = Photons.dark(1)
        self._start = mi.UInt32(np.concatenate(starts).astype(np.uint32))
        # Four numbers a row: such are fetched at once.
        self._position, self._normal, self._toward = (
            mi.Float(_rows_of_four(getattr(photons, name))) for name in ("position", "normal", "toward")
        )
        self._power_and_surfaces = mi.Float(_rows_of_four(photons.power, photons.surfaces))
        self._r = dr.opaque(mi.Float, radius)

    def _bucket_numbers(self, position: Floats) -> NDArray[np.uint32]:
        # In single precision as on the device, so that both find the same cells.
        cell = np.floor(position / np.float32(self.radius)).astype(np.int32).astype(np.uint32)
        mixed = cell[:, 0] * np.uint32(_PRIMES[0]) ^ cell[:, 1] * np.uint32(_PRIMES[1])
        mixed ^= cell[:, 2] * np.uint32(_PRIMES[2])
        return np.asarray(mixed & np.uint32(self._mask), dtype=np.uint32)

    @dr.syntax
    def gather(
        self,
        si: SurfaceInteraction3f,
        normal: Vector3f,
        lobe: Vector3f,
        half: UInt32,
        surfaces: UInt32,
        choice: Float,
        active: Bool,
    ) -> Gathered:
        """Light of the photons around a point, by an Epanechnikov kernel.

        Parameters
        ----------
        si:
            The point.
        normal:
            Its geometric normal on the side that is seen.
        lobe:
            Of its narrow lobe (:func:`~lippmann.rendering.transport.sharp_events.sharp_lobe`): light that it reflects
            sharply is no caustic here.
        half:
            0 or 1: which photons.
        surfaces:
            The most sharp events that a photon may have had.
        choice:
            Uniform in [0, 1): by which one photon is chosen.
        """
        r = self._r
        p = mi.Point3f(si.p)
        base = dr.floor(p / r) - 1
        # How far the tangent plane's slab reaches from the centre of a cell that it touches.
        reach = r * (FARTHEST_FROM_PLANE + 0.5 * dr.sum(dr.abs(normal)))
        total = mi.Color3f(0)
        weights = mi.Float(0)  # of the photons met so far; one of them is chosen by reservoir sampling
        chosen = mi.Vector3f(0, 0, 1)
        color = mi.Color3f(0)
        corner = mi.UInt32(0)
        first_bucket = half * (self._last_bucket + 2)
        looking = mi.Bool(active)
        while dr.hint(looking, label="cells"):
            cell = base + mi.Vector3f(mi.Float(corner % 3), mi.Float(corner // 3 % 3), mi.Float(corner // 9))
            from_center = (cell + 0.5) * r - p
            touches = dr.abs(dr.dot(from_center, normal)) < reach
            touches &= dr.squared_norm(dr.maximum(dr.abs(from_center) - 0.5 * r, 0)) < r * r
            bucket = first_bucket + self._bucket(cell)
            number = dr.gather(mi.UInt32, self._start, bucket, looking)
            end = dr.gather(mi.UInt32, self._start, bucket + 1, looking)
            inside = looking & touches & (number < end)
            while dr.hint(inside, label="photons"):
                q = dr.gather(mi.Vector4f, self._position, number, inside).xyz
                apart = q - p
                distance2 = dr.squared_norm(apart)
                near = inside & (distance2 < r * r)
                if near:
                    # Two of the cells may share a bucket.
                    fits = near & dr.all(dr.floor(q / r) == cell)
                    n = dr.gather(mi.Vector4f, self._normal, number, near).xyz
                    d = dr.gather(mi.Vector4f, self._toward, number, near).xyz
                    fits &= (dr.dot(n, normal) > LEAST_AGREEMENT) & (dr.dot(d, normal) > 0)
                    fits &= dr.abs(dr.dot(apart, normal)) < FARTHEST_FROM_PLANE * r
                    brought = dr.gather(mi.Vector4f, self._power_and_surfaces, number, fits)
                    fits &= brought.w <= mi.Float(surfaces)
                    wo = si.to_local(d)
                    fits &= ~is_sharp(si, lobe, wo)
                    power = dr.select(fits, mi.Color3f(brought.xyz) * (1 - distance2 / (r * r)), 0)
                    weight = dr.mean(power)
                    weights += weight
                    share = dr.select(weight > 0, weight / weights, 0)
                    taken = choice < share
                    choice = dr.select(taken, choice / share, (choice - share) / (1 - share))
                    chosen = dr.select(taken, d, chosen)
                    # Photons know the true surface; it is shaded by its interpolated normal.
                    power *= dr.minimum(dr.abs(wo.z) / dr.dot(d, normal), STEEPEST)
                    total += power
                    color = dr.select(taken, power / weight, color)
                number += 1
                inside &= number < end
            corner += 1
            looking &= corner < 27
        density = 2 / (dr.pi * r * r)
        return Gathered(total * density, chosen, color * weights * density)

    def _bucket(self, cell: Point3f) -> UInt32:
        x, y, z = (mi.UInt32(mi.Int32(part)) * prime for part, prime in zip(cell, _PRIMES, strict=True))
        return (x ^ y ^ z) & self._last_bucket


def _rows_of_four(values: Floats, last: NDArray[np.uint32] | None = None) -> Floats:
    """``(4 n,)``: rows of three numbers, each followed by one of ``last`` or by 0."""
    rows = np.zeros((len(values), 4), np.float32)
    rows[:, :3] = values
    if last is not None:
        rows[:, 3] = last
    return rows.ravel()


def irradiance_by_all(
    photons: Photons, position: Floats, normal: Floats, radius: float, surfaces: int = 1 << 30
) -> Floats:
    """The irradiance of :meth:`PhotonMap.gather`, photon by photon: ``(m, 3)`` at ``(m, 3)`` points without a lobe."""
    apart = photons.position[None] - position[:, None]
    distance2 = (apart**2).sum(axis=2)
    fits = distance2 < radius**2
    fits &= np.einsum("nk,mk->mn", photons.normal, normal) > LEAST_AGREEMENT
    fits &= np.einsum("nk,mk->mn", photons.toward, normal) > 0
    fits &= np.abs(np.einsum("mnk,mk->mn", apart, normal)) < FARTHEST_FROM_PLANE * radius
    fits &= photons.surfaces[None] <= surfaces
    weight = np.where(fits, 1 - distance2 / radius**2, 0)
    return np.asarray(weight @ photons.power * 2 / (math.pi * radius**2), dtype=np.float32)
