"""A height field in two layers: what the camera saw, and what goes on behind its near edges.

All is reckoned in inverse depth, to which parallax on a display is proportional. A layered depth image has the same
purpose (Shade et al. 1998).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from lippmann.errors import SceneError

Plane = NDArray[np.float32]
Mask = NDArray[np.bool_]
Faces = NDArray[np.uint32]

#: A step of so much of the range of inverse depth from a pixel to the next is an edge, where the surface ends.
EDGE = 0.05
#: Share of pixels that may lie nearer or farther than the rest: as far as those they are brought.
_OUTLIERS = 0.1
# Pixels at an edge whose colours may be those of both sides.
_MIXED = 2


@dataclass(frozen=True, eq=False)
class Layers:
    """Two height fields over one grid ``(h, w)``.

    Attributes
    ----------
    nearness, faces:
        What the camera saw: inverse depth brought to [0, 1], 1 the nearest, and triangles ``(m, 3)`` of points counted
        by rows, without those across edges.
    behind, behind_colors, behind_faces:
        The same of what goes on behind, with its colours ``(h, w, 3)``.
    filled:
        Share of pixels whose depth was unknown.
    """

    nearness: Plane
    faces: Faces
    behind: Plane
    behind_colors: Plane
    behind_faces: Faces
    filled: float


def split_layers(inverse: Plane, colors: Plane, where: str) -> Layers:
    """The two layers of inverse depth ``(h, w)`` and its colours ``(h, w, 3)``.

    Depth that is unknown (NaN) is filled from beside.

    Raises
    ------
    SceneError
        No depth is known.
    """
    known = np.isfinite(inverse)
    if not known.any():
        raise SceneError("the depth map tells no depth", where=where, rule="it is above 0 somewhere")
    low, high = np.percentile(inverse[known], (_OUTLIERS, 100.0 - _OUTLIERS))
    scale = float(high - low) or 1.0
    nearness = np.where(known, np.clip((inverse - low) / scale, 0.0, 1.0), 0.0).astype(np.float32)
    if not known.all():
        nearness = _fill(nearness[..., None], known)[..., 0]
    near_edge = nearness - ndimage.minimum_filter(nearness, 3) > EDGE
    far_edge = ndimage.maximum_filter(nearness, 3) - nearness > EDGE
    behind, behind_colors, hidden = _behind(nearness, colors, near_edge, far_edge)
    faces = _triangles(nearness.shape)
    is_cut = np.ptp(nearness.ravel()[faces], axis=1) > EDGE
    return Layers(
        nearness=nearness,
        faces=faces[~is_cut],
        behind=behind,
        behind_colors=behind_colors,
        # Without holes: where the far side is uneven, a steep triangle is better than the black behind both layers.
        behind_faces=faces[is_cut | hidden.ravel()[faces].any(axis=1)],
        filled=float(1.0 - known.mean()),
    )


def _behind(nearness: Plane, colors: Plane, near_edge: Mask, far_edge: Mask) -> tuple[Plane, Plane, Mask]:
    """Nearness and colours with the far side going on behind what is near, and where they do."""
    sources = far_edge & ~near_edge
    if not sources.any():
        return nearness, colors, np.zeros_like(near_edge)
    # The far side some pixels away from the edge, whose own pixels show both sides mixed.
    distance, nearest = ndimage.distance_transform_edt(~sources, return_indices=True)
    level = nearness[tuple(nearest)]
    clear = (distance > _MIXED) & (distance <= 3 * _MIXED) & (np.abs(nearness - level) <= EDGE) & ~near_edge
    filled = _fill(np.concatenate([nearness[..., None], colors], axis=2), clear if clear.any() else sources)
    hidden = nearness - filled[..., 0] > EDGE / 2
    result = np.where(hidden, filled[..., 0], nearness).astype(np.float32)
    return result, np.where(hidden[..., None], filled[..., 1:], colors).astype(np.float32), hidden


def _fill(values: NDArray[np.float32], known: Mask) -> NDArray[np.float32]:
    """Values ``(h, w, c)`` where they are known, elsewhere means of known ones about, as near as there are any.

    By a pyramid: means of four, weighted by what is known of them, go down to a single one, and come up again where
    something is missing (pull-push; Gortler et al. 1996, The Lumigraph, section 3.4).
    """
    weight = known[..., None].astype(np.float32)
    return _pull_push(np.where(known[..., None], values, 0.0).astype(np.float32), weight)


def _pull_push(values: Plane, weight: Plane) -> Plane:
    """Values ``(h, w, c)`` as far as their weights ``(h, w, 1)`` of at most 1 go, the rest from coarser values."""
    if weight.min() >= 1.0 or values.shape[0] * values.shape[1] == 1:
        return values
    shares = _quarter(weight)
    coarse = np.asarray(_quarter(values * weight) / np.maximum(shares, 1e-9), np.float32)
    rest = _double(_pull_push(coarse, np.minimum(shares, 1.0).astype(np.float32)), values.shape[:2])
    return np.asarray(weight * values + (1 - weight) * rest, np.float32)


def _quarter(values: Plane) -> Plane:
    """Sums ``(ceil(h / 2), ceil(w / 2), c)`` of two by two values ``(h, w, c)``."""
    for axis in (0, 1):
        values = np.add.reduceat(values, np.arange(0, values.shape[axis], 2), axis=axis)
    return values


def _double(values: Plane, shape: tuple[int, ...]) -> Plane:
    """Values of twice the resolution, or one row or column less, between those of ``(h, w, c)``: bilinear."""
    for axis, count in enumerate(shape):
        edges = [(1, 1) if each == axis else (0, 0) for each in range(3)]
        around = np.moveaxis(np.pad(values, edges, mode="edge"), axis, 0)
        own = np.float32(0.75) * around[1:-1]
        pairs = np.stack([own + np.float32(0.25) * around[:-2], own + np.float32(0.25) * around[2:]], axis=1)
        values = np.moveaxis(pairs.reshape(-1, *pairs.shape[2:])[:count], 0, axis)
    return values


def _triangles(shape: tuple[int, ...]) -> Faces:
    """Triangles ``(m, 3)`` of a grid, counter-clockwise for who looks at the picture."""
    rows, columns = shape
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    right, below = first + 1, first + columns
    lower = np.stack([first, below, below + 1], axis=1)
    upper = np.stack([first, below + 1, right], axis=1)
    return np.concatenate([lower, upper]).astype(np.uint32)
