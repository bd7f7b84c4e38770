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

from lippmann.image import IntegralImage
from lippmann.quality.metrics import coded, psnr


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


def view_flicker(reference: IntegralImage, test: IntegralImage) -> Flicker | None:
    """The flicker of ``test`` against a reference of the same display; None if there is one view only.

    Neighbours are views side by side and, where there are rows of views, one above the other. Where lenses do not cover
    whole pixels the views are resampled (nearest pixel).
    """
    error = coded(reference) - coded(test)
    views, mask = test.with_pixels(error).views_and_mask()
    squared = own = 0.0
    pairs = 0
    for low, high in ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        both = mask[low] & mask[high]
        before, after = (views[part][both].astype(np.float64) for part in (low, high))
        squared += float(np.square(after - before).sum())
        own += 0.5 * float(np.square(before).sum() + np.square(after).sum())
        pairs += before.size
    return Flicker(squared / pairs, own / pairs) if pairs else None
