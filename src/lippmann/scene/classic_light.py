"""Light of a scene for the classic light models that goes round the scene, as on a turntable."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.matrices import Vector, transform_points
from lippmann.scene.values.description import Matrix
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_surfaces import Background, ClassicLight
from lippmann.scene.whitted.world_frame import world_from_scene


def move_light(scene: ClassicScene, matrix: Matrix) -> ClassicScene:
    """The scene with its light sources and background moved by a rigid ``matrix`` (4x4); its shapes stay.

    ``matrix`` moves in the world, whose z the scene's own numbers may have negated.
    """
    mirror = world_from_scene(scene)
    own = mirror @ matrix @ mirror
    lights = tuple(_move_source(light, own) for light in scene.lights)
    return replace(scene, lights=lights, background=_move_background(scene.background, own))


def _move_source(light: ClassicLight, matrix: Matrix) -> ClassicLight:
    center = transform_points(matrix, np.asarray([light.center], np.float64))[0]
    direction = matrix[:3, :3] @ np.asarray(light.direction, np.float64)
    return replace(light, center=_vector(center), direction=_vector(direction))


def _move_background(background: Background, matrix: Matrix) -> Background:
    up = matrix[:3, :3] @ np.asarray(background.up, np.float64)
    # A gradient over a plane is told by places, which move along.
    offset = float(up @ matrix[:3, 3]) if background.kind == "sky-plane" else 0.0
    return replace(
        background,
        up=_vector(up),
        top_value=background.top_value + offset,
        bottom_value=background.bottom_value + offset,
    )


def _vector(values: NDArray[np.float64]) -> Vector:
    x, y, z = values.tolist()
    return x, y, z
