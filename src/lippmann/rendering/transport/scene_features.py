"""Features of a built scene that the plain path loop does not handle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from lippmann.device.types import Color3f, MitsubaScene, ShapePtr

Color = tuple[float, float, float]


@dataclass(frozen=True)
class SceneFeatures:
    """Features that switch parts of the path loop on.

    Attributes
    ----------
    background:
        Linear RGB that camera rays see where nothing is hit; None for the environment itself.
    has_null:
        Whether some surface lets rays straight through.
    absorption:
        ``mi.Color3f`` of absorption coefficients per world unit, indexed by a shape's place in Dr.Jit's registry; None
        where no shape absorbs.
    """

    background: Color | None = None
    has_null: bool = False
    absorption: Color3f | None = None

    def absorption_of(self, shape: ShapePtr) -> Color3f:
        """Absorption coefficients per world unit inside ``shape``."""
        return dr.gather(mi.Color3f, self.absorption, dr.reinterpret_array(mi.UInt32, shape))


def make_scene_features(
    scene: MitsubaScene,
    *,
    background: Color | None = None,
    has_null: bool = True,
    absorption: Mapping[int, Color] | None = None,
) -> SceneFeatures:
    """The features of a scene, its absorption uploaded to the device.

    Parameters
    ----------
    scene:
        The scene.
    background:
        Linear RGB that camera rays see where nothing is hit; by default the environment itself.
    has_null:
        Whether some surface lets rays straight through. True is always correct, but slower.
    absorption:
        Absorption coefficients per world unit, by the index of a shape in ``scene.shapes()``.
    """
    if not absorption:
        return SceneFeatures(background, has_null)
    pointers = dr.reinterpret_array(mi.UInt32, scene.shapes_dr())
    indices = [int(pointers[i]) for i in range(len(pointers))]
    table = [[0.0, 0.0, 0.0] for _ in range(max(indices) + 1)]
    for position, coefficients in absorption.items():
        table[indices[position]] = list(coefficients)
    columns = [mi.Float([row[c] for row in table]) for c in range(3)]
    return SceneFeatures(background, has_null, mi.Color3f(*columns))
