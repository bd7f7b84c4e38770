"""Gaussian splats of a stage (UsdVol.ParticleField), where its prims place them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.readers.splats.activation import ask_memory, clean
from lippmann.scene.readers.usd.records import Record
from lippmann.scene.splat_clouds import move
from lippmann.scene.values.description import Matrix
from lippmann.scene.values.splats import COEFFICIENTS, FloatArray, Splats, join


@dataclass(eq=False)
class SplatReader:
    """Makes splats of records.

    Scales and opacities are plain numbers, and the coefficients of a particle lie side by side. Colours are those of
    the original method, sRGB codes, as the schema names it.
    """

    arrays: Sequence[NDArray[np.generic]]
    where: str
    notes: dict[str, None]
    placed: list[tuple[Splats, Matrix]] = field(default_factory=list)

    def add(self, record: Record, worlds: Matrix) -> None:
        """Take over one record at its places ``(k, 4, 4)``.

        Raises
        ------
        SceneError, MemoryLimitError
            Its numbers are not finite, its coefficients are of too high a degree; there is less memory.
        """
        degree = record["degree"]
        if not 0 <= degree < len(COEFFICIENTS):
            rule = f"degrees 0 to {len(COEFFICIENTS) - 1} are read"
            raise SceneError(f"{record['name']} has harmonics of degree {degree}", where=self.where, rule=rule)
        positions = self._array(record["positions"], np.zeros(3))
        count = len(positions)
        harmonics = self._array(record["harmonics"], np.zeros((count, 1, 3))).reshape(count, -1, 3)
        ask_memory(count * len(worlds), harmonics.shape[1], where=self.where)
        scales = np.abs(self._array(record["scales"], np.ones((count, 3))))
        splats, notes = clean(
            positions,
            scales * np.array([1.0, 1.0, 0.0], np.float32) if record["is_flat"] else scales,
            self._array(record["orientations"], np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))),
            self._array(record["opacities"], np.ones((count, 1)))[:, 0],
            harmonics,
            where=self.where,
        )
        self.notes.update(dict.fromkeys(f"{record['name']}: {note}" for note in notes))
        self.placed.extend((splats, world) for world in worlds)

    def join(self) -> Splats | None:
        """All of them in the world; None if there are none."""
        return join([move(splats, world) for splats, world in self.placed]) if self.placed else None

    def _array(self, number: int | None, default: NDArray[np.float64]) -> FloatArray:
        return np.asarray(default if number is None else self.arrays[number], np.float32)
