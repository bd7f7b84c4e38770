"""The point image: what each pixel of the picture has hit, in which colour, and how it came by that."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: Status of a pixel, as the paper keeps it: -1 is missed, 0 filled by tracing. What reprojection filled keeps its own
#: marks, so that the maps can tell them apart.
MISSED, TRACED, REPROJECTED, INTERPOLATED = -1, 0, 1, 2

#: Height of what a ray meets that meets nothing: the background is infinitely far away.
BACKGROUND = -np.inf


@dataclass
class PointImage:
    """Points of a whole picture, in place of one per micro-image: lens by lens they are the paper's point images.

    Attributes
    ----------
    color:
        ``(H, W, 3)`` float32 linear RGB.
    z:
        ``(H, W)`` float32, height of the point over the lens plane in mm (positive toward the viewer);
        :data:`BACKGROUND` where nothing was hit. With the pixel's own light line this is the 3D point.
    fragile:
        ``(H, W)`` bool: the colour is not to be used elsewhere (a mirror, glass, a highlight).
    status:
        ``(H, W)`` int8, one of :data:`MISSED`, :data:`TRACED`, :data:`REPROJECTED`, :data:`INTERPOLATED`.
    """

    color: NDArray[np.float32]
    z: NDArray[np.float32]
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
