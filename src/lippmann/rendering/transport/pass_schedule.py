"""Samples of a pixel that come with photons or light vertices of their own."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PassSchedule:
    """Which samples of a pixel each pass of photons or light vertices serves.

    Parameters
    ----------
    first:
        Samples of a pixel that the first pass serves, at least 1.
    most:
        A later pass serves as many samples as all passes before it together, but at most so many; at least ``first``.
    """

    first: int
    most: int

    def samples(self, number: int) -> int:
        """Samples of a pixel that pass ``number`` serves, from 0 on."""
        return min(self.most, self.first << max(0, number - 1))

    def at(self, sample: int) -> tuple[int, int]:
        """The pass that serves ``sample``, from 0 on, and how many samples it still serves, this one included."""
        number, before, count = 0, 0, self.first
        while sample >= before + count and count < self.most:
            number, before = number + 1, before + count
            count = min(before, self.most)
        more, within = divmod(sample - before, count)
        return number + more, count - within
