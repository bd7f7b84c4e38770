"""Silhouettes: the pixels of an integral image that lie at outlines.

At an outline a tiny shift decides which of two surfaces a ray meets. Two correct renderings may differ there as much as
a correct and a wrong one, so metrics *off silhouettes* leave these pixels out.

A pixel lies on a silhouette if it and one of its neighbours see different things; both of the pair are marked. The
neighbours of a pixel are the pixels to the left, right, top and bottom in the same micro-image (neighbouring
directions), and the pixels at the same place of the neighbouring micro-images (neighbouring points of one view).

- If the reference has a layer ``depth`` (height of the visible point over the lens plane in mm; not finite where there
  is none), two pixels see different things if their heights differ by more than :data:`DEPTH_JUMP` lens pitches, or if
  only one of them is finite. From lens to lens this is a surface turned away by more than 63 degrees.
- Otherwise two pixels see different things if a coded channel differs by more than :data:`EDGE_JUMP`. Such an edge is
  an outline, a shadow or a texture.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.image import Picture
from lippmann.image.stored_values import Layer
from lippmann.metrics.bands import Band, bands
from lippmann.metrics.mse_psnr import encode_rows

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]
Source = Literal["depth", "edges"]

#: The layer that holds the height of what each pixel sees.
DEPTH_LAYER = "depth"

#: Difference of height between neighbours that is an outline, in lens pitches.
DEPTH_JUMP = 2.0

#: Difference of a coded channel (0 to 1) between neighbours that is a strong edge.
EDGE_JUMP = 0.1


@dataclass(frozen=True)
class SilhouetteShare:
    """``share``: fraction of pixels on silhouettes, 0 to 1; ``source``: found by depths or by the picture's edges."""

    share: float
    source: Source


@dataclass(frozen=True, eq=False)
class Silhouettes:
    """``mask`` ``(H, W)``: pixels on silhouettes; ``source``: whether found in depths or in the picture's edges."""

    mask: Flags
    source: Source

    @property
    def share(self) -> float:
        """Fraction of the pixels on silhouettes, 0 to 1."""
        return float(self.mask.mean())


def find_silhouettes(image: Picture) -> Silhouettes:
    """The silhouettes of a picture, by its layer ``depth`` if it has one, else by its strong edges."""
    panel, depth = image.display.panel, depth_of(image)
    mask = np.empty((panel.height, panel.width), dtype=np.bool_)
    for band in bands(image.display):
        mask[band.first : band.last] = mark_silhouettes(band, encode_rows(image, (band.top, band.bottom)), depth)
    return Silhouettes(mask, source_of(depth))


def depth_of(image: Picture) -> Layer | None:
    """Layer ``(H, W)`` of the depths that decide on a picture's silhouettes; None if its edges do."""
    depth = image.maps.get(DEPTH_LAYER)
    return depth if depth is not None and depth.ndim == 2 else None


def source_of(depth: Layer | None) -> Source:
    """How silhouettes are found with this layer of depths."""
    return "edges" if depth is None else "depth"


def mark_silhouettes(band: Band, colors: Real, depth: Layer | None) -> Flags:
    """Mask ``(rows, W)`` of the pixels on silhouettes in a band's own rows.

    Parameters
    ----------
    band:
        The band.
    colors:
        ``(bottom - top, W, 3)``: coded values of the band's rows and their neighbours.
    depth:
        ``(H, W)``: depths of the whole panel, see :func:`depth_of`. None: edges are looked for.
    """
    from lippmann.metrics import kernels

    if depth is None:
        values, limit = colors, EDGE_JUMP
    else:
        rows = depth[band.top : band.bottom]
        values = np.where(np.isfinite(rows), rows, np.nan).astype(np.float64)[..., None]
        limit = DEPTH_JUMP * band.display.lens_array.pitch
    shape = values.shape[:2]
    numbers = np.arange(1, math.prod(shape) + 1, dtype=np.int32).reshape(shape)
    marks = np.zeros(shape, dtype=np.bool_)
    flat = np.ascontiguousarray(values).reshape(-1, values.shape[2])
    kernels.mark_jumps(flat, band.split(numbers), limit, marks.reshape(-1))
    return marks[band.inner]
