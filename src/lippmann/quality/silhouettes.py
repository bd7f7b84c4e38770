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

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from lippmann.image import IntegralImage
from lippmann.image.permutation import Permutation
from lippmann.quality.metrics import coded

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
        limit = DEPTH_JUMP * image.display.lens_array.pitch
        marks = _between_neighbours(permutation, depth.astype(np.float64), lambda a, b: _is_apart(a, b, limit))
        return Silhouettes(marks, "depth")
    return Silhouettes(edges_between_neighbours(permutation, coded(image)), "edges")


class Cutting(Protocol):
    """What cuts ``(H, W, ...)`` values into micro-images ``(lens_rows, lens_cols, ny, nx, ...)`` and joins them."""

    @property
    def mask(self) -> Flags:
        """Which places of the micro-images hold a pixel."""
        ...

    def split(self, values: NDArray[Any]) -> NDArray[Any]:
        """The micro-images."""
        ...

    def join(self, micro_images: NDArray[Any]) -> NDArray[Any]:
        """The values again."""
        ...


def edges_between_neighbours(cutting: Cutting, colors: Real) -> Flags:
    """``(H, W)``: which pixels of coded ``(H, W, 3)`` differ strongly from a neighbour."""
    return _between_neighbours(cutting, colors, _is_edge)


def _between_neighbours(permutation: Cutting, values: Real, differ: Callable[[Real, Real], Flags]) -> Flags:
    """``(H, W)``: which pixels differ from a neighbour, along all four axes of the micro-images."""
    split, present = permutation.split(values), permutation.mask
    marks = np.zeros(present.shape, dtype=np.bool_)
    for axis, length in enumerate(present.shape):
        low = (slice(None),) * axis + (slice(0, length - 1),)
        high = (slice(None),) * axis + (slice(1, length),)
        both = present[low] & present[high] & differ(split[low], split[high])
        marks[low] |= both
        marks[high] |= both
    return permutation.join(marks)


def _is_apart(a: Real, b: Real, limit: float) -> Flags:
    seen_a, seen_b = np.isfinite(a), np.isfinite(b)
    step = np.abs(np.where(seen_a, a, 0.0) - np.where(seen_b, b, 0.0))
    apart: Flags = (seen_a != seen_b) | (seen_a & seen_b & (step > limit))
    return apart


def _is_edge(a: Real, b: Real) -> Flags:
    return np.asarray((np.abs(a - b) > EDGE_JUMP).any(axis=-1))
