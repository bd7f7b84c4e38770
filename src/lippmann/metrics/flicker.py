"""Flicker: how much a picture's errors change from one view to the next.

An eye that moves before a display goes from view to view. An error that all views share is a blemish of the scene; one
that differs from view to view flickers. So the errors of neighbouring views are compared: with e the difference between
test and reference (coded values), flicker is the mean of (e[k + 1] - e[k])^2 over all pairs of neighbouring views, that
is the mean squared difference of neighbouring views after what the reference's own neighbours differ by is taken away.

Errors that know nothing of each other give twice the mean squared error; so half of the flicker, in dB, is on the scale
of PSNR, and *share* is that half divided by the mean squared error of the same pixels: 0 where all views are wrong in
the same way, 1 where each is by itself, 2 where neighbours are wrong to opposite sides.

Noise of the reference counts like any other: it should be 10 dB better than what is judged.
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
        """Half the squared change in dB: for errors that know nothing of each other the PSNR; infinite without any."""
        return psnr(0.5 * self.squared)

    @property
    def share(self) -> float:
        """Of the error, the part that changes from view to view: 0 to 2; 0 without any error."""
        return 0.5 * self.squared / self.error if self.error else 0.0


class FlickerSums:
    """Sums for the flicker of views that come in the order of their rows, ``columns`` of them to a row.

    Neighbours are views side by side and, where there are rows of views, one above the other.
    """

    def __init__(self, columns: int) -> None:
        self._columns = columns
        self._sums = np.zeros(2)
        self._values = 0
        self._last: list[tuple[Real, Flags]] = []
        self._count = 0

    def begin(self) -> None:
        """The views begin anew, at other places."""
        self._last, self._count = [], 0

    def add(self, error: Real, found: Flags) -> None:
        """The next view's errors ``(H, W, 3)`` and where there are any ``(H, W)``."""
        if self._last and self._count % self._columns:
            self._pair(self._last[-1], (error, found))
        if len(self._last) == self._columns:
            self._pair(self._last.pop(0), (error, found))
        self._last.append((error, found))
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
