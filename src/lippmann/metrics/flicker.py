"""Flicker: how much the errors of a picture change from one view to the next.

An eye that moves in front of a display goes from view to view. An error that all views share is a blemish of the
scene; an error that differs from view to view flickers. With e = test - reference (coded values), flicker is the mean
of (e[k + 1] - e[k])^2 over all pairs of neighbouring views.

Independent errors give twice their mean squared error. Half of the flicker, in dB, is therefore on the scale of PSNR.
*Share* is that half divided by the mean squared error of the same pixels: 0 if all views have the same errors, 1 if the
errors of views are independent, 2 if those of neighbours are opposite.

Noise of the reference counts, too: the reference should be 10 dB better than the picture under test.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.metrics.mse_psnr import psnr

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Flicker:
    """``squared``: mean squared change of errors from view to view; ``error``: mean squared error of these pixels."""

    squared: float
    error: float

    @property
    def psnr(self) -> float:
        """Half the squared change in dB, which is the PSNR of independent errors; infinite without any change."""
        return psnr(0.5 * self.squared)

    @property
    def share(self) -> float:
        """Half the squared change over the squared error, 0 to 2; 0 without any error."""
        return 0.5 * self.squared / self.error if self.error else 0.0


class FlickerSums:
    """Sums for the flicker of views, which are added row by row with ``columns`` views each.

    Neighbours are views side by side and, if there are rows of views, one above the other.
    """

    def __init__(self, columns: int) -> None:
        self._columns = columns
        self._sums = np.zeros(2)
        self._values = 0
        self._last: list[tuple[Real, Flags]] = []
        self._count = 0

    def begin(self) -> None:
        """Start again with the first view, for other pixels."""
        self._last, self._count = [], 0

    def add(self, error: Real, present: Flags) -> None:
        """Add the next view: its errors ``(H, W, 3)``, and the mask ``(H, W)`` of its pixels."""
        if self._last and self._count % self._columns:
            self._pair(self._last[-1], (error, present))
        if len(self._last) == self._columns:
            self._pair(self._last.pop(0), (error, present))
        self._last.append((error, present))
        self._count += 1

    def _pair(self, before: tuple[Real, Flags], after: tuple[Real, Flags]) -> None:
        from lippmann.metrics import kernels

        self._values += kernels.add_changes(*before, *after, self._sums)

    def flicker(self) -> Flicker | None:
        """The flicker; None without neighbours."""
        if not self._values:
            return None
        squared, own = (float(total) / self._values for total in self._sums)
        return Flicker(squared, own)
