"""What of a built scene asks for more than the plain path loop, found once and looked up by integrators."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

Color = tuple[float, float, float]


@dataclass(frozen=True)
class SceneTraits:
    """Flags that switch parts of the path loop on.

    ``background`` is what camera rays see where nothing is hit (None: the environment itself); ``has_null`` says that
    some surface lets rays straight through; ``absorption`` is a table of coefficients per registry index of a shape
    (empty: no coloured glass).
    """

    background: Color | None = None
    has_null: bool = False
    absorption: Any = None

    @property
    def has_absorption(self) -> bool:
        return self.absorption is not None

    def absorption_of(self, shape: Any) -> Any:
        """Absorption per world unit inside ``shape`` (ShapePtr) as ``mi.Color3f``."""
        return dr.gather(mi.Color3f, self.absorption, dr.reinterpret_array(mi.UInt32, shape))


def make_traits(
    scene: Any, *, background: Color | None = None, has_null: bool = True, absorption: Mapping[int, Color] | None = None
) -> SceneTraits:
    """Traits of a ``mi.Scene``; ``absorption`` maps the position in ``scene.shapes()`` to coefficients per world unit.

    ``has_null`` may be True where it is not known: that costs time, but no truth.
    """
    if not absorption:
        return SceneTraits(background, has_null)
    pointers = dr.reinterpret_array(mi.UInt32, scene.shapes_dr())
    indices = [int(pointers[i]) for i in range(len(pointers))]
    table = [[0.0, 0.0, 0.0] for _ in range(max(indices) + 1)]
    for position, coefficients in absorption.items():
        table[indices[position]] = list(coefficients)
    columns = [mi.Float([row[c] for row in table]) for c in range(3)]
    return SceneTraits(background, has_null, mi.Color3f(*columns))
