"""Points of a stage, and its basis curves as chains of straight pieces (UsdGeomPoints, UsdGeomBasisCurves)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Pieces of a cubic segment; fewer where all curves would have more than are drawn.
_PIECES = 8
#: What powers 0 to 3 of a segment's parameter give to its four points, a row each.
_WEIGHTS = {
    "bezier": np.array([[1, 0, 0, 0], [-3, 3, 0, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 1.0,
    "bspline": np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6.0,
    "catmullRom": np.array([[0, 2, 0, 0], [-1, 0, 1, 0], [2, -5, 4, -1], [-1, 3, -3, 1]]) / 2.0,
}


@dataclass(frozen=True)
class Points:
    """So many points, each by itself."""

    count: int

    def pieces(self, most: int) -> int:
        """1: a point is not cut."""
        return 1

    def elements(self, pieces: int) -> Integers:
        """All points ``(n, 1)``."""
        return np.arange(self.count)[:, None]

    def sample(self, values: Floats, interpolation: str, pieces: int) -> Floats | None:
        """Values ``(n, c)``, or one for all; None where there are too few or too many."""
        return values if len(values) in (1, self.count) else None


@dataclass(frozen=True, eq=False)
class Curves:
    """Curves of ``counts`` ``(k,)`` vertices each, linear or of a cubic ``basis``; ``wrap`` as USD names it."""

    counts: Integers
    basis: str
    wrap: str

    @property
    def _step(self) -> int:
        return 3 if self.basis == "bezier" else 1

    @property
    def segments(self) -> Integers:
        """Segments ``(k,)`` of each curve; 0 of one that has too few vertices."""
        around = self.wrap == "periodic"
        if self.basis == "linear":
            segments = self.counts if around else self.counts - 1
        elif around:
            segments = self.counts // self._step
        elif self.wrap == "pinned" and self._step == 1:
            segments = self.counts - 1
        else:
            segments = (self.counts - 4) // self._step + 1
        least = 2 if self.basis == "linear" else {"pinned": 2, "periodic": 3}.get(self.wrap, 4)
        return np.where(self.counts >= least, segments, 0)

    def pieces(self, most: int) -> int:
        """Straight pieces of each segment, if there are to be at most about ``most`` in all."""
        return 1 if self.basis == "linear" else min(max(most // max(int(self.segments.sum()), 1), 1), _PIECES)

    def elements(self, pieces: int) -> Integers:
        """Straight pieces ``(m, 2)`` between points, which lie as :meth:`sample` has them."""
        points = np.where(self.segments > 0, self.segments * pieces + 1, 0)
        last = np.zeros(int(points.sum()), bool)
        last[np.cumsum(points[points > 0]) - 1] = True
        first = np.flatnonzero(~last)
        return np.stack([first, first + 1], axis=1)

    def sample(self, values: Floats, interpolation: str, pieces: int) -> Floats | None:
        """Values ``(n, c)`` at the points of all pieces, or one for all; None where there are too few or too many."""
        segments = self.segments
        points = np.where(segments > 0, segments * pieces + 1, 0)
        if interpolation == "constant" or len(values) == 1:  # a width alone often stands without that word
            return values[:1] if len(values) else None
        if interpolation == "uniform":
            return np.repeat(values, points, axis=0) if len(values) == len(self.counts) else None
        if interpolation == "vertex" or self.basis == "linear":
            needed, at = self.counts, self._at_vertices
        else:
            needed, at = segments + int(self.wrap != "periodic"), self._interpolate
        if len(values) != needed.sum():
            return None
        return self._by_length(values, needed, points, pieces, at)

    def _by_length(
        self, values: Floats, needed: Integers, points: Integers, pieces: int, at: Callable[[Floats, int], Floats]
    ) -> Floats:
        """Sample all curves by ``at``, in one call for those that have the same number of vertices."""
        sampled = np.empty((int(points.sum()), values.shape[1]))
        first, begin = np.cumsum(needed) - needed, np.cumsum(points) - points
        for count in np.unique(self.counts[points > 0]):
            chosen = np.flatnonzero((self.counts == count) & (points > 0))
            own = values[first[chosen, None] + np.arange(needed[chosen[0]])]
            sampled[begin[chosen, None] + np.arange(points[chosen[0]])] = at(own, pieces)
        return sampled

    def _at_vertices(self, own: Floats, pieces: int) -> Floats:
        """Values ``(k, p, c)`` at points, of those ``(k, n, c)`` at vertices, by the basis."""
        if self.basis == "linear":
            return self._interpolate(own, pieces)
        if self.wrap == "periodic":
            own = np.concatenate([own, own[:, : 1 if self._step == 3 else 3]], axis=1)
        elif self.wrap == "pinned" and self._step == 1:  # beyond its ends a curve goes on as it ends
            ends = 2.0 * own[:, [0]] - own[:, [1]], 2.0 * own[:, [-1]] - own[:, [-2]]
            own = np.concatenate([ends[0], own, ends[1]], axis=1)
        starts = np.arange(0, own.shape[1] - 3, self._step)
        powers = (np.arange(pieces + 1) / pieces)[:, None] ** np.arange(4)
        four = own[:, starts[:, None] + np.arange(4)]
        each = np.einsum("pi,ksic->kspc", powers @ _WEIGHTS[self.basis], four)
        return np.concatenate([each[:, :, :-1].reshape(len(own), -1, own.shape[2]), each[:, -1, -1:]], axis=1)

    def _interpolate(self, own: Floats, pieces: int) -> Floats:
        """Values ``(k, p, c)`` at points, of those at the ends of segments."""
        if self.wrap == "periodic":
            own = np.concatenate([own, own[:, :1]], axis=1)
        share = (np.arange(pieces) / pieces)[:, None]
        each = own[:, :-1, None] * (1.0 - share) + own[:, 1:, None] * share
        return np.concatenate([each.reshape(len(own), -1, own.shape[2]), own[:, -1:]], axis=1)
