"""Coordinates that single precision, that of scenes, rounds: far from the origin, as surveys have them (UTM), or tiny.

At five million metres it tells half a metre. Rays leave a surface by 9e-5 units (Mitsuba's ``spawn_ray``), however
small the scene is.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.values.description import FloatArray, Matrix, SceneDescription

#: So many times its extent from the origin, a scene is moved there: single precision tells 6e-5 of the extent.
FAR = 1000.0

#: Half the longest side of scenes that are traced as they are: below, rays leave surfaces by more than a pixel of large
#: displays; above, products of lengths overflow. A picture of three boxes is that of the same boxes scaled to within
#: 64 dB at the smallest, 60 at half of it, 70 at double; the same at half, once and twice the largest, not at 1e10.
_SMALLEST, _LARGEST = 0.1, 1e8

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


def make_traceable(description: SceneDescription) -> SceneDescription:
    """A scene of meshes with its cameras and lights, brought to coordinates that single precision traces; with a note.

    Placements put buildings and terrains far away, whose meshes lie about their own origin; units make scenes tiny.
    """
    return move_and_scale(description, traceable_from_world(description))


def box_of_copies(positions: FloatArray, worlds: Matrix) -> tuple[Matrix, Matrix]:
    """Corners ``(3,)`` of a box about the boxes of ``positions (n, 3)`` at all places ``worlds (k, 4, 4)``."""
    least, most = (np.asarray(ends, np.float64) for ends in (positions.min(axis=0), positions.max(axis=0)))
    middles = worlds[:, :3, :3] @ ((least + most) / 2.0) + worlds[:, :3, 3]
    halves = np.abs(worlds[:, :3, :3]) @ ((most - least) / 2.0)
    return (middles - halves).min(axis=0), (middles + halves).max(axis=0)


def traceable_from_world(description: SceneDescription) -> Matrix | None:
    """The similarity (4x4) of a scene of meshes that is far from the origin, tiny or huge; None of others."""
    if description.splats is not None or description.volume is not None:
        return None
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for number, worlds in description.fitted_placements.items():
        positions = description.meshes[number].positions
        if len(positions) and len(worlds):
            least, most = box_of_copies(positions, worlds)
            low, high = np.minimum(low, least), np.maximum(high, most)
    extent = float((high - low).max() / 2)
    offset = _far_offset((low + high) / 2, extent)
    is_sound = not 0 < extent < np.inf or _SMALLEST <= extent <= _LARGEST
    if offset is None and is_sound:
        return None
    scale = 1.0 if is_sound else 10.0 ** math.ceil(-math.log10(extent))
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = 0.0 if offset is None else -scale * offset
    return matrix


def move_and_scale(description: SceneDescription, matrix: Matrix | None) -> SceneDescription:
    """A scene with its cameras and lights, moved and scaled by a matrix (4x4), with notes; as it is without one.

    Lengths and the power of light sources follow, so that the picture stays.
    """
    if matrix is None:
        return description
    scale = matrix[0, 0]

    def moved(pose: Matrix) -> Matrix:
        move = matrix @ np.asarray(pose, np.float64)
        move[:3, :3] /= scale
        return move

    def scaled(length: float | None) -> float | None:
        return None if length is None else length * scale

    notes = [_note(matrix[:3, 3] / -scale)] if matrix[:3, 3].any() else []
    if scale != 1:
        notes.append(f"scaled by {scale:g}: single precision does not trace a scene of its size")
    return replace(
        description,
        materials=[
            replace(each, attenuation_distance=each.attenuation_distance * scale) for each in description.materials
        ],
        instances=[replace(each, world_from_mesh=matrix @ each.world_from_mesh) for each in description.instances],
        cameras=[
            replace(
                each,
                world_from_camera=moved(each.world_from_camera),
                height=scaled(each.height),
                focus_distance=scaled(each.focus_distance),
            )
            for each in description.cameras
        ],
        lights=[
            replace(
                each,
                world_from_light=moved(each.world_from_light),
                radius=each.radius * scale,
                color=each.color if each.kind == "directional" else tuple(scale**2 * value for value in each.color),
            )
            for each in description.lights
        ],
        notes=[*description.notes, *notes],
    )


def _far_offset(middle: NDArray[np.float64], extent: float) -> NDArray[np.float64] | None:
    """``middle``, in whole units where ``extent`` is larger than one; None where it is not far from the origin."""
    if not 0 < FAR * extent < np.abs(middle).max():
        return None
    return np.round(middle) if extent > 1 else middle


def _note(offset: NDArray[np.float64]) -> str:
    x, y, z = -offset
    return f"moved by {x:.12g}, {y:.12g}, {z:.12g}: so far from the origin its shape would be rounded"
