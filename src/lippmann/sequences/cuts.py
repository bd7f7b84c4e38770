"""Cuts of a film: something appears or jumps, a light is switched, or the display stands elsewhere all at once."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.scene.extent import box_corners
from lippmann.scene.matrices import Bounds, rotation_of, transform_points
from lippmann.scene.placement import Placement
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import SceneDescription, Texture
from lippmann.sequences.tuning import TUNING


class Moment(NamedTuple):
    """A frame by its number: the scene as it is then, and where the display stands in it."""

    number: int
    scene: Scene
    placement: Placement


def is_cut(before: Moment, after: Moment, display: Display) -> bool:
    """Whether two frames differ by more than smooth motion.

    They do where meshes, materials, textures or light sources are others, where a mesh appears or vanishes by its size,
    at one pixel, or where the display, any mesh or any light source has moved farther than a third of the display's
    width. Light sources may go along with the display instead.
    """
    width, height = display.size_mm
    panel = box_corners(np.array([[-width / 2, -height / 2, 0], [width / 2, height / 2, 0]]))
    moved = [_measure_distances(_in_world(panel, before), _in_world(panel, after))]
    reach = float(np.linalg.norm(before.placement.world_from_display[:3, 0])) * width
    one, other = before.scene.description, after.scene.description
    # Scenes of Whitted tracers have none: nothing moves in them.
    if one is not other or before.scene.name != after.scene.name:
        if not (isinstance(one, SceneDescription) and isinstance(other, SceneDescription)):
            return True
        if _list_content(one) != _list_content(other) or not _has_same_texels(one, other):
            return True
        corners = _place_corners(one), _place_corners(other)
        are_seen = [np.ptp(boxes, axis=1).max(axis=1) >= reach / display.panel.width for boxes in corners]
        if not np.array_equal(*are_seen):
            return True
        moved.append(_measure_distances(*(boxes.reshape(-1, 3) for boxes in corners)))
        lights = _place_lights(one, reach), _place_lights(other, reach)
        # A turntable's display goes round with them.
        along = transform_points(before.placement.world_from_display @ after.placement.display_from_world, lights[1])
        moved.append(np.minimum(_measure_distances(*lights), _measure_distances(lights[0], along)))
    return any(distances.max(initial=0.0) > TUNING.farthest * reach for distances in moved)


def is_light_at_rest(before: Moment, after: Moment) -> bool:
    """Whether nothing but the display has moved: not the scene, nor light that turns with the display."""
    environment = after.scene.environment
    if before.scene is not after.scene:
        return False
    if environment is None or not environment.follows_viewer:
        return True
    turns = (rotation_of(moment.placement.world_from_display) for moment in (before, after))
    return bool(np.ptp(list(turns), axis=0).max() < 1e-6)


def are_emitters_at_rest(before: Moment, after: Moment) -> bool:
    """Whether no light source has moved or changed its cone or radius, nor any surface that emits light."""
    one, other = before.scene.description, after.scene.description
    if one is other or not (isinstance(one, SceneDescription) and isinstance(other, SceneDescription)):
        return True
    pairs = zip(_list_emitters(one), _list_emitters(other), strict=True)
    return all(np.array_equal(*pair) for pair in pairs)


def _list_emitters(description: SceneDescription) -> Iterator[NDArray[np.floating]]:
    """Matrices and forms of all light sources; corners and matrices of the copies of all meshes that emit light."""
    for light in description.lights:
        yield from (light.world_from_light, np.array([light.inner_angle, light.outer_angle, light.radius]))
    for mesh, places in description.placements.items():
        if any(description.materials[description.meshes[mesh].material].emission):
            yield from (description.meshes[mesh].positions, places)


def _measure_distances(one: Bounds, other: Bounds) -> NDArray[np.float64]:
    """Distances ``(n,)`` between points ``(n, 3)``."""
    return np.asarray(np.linalg.norm(one - other, axis=1))


def _in_world(points: Bounds, moment: Moment) -> Bounds:
    return transform_points(moment.placement.world_from_display, points)


def _list_content(description: SceneDescription) -> object:
    """Properties that smooth motion does not change; a difference is a cut."""
    return (
        {mesh: len(places) for mesh, places in description.placements.items()},
        [
            [Texture if isinstance(value, Texture) else value for value in vars(material).values()]
            for material in description.materials
        ],
        [(light.kind, light.color) for light in description.lights],
        (description.environment, description.background, description.splats, description.volume),
    )


def _has_same_texels(one: SceneDescription, other: SceneDescription) -> bool:
    """Whether the textures of as many materials have the same images."""
    pairs = zip(_list_textures(one), _list_textures(other), strict=True)
    return all(a is b or a.image is b.image or np.array_equal(a.image.pixels, b.image.pixels) for a, b in pairs)


def _list_textures(description: SceneDescription) -> Iterator[Texture]:
    for material in description.materials:
        yield from (value for value in vars(material).values() if isinstance(value, Texture))


def _place_lights(description: SceneDescription, reach: float) -> Bounds:
    """Two points ``(2 n, 3)`` of each light source: its place, and half of ``reach`` from there along its axis."""
    ends = []
    for light in description.lights:
        place, axis = light.world_from_light[:3, 3], light.world_from_light[:3, 2]
        ends += [place, place + reach / 2 * axis / (np.linalg.norm(axis) or 1.0)]
    return np.array(ends).reshape(-1, 3)


def _place_corners(description: SceneDescription) -> Bounds:
    """Corners ``(n, 8, 3)`` of the boxes of all meshes, one for each copy, world units."""
    corners = [np.zeros((0, 8, 3))]
    for mesh, places in description.placements.items():
        positions = description.meshes[mesh].positions
        if len(positions):
            box = box_corners(np.stack([positions.min(axis=0), positions.max(axis=0)]))
            corners.append((box @ places[:, :3, :3].transpose(0, 2, 1) + places[:, None, :3, 3]).reshape(-1, 8, 3))
    return np.concatenate(corners)
