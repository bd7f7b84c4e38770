"""Whether two ways to the same picture agree, block by block and as a whole."""

from __future__ import annotations

import numpy as np

#: Pixels to the side of a picture, and of a block in it.
SIDE, BLOCK = 24, 4


def agree(plain, other):
    """Blocks of pixels, and whole pictures, agree by the scatter of pictures of independent seeds."""
    blocks = [p.reshape(len(p), SIDE // BLOCK, BLOCK, SIDE // BLOCK, BLOCK, 3).mean((2, 4)) for p in (plain, other)]
    for parts, most in ((blocks, 5), ([p.mean(axis=(1, 2)) for p in (plain, other)], 4)):
        error = np.sqrt(sum(part.var(axis=0, ddof=1) / len(part) for part in parts))
        apart = np.abs(parts[0].mean(axis=0) - parts[1].mean(axis=0))
        np.testing.assert_array_less(apart, most * error + 1e-4)
