"""Small balls: the flake of 91 mirror balls.

Every ball carries nine of a third of its radius, six around its waist and three above, down to the third generation: of
the kind and count of the balls scene (level 2) of Haines' Standard Procedural Databases (IEEE Computer Graphics and
Applications 7(11), 1987). Millimetres of the paper's display, +y up, the floor at y = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.bundled.stage import Stage
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_surfaces import Background, ClassicLight, ClassicMaterial
from lippmann.scene.whitted.builder import ClassicSceneBuilder

NAME = "small-balls"

Points = NDArray[np.float64]


@dataclass(frozen=True)
class Layout:
    """Sizes in mm, angles in degrees.

    The great ball of ``radius`` hovers with its middle ``height`` above the floor; a ball of the next generation has
    ``shrink`` times the radius of its parent. Six children sit around the waist, three at ``crown`` from the axis,
    which for the great ball leans by ``lean`` toward the viewer after a turn by ``turn`` about itself.
    """

    radius: float = 22.0
    height: float = 27.0
    generations: int = 3
    shrink: float = 1 / 3
    crown: float = 38.0
    lean: float = 14.0
    turn: float = 12.0


LAYOUT = Layout()
STAGE = Stage(target=(0.0, 52.8, 9.0), elevation=70.0)

MIRROR = ClassicMaterial(color=(1.0, 0.9, 0.7), ambient=0.05, diffuse=0.45, specular=0.5, phong=0.5, phong_size=45.0)
GROUND = ClassicMaterial(color=(1.0, 0.75, 0.33), ambient=0.2, diffuse=0.75)
LIGHTS = tuple(
    ClassicLight("point", (0.42, 0.42, 0.42), center=center)
    for center in ((150.0, 190.0, 110.0), (-140.0, 260.0, 60.0), (20.0, 220.0, -150.0))
)
SKY = Background(color=(0.08, 0.36, 0.75))
RAY_DEPTH = 5


def flake(layout: Layout = LAYOUT) -> tuple[Points, Points]:
    """Return centres ``(n, 3)`` and radii ``(n,)``: 1, 9, 81, ... balls, generation after generation."""
    lean, turn = np.radians(layout.lean), np.radians(layout.turn)
    about_y = np.array([(np.cos(turn), 0, np.sin(turn)), (0, 1, 0), (-np.sin(turn), 0, np.cos(turn))])
    about_x = np.array([(1, 0, 0), (0, np.cos(lean), -np.sin(lean)), (0, np.sin(lean), np.cos(lean))])
    children = _child_frames(layout.crown)

    centers, frames = np.array([(0.0, layout.height, 0.0)]), (about_x @ about_y)[None]
    radius = layout.radius
    all_centers, all_radii = [centers], [np.full(1, radius)]
    for _ in range(layout.generations - 1):
        frames = (frames[:, None] @ children[None]).reshape(-1, 3, 3)
        outward = frames[:, :, 1].reshape(len(centers), -1, 3)
        centers = (centers[:, None] + outward * (radius * (1 + layout.shrink))).reshape(-1, 3)
        radius *= layout.shrink
        all_centers.append(centers)
        all_radii.append(np.full(len(centers), radius))
    return np.concatenate(all_centers), np.concatenate(all_radii)


def _child_frames(crown: float) -> Points:
    """Rotations ``(9, 3, 3)`` of the children in their parent's frame; a frame's second column points outward."""
    places = [(90.0, 60.0 * k) for k in range(6)] + [(crown, 30.0 + 120.0 * k) for k in range(3)]
    frames = []
    for polar, around in np.radians(places):
        outward = np.array([np.sin(polar) * np.cos(around), np.cos(polar), np.sin(polar) * np.sin(around)])
        along = np.array([-np.sin(around), 0.0, np.cos(around)])
        frames.append(np.stack([np.cross(outward, along), outward, along], axis=1))
    return np.stack(frames)


def make() -> ClassicScene:
    """Return the flake of balls over its ground."""
    builder = ClassicSceneBuilder(NAME, handedness="right")
    centers, radii = flake()
    builder.planes((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), builder.material(GROUND))
    builder.spheres(centers, radii, builder.material(MIRROR))
    return builder.build(LIGHTS, background=SKY, camera=STAGE.classic_camera(ray_depth=RAY_DEPTH))
