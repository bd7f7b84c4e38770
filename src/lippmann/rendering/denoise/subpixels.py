"""Sub-pixels whose rays keep all three colours, for a picture that shows one of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.film.sample_batches import FullInBatches

if TYPE_CHECKING:
    from lippmann.rendering.transport.ray_source import SubpixelRays

Floats = NDArray[np.float32]


class SubpixelBatches(FullInBatches):
    """:class:`~lippmann.rendering.film.sample_batches.FullInBatches` over
    :class:`~lippmann.rendering.transport.ray_source.SubpixelRays`.

    What is traced has ``3 W`` columns; picture and errors are ``(H, W)`` pixels of sub-pixels that show their own
    colour.
    """

    _source: SubpixelRays

    def shown(self, values: Floats) -> Floats:
        """``(..., H, W, 3)`` from ``(..., H, 3 W, 3)``: the own colour of each sub-pixel."""
        return self._source.own_colors(values)
