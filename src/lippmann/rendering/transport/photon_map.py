"""Photon map of caustics: photons in a hashed grid, and the irradiance that they bring to a point.

Photons are sorted by cell, so that a look-up reads short runs, and sums never depend on the order of threads. Cells are
hashed into buckets. A bucket may hold photons of several cells, so the cell of each photon is compared.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, fields

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import upload
from lippmann.device.pbr.microfacet import is_sharp
from lippmann.device.sobol import SEED_STEP
from lippmann.device.syntax import syntax
from lippmann.device.types import Bool, Color3f, Float, Point3f, SurfaceInteraction3f, UInt32, Vector3f
from lippmann.rendering.transport.tuning import TUNING

Floats = NDArray[np.float32]

#: Lower bounds for the area of a plane in a cell: of its normal's components, and of the area over that of a face.
_LEAST_SLOPE, _LEAST_AREA = 0.01, 0.05
#: Odd factors of the coordinates of a cell in its hash.
_FACTORS = SEED_STEP, pow(SEED_STEP, 2, 1 << 32), pow(SEED_STEP, 3, 1 << 32)
#: Bitmap of wide cells with photons in reach: bits per bucket, and width of a wide cell in radii. One look-up in fifty
#: then finds no photon.
_NEAR_BITS, _NEAR_WIDTH = 16, 4


@dataclass(frozen=True, eq=False)
class Photons:
    """Photons where they land; all arrays have ``n`` rows.

    Attributes
    ----------
    position, normal, toward:
        ``(n, 3)``: the point, the unit geometric normal on the side that the light comes from, and the unit direction
        that it comes from; world space.
    power:
        ``(n, 3)``: flux of each.
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

    def inside(self, region: NDArray[np.float64] | None) -> Photons:
        """The photons in a box."""
        return self.select(are_inside(self.position, region))

    def select(self, which: NDArray[np.generic]) -> Photons:
        """The photons that a mask or indices select."""
        return Photons(*(getattr(self, each.name)[which] for each in fields(self)))

    @staticmethod
    def dark(count: int) -> Photons:
        """``count`` photons without power, at the origin."""
        point = np.zeros((count, 3), np.float32)
        return Photons(point, point, point, point, np.zeros(count, np.uint32))

    @staticmethod
    def join(parts: list[Photons]) -> Photons:
        """All photons of several sets."""
        return Photons(*(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(Photons)))


def are_inside(points: NDArray[np.floating], region: NDArray[np.float64] | None) -> NDArray[np.bool_]:
    """``(n,)``: which of the points ``(n, 3)`` lie in the box with these corners ``(2, 3)``; all where it is None."""
    if region is None:
        return np.ones(len(points), bool)
    inside: NDArray[np.bool_] = ((points >= region[0]) & (points <= region[1])).all(axis=1)
    return inside


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

    def __init__(self, irradiance: Color3f, toward: Vector3f, flux: Color3f) -> None:
        self.irradiance = irradiance
        self.toward = toward
        self.flux = flux


class PhotonMap:
    """Two independent sets of photons, one for each half of a picture's samples.

    Parameters
    ----------
    halves:
        The photons.
    radius:
        Of a look-up, in world units.
    """

    def __init__(self, halves: tuple[Photons, Photons], radius: float) -> None:
        self.radius = radius
        self.halves = halves
        most = max(1, *(len(half) for half in halves))
        self._mask = (1 << max(1, math.ceil(math.log2(most)))) - 1
        # Opaque to the compiler, so that all sets of photons share a kernel.
        self._last_bucket = dr.opaque(mi.UInt32, self._mask)
        starts, ordered, before = [], [], 0
        near = np.zeros(_NEAR_BITS * (self._mask + 1), bool)
        for half in halves:
            # In single precision as on the device, so that both find the same cells.
            cell = np.floor(half.position / np.float32(radius)).astype(np.int32).astype(np.uint32)
            bucket = _hash_cells(cell) & np.uint32(self._mask)
            order = np.argsort(bucket, kind="stable")
            edges = np.searchsorted(bucket[order], np.arange(self._mask + 2))
            starts.append(edges + before)
            before += len(half)
            ordered.append(half.select(order))
            _mark_near(near, half.position, radius)
        photons = Photons.join(ordered)
        if not len(photons):  # gathers need something to point at
            photons = Photons.dark(1)
        self._start = upload(np.concatenate(starts).astype(np.uint32))
        # Rows of four numbers are fetched at once.
        self._position, self._normal, self._toward = (
            upload(_rows_of_four(getattr(photons, name))) for name in ("position", "normal", "toward")
        )
        self._power_and_surfaces = upload(_rows_of_four(photons.power, photons.surfaces))
        self._near = upload(np.packbits(near, bitorder="little").view("<u4"))
        self._last_near = dr.opaque(mi.UInt32, len(near) - 1)
        self._r = dr.opaque(mi.Float, radius)

    def may_reach(self, p: Point3f, active: Bool) -> Bool:
        """Whether photons may be in reach of a look-up at ``p``: in a large world most points have none."""
        cell = _hash_cell(dr.floor(p / (_NEAR_WIDTH * self._r))) & self._last_near
        word = dr.gather(mi.UInt32, self._near, cell >> 5, active)
        return (word >> (cell & 31) & 1) != 0

    @syntax
    def gather(
        self,
        si: SurfaceInteraction3f,
        normal: Vector3f,
        lobe: Vector3f,
        half: UInt32,
        surfaces: UInt32,
        choice: Float,
        by_kernel: Bool,
        active: Bool,
        part: UInt32 | int = 0,
        most: int = 1 << 31,
    ) -> Gathered:
        """Light of the photons around a point: by an Epanechnikov kernel, or in its cell.

        Parameters
        ----------
        si:
            The point.
        normal:
            Its geometric normal on the side that is seen.
        lobe:
            Normal of its narrow lobe (:func:`~lippmann.rendering.transport.sharp_events.sharp_lobe`): photons that it
            reflects sharply are not counted.
        half:
            0 or 1: which photons.
        surfaces:
            Most sharp events of a photon that counts.
        choice:
            Uniform random number in [0, 1) that chooses one photon.
        by_kernel:
            Whether an Epanechnikov kernel is used, as for points that the eye sees; else the mean over the part of the
            tangent plane in the point's cell, at a tenth of the cost.
        part, most:
            At most ``most`` photons of a bucket are read: every second, fourth, ... one from number ``part`` on, with
            that weight. The mean over successive parts is that of all photons.
        """
        r = self._r
        p = mi.Point3f(si.p)
        base = dr.floor(p / r) - 1
        # Largest distance of a cell's centre from the tangent plane whose slab touches the cell.
        reach = r * (TUNING.farthest_from_plane + 0.5 * dr.sum(dr.abs(normal)))
        total = mi.Color3f(0)
        weights = mi.Float(0)  # of the photons met so far; one of them is chosen by reservoir sampling
        chosen = mi.Vector3f(0, 0, 1)
        color = mi.Color3f(0)
        # Number 13 of the 27 cells is the point's own.
        corner = dr.select(by_kernel, mi.UInt32(0), 13)
        end_corner = dr.select(by_kernel, mi.UInt32(27), 14)
        density = dr.select(by_kernel, 2 / (dr.pi * r * r), 1 / _area_in_cell(p - (base + 1) * r, normal, r))
        first = mi.UInt32(part)
        first_bucket = half * (self._last_bucket + 2)
        looking = active & self.may_reach(p, active)
        while dr.hint(
            looking,
            label="cells",
            exclude=[si, p, r, normal, lobe, surfaces, by_kernel, base, end_corner, reach, first, first_bucket],
        ):
            cell = base + mi.Vector3f(mi.Float(corner % 3), mi.Float(corner // 3 % 3), mi.Float(corner // 9))
            from_center = (cell + 0.5) * r - p
            touches = dr.abs(dr.dot(from_center, normal)) < reach
            touches &= dr.squared_norm(dr.maximum(dr.abs(from_center) - 0.5 * r, 0)) < r * r
            bucket = first_bucket + (_hash_cell(cell) & self._last_bucket)
            number = dr.gather(mi.UInt32, self._start, bucket, looking)
            end = dr.gather(mi.UInt32, self._start, bucket + 1, looking)
            # The smallest stride, a power of two, with which `most` steps reach the last photon.
            step = mi.UInt32(1) << (32 - dr.lzcnt((dr.maximum(end - number, 1) - 1) // most))
            number += (first - number) & (step - 1)
            inside = looking & touches & (number < end)
            while dr.hint(
                inside, label="photons", exclude=[si, p, r, normal, lobe, surfaces, by_kernel, step, cell, end]
            ):
                q = dr.gather(mi.Vector4f, self._position, number, inside).xyz
                apart = q - p
                distance2 = dr.squared_norm(apart)
                near = inside & (~by_kernel | (distance2 < r * r))
                if dr.hint(near, exclude=[si, r, normal, lobe, surfaces, by_kernel, step, cell, q, apart, distance2]):
                    # Two of the cells may share a bucket.
                    fits = near & dr.all(dr.floor(q / r) == cell)
                    n = dr.gather(mi.Vector4f, self._normal, number, near).xyz
                    d = dr.gather(mi.Vector4f, self._toward, number, near).xyz
                    fits &= (dr.dot(n, normal) > TUNING.least_agreement) & (dr.dot(d, normal) > 0)
                    fits &= dr.abs(dr.dot(apart, normal)) < TUNING.farthest_from_plane * r
                    brought = dr.gather(mi.Vector4f, self._power_and_surfaces, number, fits)
                    fits &= brought.w <= mi.Float(surfaces)
                    wo = si.to_local(d)
                    fits &= ~is_sharp(si.wi, wo, lobe)
                    share_of_power = dr.select(by_kernel, 1 - distance2 / (r * r), 1)
                    power = dr.select(fits, mi.Color3f(brought.xyz) * (share_of_power * mi.Float(step)), 0)
                    # dr.mean would make the number of lanes a constant of the kernel.
                    weight = (power.x + power.y + power.z) / 3
                    weights += weight
                    share = dr.select(weight > 0, weight / weights, 0)
                    is_chosen = choice < share
                    choice = dr.select(is_chosen, choice / share, (choice - share) / (1 - share))
                    chosen = dr.select(is_chosen, d, chosen)
                    # Photons land on the true geometry, which is shaded by its interpolated normal.
                    power *= dr.minimum(dr.abs(wo.z) / dr.dot(d, normal), TUNING.steepest)
                    total += power
                    color = dr.select(is_chosen, power / weight, color)
                number += step
                inside &= number < end
            corner += 1
            looking &= corner < end_corner
        return Gathered(total * density, chosen, color * weights * density)


def _hash_cells(cell: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """``(n,)``: hashes of cells ``(n, 3)``."""
    x, y, z = (cell[:, axis] * np.uint32(factor) for axis, factor in enumerate(_FACTORS))
    return np.asarray(x ^ y ^ z, dtype=np.uint32)


def _hash_cell(cell: Point3f) -> UInt32:
    """:func:`_hash_cells` on the device."""
    x, y, z = (mi.UInt32(mi.Int32(part)) * factor for part, factor in zip(cell, _FACTORS, strict=True))
    return x ^ y ^ z


def _mark_near(near: NDArray[np.bool_], position: Floats, radius: float) -> None:
    """Mark the hashes of the wide cells that hold points with photons in reach."""
    width = np.float32(_NEAR_WIDTH) * np.float32(radius)
    for corner in itertools.product((-1, 1), repeat=3):
        cell = np.floor((position + np.float32((1 + TUNING.rounding) * radius) * np.array(corner, np.float32)) / width)
        near[_hash_cells(cell.astype(np.int32).astype(np.uint32)) & np.uint32(len(near) - 1)] = True


def _area_in_cell(place: Vector3f, normal: Vector3f, side: Float) -> Float:
    """Area of the plane through ``place`` in a cell with corners 0 and ``side``, no less than a share of its face.

    It is the derivative, by the plane's distance, of the cell's volume below the plane: a sum over its corners.
    """
    # A normal's components are kept away from 0: the area hardly changes, and divisions by them lose no precision.
    n = dr.maximum(dr.abs(normal), _LEAST_SLOPE)
    at = dr.select(normal < 0, side - place, place)
    height = dr.dot(n, at)
    area = mi.Float(0)
    for corner in itertools.product((0, 1), repeat=3):
        below = dr.maximum(height - side * dr.dot(n, mi.Vector3f(*corner)), 0)
        area += (-1) ** sum(corner) * dr.square(below)
    area *= dr.norm(n) / (2 * n.x * n.y * n.z)
    return dr.maximum(area, _LEAST_AREA * side * side)


def _rows_of_four(values: Floats, last: NDArray[np.uint32] | None = None) -> Floats:
    """``(4 n,)``: rows of three numbers, each followed by one of ``last`` or by 0."""
    rows = np.zeros((len(values), 4), np.float32)
    rows[:, :3] = values
    if last is not None:
        rows[:, 3] = last
    return rows.ravel()
