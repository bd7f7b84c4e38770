"""Coordinates far from the origin, as surveys have them (UTM): single precision, that of scenes, rounds them.

At five million metres it tells half a metre.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.values.description import SceneDescription

#: So many times its extent from the origin, a scene is moved there: single precision tells 6e-5 of the extent.
FAR = 1000.0

#: Points that are looked at.
_SAMPLE = 1 << 16


def near_origin(positions: NDArray[np.float64], notes: list[str]) -> NDArray[np.float64]:
    """Positions ``(n, 3)``, moved to the origin where they lie far from it.

    The extent is that of nine in ten points, so that a few strays do not count. ``notes`` gets a line on the move.
    """
    sample = positions[:: len(positions) // _SAMPLE + 1]
    sample = sample[np.isfinite(sample).all(axis=1)]
    if not len(sample):
        return positions
    middle = np.median(sample, axis=0)
    extent = np.percentile(np.abs(sample - middle).max(axis=1), 90)
    offset = _far_offset(middle, extent)
    if offset is None:
        return positions
    notes.append(_note(offset))
    return positions - offset


def moved_near_origin(description: SceneDescription) -> SceneDescription:
    """A scene of meshes with its cameras and lights, moved to the origin where placements put it far away; with a note.

    As buildings and terrains have it, whose meshes lie about their own origin.
    """
    return moved_back(description, placed_offset(description))


def placed_offset(description: SceneDescription) -> NDArray[np.float64] | None:
    """Where a scene of meshes lies that its placements put far from the origin; None of others."""
    if description.splats is not None or description.volume is not None:
        return None
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for number, worlds in description.fitted_placements.items():
        positions = description.meshes[number].positions
        if len(positions) and len(worlds):
            least, most = (np.asarray(ends, np.float64) for ends in (positions.min(axis=0), positions.max(axis=0)))
            middles = worlds[:, :3, :3] @ ((least + most) / 2.0) + worlds[:, :3, 3]
            halves = np.abs(worlds[:, :3, :3]) @ ((most - least) / 2.0)
            low = np.minimum(low, (middles - halves).min(axis=0))
            high = np.maximum(high, (middles + halves).max(axis=0))
    return _far_offset((low + high) / 2, (high - low).max() / 2)


def moved_back(description: SceneDescription, offset: NDArray[np.float64] | None) -> SceneDescription:
    """A scene with its cameras and lights, moved by an offset the other way, with a note; as it is without one."""
    if offset is None:
        return description
    move = np.eye(4)
    move[:3, 3] = -offset
    return replace(
        description,
        instances=[replace(each, world_from_mesh=move @ each.world_from_mesh) for each in description.instances],
        cameras=[replace(each, world_from_camera=move @ each.world_from_camera) for each in description.cameras],
        lights=[replace(each, world_from_light=move @ each.world_from_light) for each in description.lights],
        notes=[*description.notes, _note(offset)],
    )


def _far_offset(middle: NDArray[np.float64], extent: float) -> NDArray[np.float64] | None:
    """``middle``, in whole units where ``extent`` is larger than one; None where it is not far from the origin."""
    if not 0 < FAR * extent < np.abs(middle).max():
        return None
    return np.round(middle) if extent > 1 else middle


def _note(offset: NDArray[np.float64]) -> str:
    x, y, z = -offset
    return f"moved by {x:.12g}, {y:.12g}, {z:.12g}: so far from the origin its shape would be rounded"
