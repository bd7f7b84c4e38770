"""Estimates of the squared error of every pixel, and their sums over the parts of a picture.

What is said of a picture (:mod:`lippmann.rendering.estimate.psnr`) follows from such sums alone. They add up over
tiles.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
Floats = NDArray[np.float32]

#: The largest share of an error that is left out as blur of caustics that may be less than stated, see
#: :mod:`lippmann.rendering.film.caustic_blur`.
MOST_LESS = 0.9


@dataclass(frozen=True, eq=False)
class PixelErrors:
    """Estimates of the squared error of each pixel's code, averaged over its channels.

    Parameters
    ----------
    values:
        ``(H, W)`` float32, unbiased; single ones may be negative.
    outliers:
        ``(H, W)`` float32 of at least 0: the part of ``values`` that rests on outliers; None if there is no
        such thing. Of a denoised picture it is a part of ``apart``.
    samples:
        Of a denoised picture: the errors of the samples that it was made of.
    apart:
        Of a denoised picture, ``(H, W)`` float32 of at least 0: the part of ``values`` that is no estimate, which is
        what its halves differ by.
    blur:
        ``(H, W)`` float32: the part of ``values`` that is blur of caustics, as an upper bound; None if there is no such
        thing. Single ones may be negative.
    """

    values: Floats
    outliers: Floats | None = None
    samples: PixelErrors | None = None
    apart: Floats | None = None
    blur: Floats | None = None

    def part(self, inside: slice | tuple[slice, slice]) -> PixelErrors:
        """Those of some pixels."""
        outliers, apart, blur = (
            None if values is None else values[inside] for values in (self.outliers, self.apart, self.blur)
        )
        samples = None if self.samples is None else self.samples.part(inside)
        return PixelErrors(self.values[inside], outliers, samples, apart, blur)


@dataclass(frozen=True, eq=False)
class ErrorSums:
    """Sums over the pixels of each part, ``(parts,)`` each: their number, their estimates, the squares of what is
    uncertain of those, what rests on outliers, what halves differ by, and blur."""

    pixels: Real
    values: Real
    squares: Real
    outliers: Real
    apart: Real
    blur: Real

    @classmethod
    def none(cls, parts: int, pixels: NDArray[np.generic] | int = 0) -> ErrorSums:
        """Sums of so many parts to which nothing was added yet, with ``pixels`` in each."""
        return cls(np.full(parts, pixels, dtype=np.float64), *np.zeros((len(fields(cls)) - 1, parts)))

    def add(self, owner: NDArray[np.integer], errors: PixelErrors) -> None:
        """Add the estimates of some pixels, any shape, to the parts that ``owner`` names; not to their number."""
        owner = owner.ravel()
        uncertain = values = errors.values.astype(np.float64).ravel()
        self.values[:] += self._sum(owner, values)
        if errors.outliers is not None:
            self.outliers[:] += self._sum(owner, errors.outliers.astype(np.float64).ravel())
        if errors.apart is not None:
            apart = errors.apart.astype(np.float64).ravel()
            self.apart[:] += self._sum(owner, apart)
            uncertain = uncertain - apart
        if errors.blur is not None:
            self.blur[:] += self._sum(owner, errors.blur.astype(np.float64).ravel())
        self.squares[:] += self._sum(owner, np.square(uncertain))

    def add_sums(self, parts: NDArray[np.generic], sums: ErrorSums) -> None:
        """Add sums of the parts with these numbers, each at most once; their numbers of pixels, too."""
        for field in fields(self):
            getattr(self, field.name)[parts] += getattr(sums, field.name)

    def share_less(self, mean: float) -> float:
        """By what share of a ``mean`` over all pixels that may be less at the most."""
        return float(_share_less(self.blur.sum() / self.pixels.sum(), mean))

    def shares_less(self) -> Real:
        """``(parts,)``: the same of each part's own sum."""
        return np.asarray(_share_less(self.blur, np.maximum(self.values, self.blur + 1e-30)))

    def _sum(self, owner: NDArray[np.integer], values: Real) -> Real:
        return np.asarray(np.bincount(owner, weights=values, minlength=len(self.pixels)), dtype=np.float64)


def _share_less(blur: Real | float, error: Real | float) -> Real | np.float64:
    share: Real | np.float64 = np.clip(blur / error, 0, MOST_LESS)
    return share


def parts_with_pixels(sums: ErrorSums) -> tuple[NDArray[np.intp], ErrorSums]:
    """The flat indices of the parts that have pixels, and their sums."""
    index = np.flatnonzero(sums.pixels)
    return index, ErrorSums(*(getattr(sums, field.name)[index] for field in fields(ErrorSums)))
