"""The grid of a volume: made of what a file holds, checked, moved, cropped, and the part of it that can be seen."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.values.volume import STORED, Numbers, Volume

#: Most voxels along an axis.
MOST_VOXELS = 1 << 16
#: Coordinates beyond this are damage.
_FARTHEST = 1e15
#: Values beyond this are damage.
_LARGEST = 1e30
#: Voxels that tell where something can be seen.
_MOST_TELLING = 1 << 21
#: Shares of the opacity that lie outside of what counts as seen, on either side of each axis.
_OUTER = 1e-3


def storable(values: NDArray[np.generic]) -> tuple[NDArray[np.generic], str]:
    """A grid as it can be stored, contiguous, and a note on values that are no numbers ("" without any).

    Numbers of other kinds become float32. NaN and infinite values become the lowest finite one.
    """
    if values.dtype == np.int8:
        values = values.astype(np.int16)
    elif values.dtype.newbyteorder("=") not in STORED or values.dtype.kind == "f":
        with np.errstate(over="ignore"):
            values = np.ascontiguousarray(values, np.float32)
        finite = np.isfinite(values)
        if not finite.all():
            bad = int(values.size - np.count_nonzero(finite))
            if bad == values.size:
                return np.zeros(values.shape, np.float32), "no voxel is a finite number: all count as 0"
            values = np.where(finite, values, values[finite].min())
            return np.ascontiguousarray(values), f"{bad} voxels are no finite numbers, and count as the lowest value"
    return np.ascontiguousarray(values, values.dtype.newbyteorder("=")), ""


def check_volume(volume: Volume, where: str) -> None:
    """Check that a volume can be rendered.

    Raises
    ------
    SceneError
        The grid has other than three axes or holds other kinds of numbers; it has no extent in the world.
    """
    shape = volume.grid.shape
    if volume.grid.ndim != 3 or min(shape) < 1 or max(shape) > MOST_VOXELS:
        raise SceneError(f"the volume's grid is {shape}", where=where, rule=f"three axes of 1 to {MOST_VOXELS} voxels")
    if volume.grid.dtype not in STORED or not volume.grid.flags.c_contiguous:
        kinds = ", ".join(np.dtype(kind).name for kind in STORED)
        raise SceneError(f"the volume's grid is of {volume.grid.dtype}", where=where, rule=f"contiguous, of {kinds}")
    if volume.grid.dtype.kind == "f" and not np.isfinite(volume.grid).all():
        raise SceneError("the volume holds values that are not finite", where=where)
    matrix = np.asarray(volume.world_from_voxel, np.float64)
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all() or np.abs(matrix).max() > _FARTHEST:
        raise SceneError("the volume's place in the world is no 4x4 matrix of finite numbers", where=where)
    lengths = volume.spacing
    if lengths.min() <= 0.0 or abs(np.linalg.det(matrix[:3, :3] / lengths)) < 1e-6:
        raise SceneError("the volume's voxels have no extent", where=where, rule="three axes that span space")
    check_values(volume.grid, volume.slope, volume.intercept, where)


def check_values(grid: NDArray[np.generic], slope: float, intercept: float, where: str) -> None:
    """Check that values, ``slope`` times stored numbers plus ``intercept``, are within bounds.

    Raises
    ------
    SceneError
        They are not.
    """
    if not (np.isfinite([slope, intercept]).all() and slope > 0.0):
        raise SceneError("the volume's values have no scale", where=where, rule="a slope above 0")
    ends = np.array([grid.min(), grid.max()], np.float64) * slope + intercept
    if not np.abs(ends).max() <= _LARGEST:
        raise SceneError(f"the volume's values reach {ends[1]:g}", where=where, rule=f"numbers up to {_LARGEST:g}")


def move(volume: Volume, matrix: Numbers) -> Volume:
    """The volume moved by an affine ``matrix`` ``(4, 4)``."""
    return replace(volume, world_from_voxel=np.asarray(matrix, np.float64) @ volume.world_from_voxel)


def crop(volume: Volume, box: Numbers) -> Volume | None:
    """The smallest block of the grid with all voxels whose middle lies in a box ``(2, 3)``; None if there are none.

    Where the grid's axes run along the world's, it holds no others.
    """
    voxel_from_world = np.linalg.inv(volume.world_from_voxel)
    corners = np.array(list(itertools.product(*zip(*box, strict=True))))
    places = corners @ voxel_from_world[:3, :3].T + voxel_from_world[:3, 3]
    first = np.clip(np.ceil(places.min(axis=0) - 1e-6), 0, None).astype(int)
    last = np.minimum(np.floor(places.max(axis=0) + 1e-6), np.array(volume.size) - 1).astype(int)
    if (last < first).any():
        return None
    (x0, y0, z0), (x1, y1, z1) = first, last + 1
    offset = np.eye(4)
    offset[:3, 3] = first
    grid = np.ascontiguousarray(volume.grid[z0:z1, y0:y1, x0:x1])
    return replace(volume, grid=grid, world_from_voxel=volume.world_from_voxel @ offset)


def visible_corners(volume: Volume) -> Numbers:
    """Corners ``(8, 3)`` in the world of the block of the grid in which nearly all opacity lies; else of all of it."""
    step = max(1, round((volume.grid.size / _MOST_TELLING) ** (1 / 3)))
    telling = volume.grid[::step, ::step, ::step].astype(np.float64) * volume.slope + volume.intercept
    opacity = np.interp(telling, volume.transfer.values, volume.transfer.opacities)
    low, high = np.zeros(3), np.array(volume.size, float)
    for axis in range(3):  # x, y, z: the last axis of the grid first
        share = opacity.sum(axis=tuple(other for other in range(3) if other != 2 - axis))
        total = np.cumsum(share)
        if total[-1] <= 0.0:
            return _corners(volume, np.zeros(3), np.array(volume.size, float))
        visible = np.flatnonzero((total > _OUTER * total[-1]) & (total - share < (1.0 - _OUTER) * total[-1]))
        if not len(visible):  # opacities so faint that shares of them are nothing
            return _corners(volume, np.zeros(3), np.array(volume.size, float))
        low[axis], high[axis] = visible[0] * step, min((visible[-1] + 1) * step, high[axis])
    return _corners(volume, low, high)


def _corners(volume: Volume, low: Numbers, high: Numbers) -> Numbers:
    """In the world; ``low`` and ``high`` count whole voxels from the outer side of the first."""
    places = np.array(list(itertools.product(*zip(low, high, strict=True)))) - 0.5
    corners: Numbers = places @ volume.world_from_voxel[:3, :3].T + volume.world_from_voxel[:3, 3]
    return corners
