"""How much of each pixel surfaces cover, as its samples show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Coverage:
    """Share of a pixel's samples whose primary ray meets a surface; what the others see is behind all surfaces.

    Attributes
    ----------
    share:
        ``(H, W, C)`` float32 in [0, 1]; C is 3 where each sub-pixel has rays of its own, else 1.
    samples:
        Of each pixel.
    """

    share: NDArray[np.float32]
    samples: int

    def __add__(self, other: Coverage) -> Coverage:
        """By the samples of both."""
        samples = self.samples + other.samples
        hits = self.samples * self.share + other.samples * other.share
        return Coverage((hits / max(1, samples)).astype(np.float32), samples)
