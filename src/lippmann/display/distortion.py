"""Distortion of a real lens: where under it a direction lies, against where a pinhole at the gap has it.

The two maps here are all that a program needs to know of a lens: the direction of a place is that of the pinhole's
place over the gap, and the place of a direction is found the other way round. They are tables; where they come from is
known to :mod:`lippmann.optics.directions`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lippmann.display.array_ops import Array, ArrayOps
from lippmann.display.validation import finite, positive
from lippmann.errors import DisplayError
from lippmann.runtime.engine_lock import cached_property


@dataclass(frozen=True)
class Distortion:
    """Places of a pinhole over those of a lens, at equal steps from the lens's axis.

    Parameters
    ----------
    reach:
        Distance of the last place from the axis in millimetres. Beyond it, the last factor holds.
    factors:
        The pinhole's place with the same direction, over the place, from the axis on: two or more.

    Raises
    ------
    DisplayError
        If the values are not above zero, or two places would have one direction.
    """

    reach: float
    factors: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "reach", positive(self.reach, "distortion.reach"))
        rule = "places and directions must grow together, by two factors or more"
        if not isinstance(self.factors, (list, tuple)):
            raise DisplayError(f"factors are {self.factors!r}", where="distortion.factors", rule=rule)
        factors = tuple(finite(factor, "distortion.factors") for factor in self.factors)
        if len(factors) < 2 or np.any(np.diff(self._steps(len(factors)) * factors) <= 0.0):
            raise DisplayError("factors are out of order", where="distortion.factors", rule=rule)
        object.__setattr__(self, "factors", factors)

    def pinhole_place(self, dx: Array, dy: Array, ops: ArrayOps) -> tuple[Array, Array]:
        """The pinhole's place of a place: offsets from the lens's axis in millimetres."""
        return _scale(dx, dy, self.reach, self.factors, ops)

    def place(self, dx: Array, dy: Array, ops: ArrayOps) -> tuple[Array, Array]:
        """The place of a pinhole's place, the inverse of :meth:`pinhole_place`."""
        return _scale(dx, dy, self.reach * self.factors[-1], self.inverse_factors, ops)

    @cached_property
    def inverse_factors(self) -> tuple[float, ...]:
        """Places over those of the pinhole, at equal steps of the pinhole's."""
        steps = self._steps(len(self.factors))
        pinhole = steps * self.factors
        at = steps[1:] * self.factors[-1]
        inverse = np.interp(at, pinhole, steps) / at
        return (1.0 / self.factors[0], *(float(factor) for factor in inverse))

    @staticmethod
    def _steps(count: int) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        return np.arange(count) / (count - 1)


def _scale(dx: Array, dy: Array, reach: float, factors: tuple[float, ...], ops: ArrayOps) -> tuple[Array, Array]:
    last = len(factors) - 1
    at = ops.minimum(ops.sqrt(dx * dx + dy * dy) * (last / reach), 1.0 * last)
    factor = ops.interpolate(factors, at)
    return dx * factor, dy * factor
