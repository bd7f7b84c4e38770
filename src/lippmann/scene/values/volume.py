"""Volumes as plain values: a grid of numbers in the world, and the transfer function that shows them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

#: Kinds of numbers that a grid may hold.
STORED = (np.uint8, np.int16, np.uint16, np.float32)

#: Length over which opacities count: a millimetre of the scene, or a hundredth of the grid's longest side.
Per = Literal["mm", "percent"]


@dataclass(frozen=True, eq=False)
class TransferFunction:
    """Colour and opacity of values: linear between points, constant beyond them.

    Attributes
    ----------
    values:
        ``(n,)`` float64, increasing, n at least 2.
    colors:
        ``(n, 3)`` linear RGB in [0, 1].
    opacities:
        ``(n,)`` in [0, 1): the share of light that is absorbed over the length that ``per`` says.
    per:
        See :data:`Per`.
    shading:
        From 0 (a volume glows evenly) to 1 (its surfaces are lit from where the viewer is).
    name:
        Name of the preset, or of the file.
    """

    values: Numbers
    colors: Numbers
    opacities: Numbers
    per: Per = "mm"
    shading: float = 1.0
    name: str = ""


@dataclass(frozen=True, eq=False)
class Volume:
    """A grid of values in the world.

    Attributes
    ----------
    grid:
        ``(nz, ny, nx)``, contiguous, of a kind of :data:`STORED`.
    world_from_voxel:
        ``(4, 4)``: takes ``(x, y, z)``, counted in voxels from the middle of the first, to the world.
    transfer:
        How values are shown.
    slope, intercept:
        A value is ``slope`` times the stored number, plus ``intercept``; ``slope`` is above 0.
    """

    grid: NDArray[np.generic]
    world_from_voxel: Numbers
    transfer: TransferFunction
    slope: float = 1.0
    intercept: float = 0.0

    @property
    def size(self) -> tuple[int, int, int]:
        """Voxels along x, y and z."""
        depth, height, width = self.grid.shape
        return width, height, depth

    @property
    def spacing(self) -> Numbers:
        """``(3,)``: distance of neighbouring voxels along x, y and z, world units."""
        lengths: Numbers = np.linalg.norm(self.world_from_voxel[:3, :3], axis=0)
        return lengths

    @property
    def longest_side(self) -> float:
        """The longest side of the grid, world units."""
        return float((self.spacing * self.size).max())
