"""Numbers of chains of sharp events that change as a picture's samples grow."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from lippmann.device.types import UInt32
from lippmann.rendering.transport.pass_schedule import PassSchedule


@dataclass(frozen=True)
class ChainPasses:
    """Chains of each path, by the sample of its pixel that it is.

    Parameters
    ----------
    schedule:
        Samples of one pixel that each pass serves.
    numbers:
        Chains of each pass; later ones have as many as the last.
    """

    schedule: PassSchedule
    numbers: tuple[int, ...]

    def of_pass(self, number: int) -> UInt32:
        """Chains of pass ``number``, from 0 on."""
        return dr.opaque(mi.UInt32, self.numbers[min(number, len(self.numbers) - 1)])
