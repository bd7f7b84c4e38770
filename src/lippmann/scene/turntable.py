"""A scene on a turntable: the axis that it turns about, the scene at an angle, and the space that it sweeps.

The display and all light stand still, and the scene turns. What moves in numbers are the display and the light, which
go round the other way: that gives the same picture, of shapes that keep their places and need not be built again.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from lippmann.options.placement import PlacementOptions
from lippmann.scene.camera_placement import remove_scale
from lippmann.scene.matrices import Bounds, Vector, inverse, rotation, transform_points, translation
from lippmann.scene.placement import face_viewer
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import Matrix

#: Steps (degrees) in which the outline of a scene and the space that it sweeps are measured. A circle's radius is exact
#: to 0.1 %.
STEP = 5.0

#: How much more upright than y another axis has to be to be preferred: ties go to y.
_TIE = 1e-6


def turn_about(axis: Vector, center: Vector | Bounds, degrees: float) -> Matrix:
    """The rotation ``(4, 4)`` by ``degrees`` (right-handed) about the line along the unit vector ``axis``."""
    angle, along = np.radians(degrees), np.asarray(axis, np.float64)
    cross = np.cross(np.eye(3), along)
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    return np.asarray(translation(center) @ matrix @ translation(-np.asarray(center)), np.float64)


def turning_axis(scene: Scene, options: PlacementOptions) -> Vector:
    """The axis of the scene's own frame that stands most upright in front of the viewer, pointing up: a unit vector.

    A model that ``options.turn`` or a camera shows from above thus turns as on a table that is seen from above.

    Raises
    ------
    SceneError
        The camera that the options name is not found.
    """
    if options.place == "camera" or options.camera is not None:
        frame = remove_scale(scene.camera(options.camera))[:3, :3]
        display_from_world = rotation(options.turn)[:3, :3] @ frame.T
    elif options.place == "display":
        display_from_world = rotation(options.turn)[:3, :3]
    else:
        display_from_world = rotation(face_viewer(scene.bounds, options, [], scene.facing_cameras).turn)[:3, :3]
    up = display_from_world[1]
    upright = int(np.argmax(np.abs(up) + np.array([0.0, _TIE, 0.0])))
    axis = [0.0, 0.0, 0.0]
    axis[upright] = float(np.copysign(1.0, up[upright]))
    return axis[0], axis[1], axis[2]


def outline(scene: Scene, axis: Vector, center: Vector | Bounds) -> Bounds:
    """Points ``(n, 3)`` whose convex hull, a prism along ``axis``, is the least one of so many sides about the scene.

    Its sides, in steps of :data:`STEP` about the axis, touch the scene.
    """
    upright = _frame_along(axis) @ translation(-np.asarray(center))
    quarter = np.arange(0.0, 90.0, STEP)
    # The box in a frame that is turned by an angle touches the scene on four sides, a quarter turn apart.
    boxes = np.stack([scene.bounds_in(turn_about((0.0, 1.0, 0.0), (0.0, 0.0, 0.0), -a) @ upright) for a in quarter])
    low, high = boxes[:, 0], boxes[:, 1]
    # Distances of the sides, whose normals are (sin b, 0, cos b) at b = 0, STEP, ... degrees.
    distances = np.concatenate([high[:, 2], high[:, 0], -low[:, 2], -low[:, 0]])
    normal = np.radians(np.arange(0.0, 360.0, STEP))
    half = np.radians(STEP / 2.0)
    ahead = np.roll(distances, -1)
    along = (distances + ahead) / 2.0 / np.cos(half)
    aside = (ahead - distances) / 2.0 / np.sin(half)
    x = along * np.sin(normal + half) + aside * np.cos(normal + half)
    z = along * np.cos(normal + half) - aside * np.sin(normal + half)
    points = np.concatenate([np.stack([x, np.full_like(x, y), z], axis=1) for y in (low[0, 1], high[0, 1])])
    return transform_points(inverse(upright), points)


def swept_points(scene: Scene, axis: Vector, center: Vector | Bounds, angles: Iterable[float]) -> Bounds:
    """Points ``(n, 3)`` whose convex hull is about the scene at all of ``angles`` (degrees)."""
    points = outline(scene, axis, center)
    return np.concatenate([transform_points(turn_about(axis, center, angle), points) for angle in angles])


def _frame_along(axis: Vector) -> Matrix:
    """A rotation ``(4, 4)`` that brings ``axis`` to +y."""
    up = np.asarray(axis, np.float64)
    least = np.eye(3)[int(np.argmin(np.abs(up)))]
    right = np.cross(up, least)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, up, np.cross(right, up)])
    return matrix
