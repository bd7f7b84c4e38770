"""Where the outlines of things run through an integral image.

At an outline a hair's breadth decides which of two surfaces a ray meets, so two right renderings may differ there as
much as two wrong ones; figures *off silhouettes* leave such pixels out.

A pixel lies on a silhouette if it and a neighbour of it see different things. Neighbours are the pixels to the left,
right, top and bottom in the same micro-image (neighbouring directions), and the pixels at the same place of the
neighbouring micro-images (neighbouring points of one view); both of a pair are marked. Two pixels see different things

- if the reference has a layer ``depth`` (height of the point seen over the lens plane in mm; not finite where nothing
  is seen): if their heights differ by more than :data:`DEPTH_JUMP` lens pitches, or only one sees something. From lens
  to lens that is a surface turned away by more than 63 degrees;
- else, if a coded channel differs by more than :data:`EDGE_JUMP`: an edge of the picture, be it an outline, a shadow or
  a texture.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from lippmann.image import IntegralImage
from lippmann.image.micro_images import Permutation
from lippmann.metrics.mse_psnr import coded

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: The layer that holds the height of what each pixel sees.
DEPTH_LAYER = "depth"

#: Difference of height between neighbours that is an outline, in lens pitches.
DEPTH_JUMP = 2.0

#: Difference of a coded channel (0 to 1) between neighbours that is a strong edge.
EDGE_JUMP = 0.1


@dataclass(frozen=True, eq=False)
class Silhouettes:
    """``mask`` ``(H, W)``: pixels on silhouettes; ``source``: whether found in depths or in the picture's edges."""

    mask: Flags
    source: Literal["depth", "edges"]

    @property
    def share(self) -> float:
        """The part of the pixels that lies on silhouettes."""
        return float(self.mask.mean())


def find_silhouettes(image: IntegralImage) -> Silhouettes:
    """The silhouettes of a picture, by its layer ``depth`` if it has one, else by its strong edges."""
    permutation = Permutation(image.display)
    depth = image.maps.get(DEPTH_LAYER)
    if depth is not None and depth.ndim == 2:
        seen = np.where(np.isfinite(depth), depth, np.nan).astype(np.float64)
        limit = DEPTH_JUMP * image.display.lens_array.pitch
        return Silhouettes(_jumps_between_neighbours(permutation, seen[..., None], limit), "depth")
    return Silhouettes(edges_between_neighbours(permutation, coded(image)), "edges")


class Cutting(Protocol):
    """What cuts ``(H, W, ...)`` values into micro-images ``(lens_rows, lens_cols, ny, nx, ...)``."""

    def split(self, values: NDArray[Any]) -> NDArray[Any]:
        """The micro-images; places without a pixel are zero."""
        ...


def edges_between_neighbours(cutting: Cutting, colors: Real) -> Flags:
    """``(H, W)``: which pixels of coded ``(H, W, 3)`` differ strongly from a neighbour."""
    return _jumps_between_neighbours(cutting, colors, EDGE_JUMP)


def _jumps_between_neighbours(cutting: Cutting, values: Real, limit: float) -> Flags:
    """``(H, W)``: which pixels of ``(H, W, channels)`` differ from a neighbour by more, see :func:`.mark_jumps`."""
    from lippmann.metrics import kernels

    shape = values.shape[:2]
    numbers = np.arange(1, math.prod(shape) + 1, dtype=np.int32).reshape(shape)
    marks = np.zeros(shape, dtype=np.bool_)
    flat = np.ascontiguousarray(values).reshape(-1, values.shape[2])
    kernels.mark_jumps(flat, np.ascontiguousarray(cutting.split(numbers)), limit, marks.reshape(-1))
    return marks
