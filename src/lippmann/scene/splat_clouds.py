"""Clouds of Gaussian splats as a whole: checked, moved, cropped, and their extent without floaters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.values.splats import COEFFICIENTS, Splats, real_harmonics, rotation_matrices

Numbers = NDArray[np.float64]

#: Coordinates and standard deviations beyond this are damage: boxes' areas would be infinite in single precision.
_FARTHEST = 1e15

#: Standard deviations at which a Gaussian counts as having its end.
_REACH = 2.0
#: Splats that tell the extent of a cloud: more do not change it.
_MOST_TELLING = 1 << 16
#: Along each axis the cloud's extent is that between these shares of its opacity, and this share of it more on either
#: side; but no more than between the outer ones. Floaters are seldom more than a few hundredths.
_INNER, _MARGIN, _OUTER = 0.05, 0.15, 0.002
#: Shares between which tails of measured points are followed outward, and how many times sparser than the inner ones.
_TAIL, _SPARSE = (_INNER, 0.04, 0.03, 0.02, 0.01, 0.005, _OUTER), 20.0
#: Splats that are moved at a time.
_AT_A_TIME = 1 << 18
#: Stretches that differ by less than this share are one.
_SAME = 1e-5


def check_splats(splats: Splats, where: str) -> None:
    """Check that arrays fit together and hold numbers in their ranges.

    Raises
    ------
    SceneError
        They do not, or there are no splats.
    """
    count = splats.count
    if count == 0:
        raise SceneError("holds no Gaussian splats", where=where, rule="there must be something to see")
    shapes = {"centers": (3,), "scales": (3,), "rotations": (4,), "opacities": ()}
    for name, shape in shapes.items():
        if getattr(splats, name).shape != (count, *shape):
            raise SceneError(
                f"splats' {name} are {getattr(splats, name).shape}", where=where, rule=f"{(count, *shape)}"
            )
    harmonics = splats.harmonics.shape
    if len(harmonics) != 3 or harmonics[0] != count or harmonics[1] not in COEFFICIENTS or harmonics[2] != 3:
        raise SceneError(f"splats' harmonics are {harmonics}", where=where, rule=f"({count}, 1, 4, 9, 16 or 25, 3)")
    for name in (*shapes, "harmonics"):
        values = getattr(splats, name)
        finite = np.isfinite(values).reshape(count, -1).all(axis=1)
        if not finite.all():
            raise SceneError(
                f"{int((~finite).sum())} splats have {name} that are not finite (first: number {np.argmin(finite)})",
                where=where,
                rule="all numbers of a splat must be finite",
            )
    if np.abs(splats.centers).max() > _FARTHEST or splats.scales.max() > _FARTHEST:
        raise SceneError("splats lie beyond all bounds", where=where, rule=f"coordinates up to {_FARTHEST:g}")
    if (splats.scales < 0.0).any() or (splats.opacities < 0.0).any() or (splats.opacities > 1.0).any():
        raise SceneError("splats' scales or opacities are out of range", where=where, rule="0 or more, and 0 to 1")


def move(splats: Splats, matrix: Numbers) -> Splats:
    """The cloud moved by an affine ``matrix`` ``(4, 4)``: centres, axes, and what they show from where.

    The harmonics turn by the matrix's rotation, or rotation and mirroring; a stretch leaves them alone.
    """
    from scipy.spatial.transform import Rotation  # here: it takes longer to load than most scenes

    linear = np.asarray(matrix, np.float64)[:3, :3]
    left, stretches, right = np.linalg.svd(linear)
    turn = left @ right
    is_similar = stretches[0] - stretches[2] <= _SAME * stretches[0] and np.linalg.det(turn) > 0
    if is_similar:
        scales = splats.scales * np.float32(stretches.mean())
        rotations = (Rotation.from_matrix(turn) * Rotation.from_quat(splats.rotations)).as_quat().astype(np.float32)
    else:
        scales, rotations = np.empty_like(splats.scales), np.empty_like(splats.rotations)
        for start in range(0, splats.count, _AT_A_TIME):
            part = slice(start, start + _AT_A_TIME)
            axes = linear @ (rotation_matrices(splats.rotations[part]) * splats.scales[part][:, None, :])
            own, lengths, _ = np.linalg.svd(axes)
            own[:, :, 2] *= np.linalg.det(own)[:, None]
            scales[part], rotations[part] = lengths, Rotation.from_matrix(own).as_quat()
    centers = splats.centers @ linear.T + np.asarray(matrix, np.float64)[:3, 3]
    return replace(
        splats,
        centers=centers.astype(np.float32),
        scales=scales,
        rotations=rotations,
        harmonics=_turn(splats.harmonics, turn),
    )


def _turn(harmonics: NDArray[np.float32], turn: Numbers) -> NDArray[np.float32]:
    """Coefficients of the same functions on the sphere, turned by an orthogonal matrix ``(3, 3)``."""
    count = harmonics.shape[1]
    if count == 1 or np.array_equal(turn, np.eye(3)):
        return harmonics
    # Directions that tell all harmonics apart; a function turned is the function of the direction turned back.
    directions = np.random.default_rng(0).normal(size=(64, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    here, there = (
        np.stack(real_harmonics(d[:, 0], d[:, 1], d[:, 2]), axis=1)[:, :count] for d in (directions, directions @ turn)
    )
    matrix = (np.linalg.pinv(here) @ there).astype(np.float32)
    turned: NDArray[np.float32] = np.einsum("ij,njk->nik", matrix, harmonics, optimize=True)
    return turned


def crop(splats: Splats, box: Numbers) -> Splats:
    """The splats whose centres lie in a box ``(2, 3)``."""
    return splats.select(((splats.centers >= box[0]) & (splats.centers <= box[1])).all(axis=1))


def typical_points(splats: Splats) -> Numbers:
    """Points ``(n, 3)`` between which the cloud lies but for its floaters: ends of Gaussians, float64.

    Floaters are what lies far outside of where nearly all opacity is; see :data:`_INNER`.
    """
    splats = splats.select(np.flatnonzero(splats.opacities > 0.0)) if (splats.opacities > 0.0).any() else splats
    step = -(-splats.count // _MOST_TELLING)
    telling = splats.select(np.arange(0, splats.count, step))
    axes = rotation_matrices(telling.rotations) * telling.scales[:, None, :].astype(np.float64)
    ends = np.concatenate([axes, -axes], axis=2).transpose(0, 2, 1) * _REACH
    points = (telling.centers[:, None, :].astype(np.float64) + ends).reshape(-1, 3)
    weights = np.repeat(telling.opacities.astype(np.float64), 6)
    keep = bulk_of(points, weights)
    return points[keep] if keep.any() else points


def bulk_of(points: Numbers, weights: Numbers, *, tails: bool = False) -> NDArray[np.bool_]:
    """Which of points ``(n, 3)`` of weights ``(n,)`` are no floaters, far outside of where nearly all weight is.

    With ``tails`` points count as far out as they thin out gradually, as measured data do.
    """
    keep = np.ones(len(points), bool)
    for axis in range(3):
        low, high = _extent(points[:, axis], weights, tails=tails)
        keep &= (points[:, axis] >= low) & (points[:, axis] <= high)
    return keep


def _extent(values: Numbers, weights: Numbers, *, tails: bool) -> tuple[float, float]:
    order = np.argsort(values)
    values, weights = values[order], weights[order]
    total = np.cumsum(weights)
    if total[-1] <= 0.0:
        return float(values[0]), float(values[-1])
    # A value's place is the middle of its own share.
    places = (total - weights / 2.0) / total[-1]
    shares = np.array(_TAIL)
    down, up = (np.asarray(np.interp(at, places, values)) for at in (shares, 1.0 - shares))
    span = float(up[0] - down[0])
    ends = []
    for lengths in (down[0] - down, up - up[0]):  # from an inner end outward
        reach = min(float(lengths[-1]), _MARGIN * span)
        is_sparse = np.diff(lengths) > _SPARSE * -np.diff(shares) * span / (1.0 - 2.0 * _INNER)
        ends.append(max(reach, float(lengths[np.argmax([*is_sparse, True])])) if tails else reach)
    return float(down[0]) - ends[0], float(up[0]) + ends[1]
