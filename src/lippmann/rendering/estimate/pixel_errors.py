"""Estimated squared error of every pixel, and its sums over the parts of a picture.

The PSNR of a picture (:mod:`lippmann.rendering.estimate.psnr`) follows from these sums alone, which add up over tiles.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
Floats = NDArray[np.float32]

#: Largest share of an error that is ascribed to the blur of caustics, which is known as an upper bound only
#: (:mod:`lippmann.rendering.film.caustic_blur`).
MOST_LESS = 0.9


@dataclass(frozen=True, eq=False)
class PixelErrors:
    """Estimates of the squared error of each pixel's code, averaged over its channels.

    Parameters
    ----------
    values:
        ``(H, W)`` float32, unbiased; single ones may be negative.
    outliers:
        ``(H, W)`` float32 >= 0: the part of ``values`` that rests on outliers; None without outliers.
    samples:
        Of a denoised picture: the errors of the samples that it was made of.
    apart:
        Of a denoised picture, ``(H, W)`` float32 >= 0: the variance, from the difference of its halves.
    blur:
        ``(H, W)`` float32: the squared blur of caustics, as an upper bound; None without photons. Single values may be
        negative.
    """

    values: Floats
    outliers: Floats | None = None
    samples: PixelErrors | None = None
    apart: Floats | None = None
    blur: Floats | None = None

    def part(self, inside: slice | tuple[slice, slice]) -> PixelErrors:
        """The errors of some pixels."""
        outliers, apart, blur = (
            None if values is None else values[inside] for values in (self.outliers, self.apart, self.blur)
        )
        samples = None if self.samples is None else self.samples.part(inside)
        return PixelErrors(self.values[inside], outliers, samples, apart, blur)


@dataclass(frozen=True, eq=False)
class ErrorSums:
    """Sums over the pixels of each part, ``(parts,)`` each.

    ``pixels``: their number; ``values``, ``outliers``, ``apart``, ``blur``: sums of the fields of
    :class:`PixelErrors`; ``squares``: sum of the squares of ``values``, less ``apart``, which has no uncertainty.
    """

    pixels: Real
    values: Real
    squares: Real
    outliers: Real
    apart: Real
    blur: Real

    @classmethod
    def none(cls, parts: int, pixels: NDArray[np.generic] | int = 0) -> ErrorSums:
        """Sums of 0 for so many parts, with ``pixels`` in each."""
        return cls(np.full(parts, pixels, dtype=np.float64), *np.zeros((len(fields(cls)) - 1, parts)))

    def add(self, owner: NDArray[np.integer], errors: PixelErrors) -> None:
        """Add the errors of some pixels to the parts that ``owner`` names; ``pixels`` stays as it is."""
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
        """Add the sums of other pixels, with their number; ``parts`` are the indices of their parts, each once."""
        for field in fields(self):
            getattr(self, field.name)[parts] += getattr(sums, field.name)

    def share_less(self, mean: float) -> float:
        """Largest share by which blur may overstate the ``mean`` error of all pixels."""
        return float(_share_less(self.blur.sum() / self.pixels.sum(), mean))

    def shares_less(self, means: Real) -> Real:
        """The same share for each part, whose mean errors are ``means``, ``(parts,)`` each."""
        return np.asarray(_share_less(self.blur / self.pixels, means))

    def _sum(self, owner: NDArray[np.integer], values: Real) -> Real:
        return np.asarray(np.bincount(owner, weights=values, minlength=len(self.pixels)), dtype=np.float64)


def _share_less(blur: Real | float, error: Real | float) -> Real | np.float64:
    share: Real | np.float64 = np.clip(blur / error, 0, MOST_LESS)
    return share


def parts_with_pixels(sums: ErrorSums) -> tuple[NDArray[np.intp], ErrorSums]:
    """The flat indices of the parts that have pixels, and their sums."""
    index = np.flatnonzero(sums.pixels)
    return index, ErrorSums(*(getattr(sums, field.name)[index] for field in fields(ErrorSums)))
