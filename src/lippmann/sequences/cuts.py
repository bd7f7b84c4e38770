"""Cuts of a film: something appears or jumps, a light is switched, or the display stands elsewhere all at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lippmann.display import Display
from lippmann.scene.matrices import Bounds, transform_points
from lippmann.scene.placement import Placement
from lippmann.scene.scene import Scene, box_corners
from lippmann.scene.values.description import SceneDescription, Texture

#: The farthest that anything moves without a cut, as a share of the display's width: a turn by 39 degrees moves the
#: panel's edges so far.
_FARTHEST = 1 / 3


class Moment(NamedTuple):
    """A frame by its number: the scene as it is then, and where the display stands in it."""

    number: int
    scene: Scene
    placement: Placement


def is_cut(before: Moment, after: Moment, display: Display) -> bool:
    """Whether two frames differ by more than smooth motion.

    They do where meshes, materials or light sources are others, their textures aside, or where the display or any mesh
    has moved farther than a third of the display's width.
    """
    width, height = display.size_mm
    panel = box_corners(np.array([[-width / 2, -height / 2, 0], [width / 2, height / 2, 0]]))
    moved = [(_in_world(panel, before), _in_world(panel, after))]
    farthest = _FARTHEST * np.linalg.norm(before.placement.world_from_display[:3, 0]) * width
    one, other = before.scene.description, after.scene.description
    # Scenes of Whitted tracers have none: nothing moves in them.
    if one is not other or before.scene.name != after.scene.name:
        if not (isinstance(one, SceneDescription) and isinstance(other, SceneDescription)):
            return True
        if _content(one) != _content(other):
            return True
        moved.append((_corners(one), _corners(other)))
    return any(np.linalg.norm(a - b, axis=1).max(initial=0.0) > farthest for a, b in moved)


def _in_world(points: Bounds, moment: Moment) -> Bounds:
    return transform_points(moment.placement.world_from_display, points)


def _content(description: SceneDescription) -> object:
    """What smooth motion leaves as it is."""
    return (
        {mesh: len(places) for mesh, places in description.placements.items()},
        [
            [value for value in vars(material).values() if not isinstance(value, Texture)]
            for material in description.materials
        ],
        [(light.kind, light.color) for light in description.lights],
        (description.environment, description.background, description.splats, description.volume),
    )


def _corners(description: SceneDescription) -> Bounds:
    """Corners ``(n, 3)`` of the boxes of all meshes, one for each copy, world units."""
    corners = [np.zeros((0, 3))]
    for mesh, places in description.placements.items():
        positions = description.meshes[mesh].positions
        if len(positions):
            box = box_corners(np.stack([positions.min(axis=0), positions.max(axis=0)]))
            corners.append((box @ places[:, :3, :3].transpose(0, 2, 1) + places[:, None, :3, 3]).reshape(-1, 3))
    return np.concatenate(corners)
