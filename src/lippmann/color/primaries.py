"""Linear RGB of other primaries as linear RGB of Rec. 709, the program's own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]

#: Chromaticities x, y of red, green, blue and white.
REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
P3_D65 = (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, *REC709[6:])
REC2020 = (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, *REC709[6:])
ACES_AP1 = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)

#: Cone responses of XYZ (Lam 1985, "Bradford"), in which whites are adapted.
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


def xyz_from_rgb(chromaticities: Sequence[float]) -> Matrix:
    """``(3, 3)`` from linear RGB to XYZ, with Y = 1 for white (SMPTE RP 177-1993).

    Parameters
    ----------
    chromaticities:
        x and y of red, green, blue and white, eight numbers.

    Raises
    ------
    ValueError
        They are not finite, the y of white is 0, or the primaries lie on a line.
    """
    x, y = np.asarray(chromaticities, np.float64).reshape(4, 2).T
    if not np.isfinite([x, y]).all() or y[3] == 0.0:
        raise ValueError("chromaticities must be finite, with y of white other than 0")
    # A primary's y may be 0: those of XYZ itself are (1, 0), (0, 1) and (0, 0).
    xyz = np.stack([x, y, 1.0 - x - y])
    primaries, white = xyz[:, :3], xyz[:, 3] / y[3]
    if abs(np.linalg.det(primaries)) < 1e-9:
        raise ValueError("the primaries must not lie on a line")
    return np.asarray(primaries * np.linalg.solve(primaries, white))


def rec709_from_rgb(chromaticities: Sequence[float]) -> Matrix:
    """``(3, 3)`` from linear RGB of the given chromaticities to that of Rec. 709; white stays (1, 1, 1).

    Values of XYZ itself are the colours that they say: its nominal white is that of no picture (OpenEXR's ``XYZ.exr``
    and ``Rec709.exr`` are one picture).

    Errors are those of :func:`xyz_from_rgb`.
    """
    theirs = xyz_from_rgb(chromaticities)
    if np.allclose(theirs, np.eye(3), atol=1e-5):
        return np.asarray(np.linalg.inv(xyz_from_rgb(REC709)))
    return np.asarray(rec709_from_xyz(theirs.sum(axis=1)) @ theirs)


def rec709_from_xyz(white: Matrix) -> Matrix:
    """``(3, 3)`` from XYZ, whose white is ``white``, to linear RGB of Rec. 709; white becomes (1, 1, 1)."""
    ours = xyz_from_rgb(REC709)
    gains = (_BRADFORD @ ours.sum(axis=1)) / (_BRADFORD @ white)
    return np.asarray(np.linalg.solve(ours, np.linalg.solve(_BRADFORD, gains[:, None] * _BRADFORD)))


def to_rec709(pixels: NDArray[np.float32], rec709_from_theirs: Matrix) -> NDArray[np.float32]:
    """Linear values ``(..., 3)`` as linear RGB of Rec. 709; colours beyond its primaries are clipped at 0."""
    return np.asarray(np.maximum(pixels @ rec709_from_theirs.astype(np.float32).T, 0.0))
