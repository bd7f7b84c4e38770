"""The point image: colour, depth, fragility and status of each pixel of the picture."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

#: Arrays that compiled kernels take: numbers of pixels or lenses; disparities, weights, colours; masks.
IntArray: TypeAlias = NDArray[np.integer]
RealArray: TypeAlias = NDArray[np.floating]
BoolArray: TypeAlias = NDArray[np.bool_]

#: Status of a pixel: -1 missed and 0 filled, as in the paper; pixels filled without tracing have numbers of their own.
MISSED, TRACED, REPROJECTED, INTERPOLATED = range(-1, 3)
#: Missed pixels that are queued for tracing, and those that will be interpolated between them.
QUEUED, BRIDGED = range(-2, -4, -1)

#: The layer of a picture that holds the status of its pixels.
STATUS_LAYER = "status"

#: Disparity of background: infinitely far behind the lens plane. Not 0, as its sign gives the side of the lens plane;
#: and exact in single precision, so that it can be compared.
BACKGROUND = float(np.float32(-1e-30))


class PointImage(NamedTuple):
    """Points of a whole picture; the pixels of one micro-image are what the paper calls that lens's point image.

    A point is stored as its *disparity* g / z (gap over height), positive in front of the lens plane. From one lens to
    the next it moves within the micro-image by that fraction of the lens pitch. Disparity and the pixel's light line
    give the 3D point. Along a plane, disparity is linear in the pixel.

    Attributes
    ----------
    color:
        ``(H, W, 3)`` float32 linear RGB.
    disparity:
        ``(H, W)`` float32; :data:`BACKGROUND` where nothing was hit.
    fragile:
        ``(H, W)`` bool: the colour depends on where it is seen from (a mirror, glass, a highlight), or the pixel
        shows several surfaces.
    status:
        ``(H, W)`` int8, one of :data:`MISSED`, :data:`TRACED`, :data:`REPROJECTED`, :data:`INTERPOLATED`, or while
        work is under way :data:`QUEUED`.
    """

    color: NDArray[np.float32]
    disparity: NDArray[np.float32]
    fragile: NDArray[np.bool_]
    status: NDArray[np.int8]

    @classmethod
    def empty(cls, height: int, width: int) -> PointImage:
        """A point image whose pixels are all missed."""
        return cls(
            np.zeros((height, width, 3), dtype=np.float32),
            np.full((height, width), BACKGROUND, dtype=np.float32),
            np.zeros((height, width), dtype=np.bool_),
            np.full((height, width), MISSED, dtype=np.int8),
        )

    def share(self, status: int) -> float:
        """Fraction of pixels of one status."""
        return float(np.count_nonzero(self.status == status)) / self.status.size
