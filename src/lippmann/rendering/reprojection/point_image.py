"""The point image: what each pixel of the picture has hit, in which colour, and how it came by that."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

#: Arrays that compiled kernels take: numbers of pixels or lenses; disparities, weights, colours; masks.
IntArray: TypeAlias = NDArray[np.integer]
RealArray: TypeAlias = NDArray[np.floating]
BoolArray: TypeAlias = NDArray[np.bool_]

#: Status of a pixel, as the paper keeps it: -1 is missed, 0 filled. What was filled without tracing keeps marks of its
#: own, so that maps and counts can tell them apart.
MISSED, TRACED, REPROJECTED, INTERPOLATED = range(-1, 3)
#: Missed pixels that are about to be traced, and those that will be filled from such ones.
WANTED, BRIDGED = range(-2, -4, -1)

#: The layer of a picture that holds the status of its pixels.
STATUS_LAYER = "status"

#: Disparity of what a ray meets that meets nothing: infinitely far away, behind everything else. Not zero, because the
#: sign says on which side of the lens plane a point lies; and just as single precision keeps it, to be known again.
BACKGROUND = float(np.float32(-1e-30))


class PointImage(NamedTuple):
    """Points of a whole picture; the pixels of one micro-image are what the paper calls that lens's point image.

    A point is kept as its *disparity* g / z, the gap over its height: by that share of the lens pitch it moves within
    the micro-image from one lens to the next. With the pixel's own light line it is the 3D point. Positive: in front of
    the lens plane. Lines of sight are straight in it: along a plane surface, disparity is linear in the pixel.

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
        work is under way :data:`WANTED`.
    """

    color: NDArray[np.float32]
    disparity: NDArray[np.float32]
    fragile: NDArray[np.bool_]
    status: NDArray[np.int8]

    @classmethod
    def empty(cls, height: int, width: int) -> PointImage:
        """Nothing is known of any pixel."""
        return cls(
            np.zeros((height, width, 3), dtype=np.float32),
            np.full((height, width), BACKGROUND, dtype=np.float32),
            np.zeros((height, width), dtype=np.bool_),
            np.full((height, width), MISSED, dtype=np.int8),
        )

    def share(self, status: int) -> float:
        """Fraction of pixels of one status."""
        return float(np.count_nonzero(self.status == status)) / self.status.size
