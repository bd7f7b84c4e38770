"""Gaussian splats as plain values: the radiance field of a 3D Gaussian splatting scan, in world units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float32]
#: A number, or an array of numbers.
Real = TypeVar("Real", float, NDArray[np.float64])

#: Spherical harmonics of a degree and those below it.
COEFFICIENTS = (1, 4, 9, 16, 25)


@dataclass(frozen=True, eq=False)
class Splats:
    """``n`` Gaussians in the world; all arrays float32.

    Attributes
    ----------
    centers:
        ``(n, 3)``.
    scales:
        ``(n, 3)``: standard deviations along the Gaussian's own axes, 0 or more.
    rotations:
        ``(n, 4)``: unit quaternions (x, y, z, w) that turn the Gaussian's own axes into the world's.
    opacities:
        ``(n,)``: alpha at the centre, in [0, 1].
    harmonics:
        ``(n, k, 3)``: coefficients of the real spherical harmonics of RGB, k of :data:`COEFFICIENTS`, in the order and
        with the signs of Kerbl et al. 2023 (Condon-Shortley phase, m from -l to l). A Gaussian's colour along a ray of
        direction d is max(0, 0.5 + sum of coefficients times harmonics of d).
    linear:
        Whether colours are linear and composited so; mostly they are sRGB-coded, and composited as codes.
    """

    centers: FloatArray
    scales: FloatArray
    rotations: FloatArray
    opacities: FloatArray
    harmonics: FloatArray
    linear: bool = False

    @property
    def count(self) -> int:
        """Number of Gaussians."""
        return len(self.centers)

    @property
    def degree(self) -> int:
        """Degree of the spherical harmonics, 0 to 4."""
        return COEFFICIENTS.index(self.harmonics.shape[1])

    def select(self, which: NDArray[np.bool_] | NDArray[np.intp]) -> Splats:
        """Those of a mask or of indices."""
        return Splats(
            self.centers[which],
            self.scales[which],
            self.rotations[which],
            self.opacities[which],
            self.harmonics[which],
            self.linear,
        )


def join(parts: Sequence[Splats]) -> Splats:
    """All splats of several clouds (at least one) of one kind of colour; missing harmonics are 0."""
    most = max(part.harmonics.shape[1] for part in parts)
    harmonics = [np.pad(part.harmonics, ((0, 0), (0, most - part.harmonics.shape[1]), (0, 0))) for part in parts]
    return Splats(
        np.concatenate([part.centers for part in parts]),
        np.concatenate([part.scales for part in parts]),
        np.concatenate([part.rotations for part in parts]),
        np.concatenate([part.opacities for part in parts]),
        np.concatenate(harmonics),
        parts[0].linear,
    )


def real_harmonics(x: Real, y: Real, z: Real) -> tuple[Real, ...]:
    """The 25 real spherical harmonics up to degree 4 of a unit vector, as :class:`Splats` orders and signs them.

    Of numbers, or of arrays of one shape; plain arithmetic, which Numba compiles, too.
    """
    xx, yy, zz = x * x, y * y, z * z
    return (
        0.28209479177387814 + 0.0 * x,
        -0.4886025119029199 * y,
        0.4886025119029199 * z,
        -0.4886025119029199 * x,
        1.0925484305920792 * x * y,
        -1.0925484305920792 * y * z,
        0.31539156525252005 * (2.0 * zz - xx - yy),
        -1.0925484305920792 * x * z,
        0.5462742152960396 * (xx - yy),
        -0.5900435899266435 * y * (3.0 * xx - yy),
        2.890611442640554 * x * y * z,
        -0.4570457994644658 * y * (4.0 * zz - xx - yy),
        0.3731763325901154 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -0.4570457994644658 * x * (4.0 * zz - xx - yy),
        1.445305721320277 * z * (xx - yy),
        -0.5900435899266435 * x * (xx - 3.0 * yy),
        2.5033429417967046 * x * y * (xx - yy),
        -1.7701307697799304 * y * z * (3.0 * xx - yy),
        0.9461746957575601 * x * y * (6.0 * zz - xx - yy),
        -0.6690465435572892 * y * z * (4.0 * zz - 3.0 * xx - 3.0 * yy),
        0.10578554691520431 * (zz * (8.0 * zz - 24.0 * (xx + yy)) + 3.0 * (xx + yy) * (xx + yy)),
        -0.6690465435572892 * x * z * (4.0 * zz - 3.0 * xx - 3.0 * yy),
        0.47308734787878004 * (xx - yy) * (6.0 * zz - xx - yy),
        -1.7701307697799304 * x * z * (xx - 3.0 * yy),
        0.6258357354491761 * (xx * (xx - 3.0 * yy) - yy * (3.0 * xx - yy)),
    )


def rotation_matrices(quaternions: FloatArray) -> NDArray[np.float64]:
    """``(n, 3, 3)`` of unit quaternions ``(n, 4)`` (x, y, z, w)."""
    x, y, z, w = np.asarray(quaternions, np.float64).T
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=-1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], axis=-1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=-1),
        ],
        axis=1,
    )
