"""A plain picture, not for a display: what a camera or an eye sees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.png import encode_png
from lippmann.color.transfer import quantize
from lippmann.image.metadata import Provenance


@dataclass(frozen=True, eq=False)
class Preview:
    """A plain picture: ``pixels`` ``(height, width, 3)`` float32 linear RGB, with how it was made."""

    pixels: NDArray[np.float32]
    provenance: Provenance

    def __repr__(self) -> str:
        return f"<Preview {self.pixels.shape[1]} x {self.pixels.shape[0]} pixels>"

    def _repr_png_(self) -> bytes:
        """The picture as PNG, for notebooks."""
        transfer = self.provenance.transfer
        return encode_png(quantize(self.pixels, 8, transfer), text={}, srgb=transfer == "srgb")
