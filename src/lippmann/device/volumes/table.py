"""A volume prepared for rays: its transfer function integrated over values, and which of its bricks are empty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import MemoryLimitError
from lippmann.runtime.machine import amount_in_words
from lippmann.runtime.numba_jit import compiled, inlined
from lippmann.scene.matrices import inverse, transform_points
from lippmann.scene.values.volume import TransferFunction, Volume

#: Cells along a side of a brick, as a power of two.
BRICK_BITS = 3
#: Bins of a transfer function between its first point and its last.
BINS = 1024
#: Opacities above this count as this.
MOST_OPACITY = 1.0 - 1e-6

#: Values in bins that differ by no more are one.
EDGE = 1e-6

Numbers = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class VolumeTable:
    """A volume's data for rays.

    Attributes
    ----------
    grid:
        As of :class:`~lippmann.scene.values.volume.Volume`.
    voxel_from_world:
        ``(4, 4)``.
    bin_scale, bin_offset:
        A stored number times the first, plus the second, is a value in bins of the transfer function.
    extinction:
        ``(BINS + 2, 4)``: of each bin, with one below and one above for what lies beyond, the extinction coefficient
        per world unit, and its products with the colour. Beyond the transfer function it is that of its ends.
    integral:
        ``(BINS + 1, 4)``: ``extinction`` summed over the bins below each edge.
    occupied:
        ``(bz, by, bx)`` bool: bricks in which something can be seen.
    shading:
        As of :class:`~lippmann.scene.values.volume.TransferFunction`.
    """

    grid: NDArray[np.generic]
    voxel_from_world: Numbers
    bin_scale: float
    bin_offset: float
    extinction: Numbers
    integral: Numbers
    occupied: NDArray[np.bool_]
    shading: float

    @property
    def bounds(self) -> Numbers:
        """``(2, 3)``: a box in the world that holds all of the grid."""
        depth, height, width = self.grid.shape
        steps = np.array([[x, y, z] for x in (0, width) for y in (0, height) for z in (0, depth)]) - 0.5
        world_from_voxel = inverse(self.voxel_from_world)
        corners = transform_points(world_from_voxel, steps)
        return np.stack([corners.min(axis=0), corners.max(axis=0)])


def make_table(volume: Volume, memory: int, *, name: str = "") -> VolumeTable:
    """The table of a volume.

    Parameters
    ----------
    memory:
        Bytes that the picture may use, the grid among them.
    name:
        Name of the scene, for the error.

    Raises
    ------
    MemoryLimitError
        The grid takes more.
    """
    need = volume.grid.nbytes
    if need > memory:
        raise MemoryLimitError(
            f"the volume's {' x '.join(map(str, volume.size))} voxels take {amount_in_words(need)} of memory",
            where=name,
            rule=f"{amount_in_words(memory)} are left",
            fix="allow more with memory=..., or show a part with crop=...",
        )
    transfer = volume.transfer
    low, high = float(transfer.values[0]), float(transfer.values[-1])
    bins_per_value = BINS / (high - low)
    extinction = _extinction(transfer, low, high, volume.longest_side)
    integral = np.zeros((BINS + 1, 4))
    np.cumsum(extinction[1:-1], axis=0, out=integral[1:])
    bin_scale = volume.slope * bins_per_value
    bin_offset = (volume.intercept - low) * bins_per_value
    return VolumeTable(
        grid=volume.grid,
        voxel_from_world=np.linalg.inv(np.asarray(volume.world_from_voxel, np.float64)).astype(np.float64),
        bin_scale=bin_scale,
        bin_offset=bin_offset,
        extinction=extinction,
        integral=integral,
        occupied=_occupied(volume.grid, extinction[:, 0], bin_scale, bin_offset),
        shading=transfer.shading,
    )


def _extinction(transfer: TransferFunction, low: float, high: float, longest_side: float) -> Numbers:
    """``(BINS + 2, 4)``, see :attr:`VolumeTable.extinction`: at the middles of bins."""
    at = low + (high - low) * (np.arange(-1, BINS + 1) + 0.5) / BINS
    opacity = np.minimum(np.interp(at, transfer.values, transfer.opacities), MOST_OPACITY)
    length = 1.0 if transfer.per == "mm" else longest_side / 100.0
    coefficient = -np.log1p(-opacity) / length
    color = np.stack([np.interp(at, transfer.values, transfer.colors[:, c]) for c in range(3)], axis=1)
    table: Numbers = np.concatenate([coefficient[:, None], coefficient[:, None] * color], axis=1)
    return table


def _occupied(
    grid: NDArray[np.generic], coefficient: Numbers, bin_scale: float, bin_offset: float
) -> NDArray[np.bool_]:
    """Which bricks hold a value, or one between those of neighbours, whose extinction is above 0."""
    bricks = [max(1, -(-(count - 1) >> BRICK_BITS)) for count in grid.shape]
    occupied = np.empty(bricks, np.bool_)
    # The number of bins below each edge that are seen: between any two edges something is seen if it differs.
    visible_below = np.concatenate([[0], np.cumsum(coefficient > 0.0)])
    _find_occupied(grid, visible_below, bin_scale, bin_offset, occupied)
    return occupied


@inlined
def bin_of(value: float, bins: int) -> int:
    """The row of :attr:`VolumeTable.extinction` for a value in bins.

    An edge belongs to the bin below: what is transparent up to a value is so at that value, too.
    """
    return int(np.ceil(min(max(value - EDGE, 0.0), bins + 1.0)))


@compiled
def _find_occupied(
    grid: NDArray[np.generic],
    visible_below: NDArray[np.int64],
    bin_scale: float,
    bin_offset: float,
    occupied: NDArray[np.bool_],
) -> None:
    depth, height, width = grid.shape
    bins = len(visible_below) - 3
    side = 1 << BRICK_BITS
    for bz in range(occupied.shape[0]):
        for by in range(occupied.shape[1]):
            for bx in range(occupied.shape[2]):
                low = grid[bz * side, by * side, bx * side]
                high = low
                for z in range(bz * side, min(bz * side + side + 1, depth)):
                    for y in range(by * side, min(by * side + side + 1, height)):
                        for x in range(bx * side, min(bx * side + side + 1, width)):
                            value = grid[z, y, x]
                            low, high = min(low, value), max(high, value)
                a, b = low * bin_scale + bin_offset, high * bin_scale + bin_offset
                occupied[bz, by, bx] = visible_below[bin_of(b, bins) + 1] > visible_below[bin_of(a, bins)]
