"""Placement of the bundled scenes in the display.

A :class:`Stage` holds the point of the scene in the middle of the lens plane, the direction of view, and the scale: how
many millimetres of the paper's display (its Table I: 512 x 512 pixels of 0.264583 mm under 64 lenses of 8 pixels, gap
6.8 mm) one unit of the scene is. Its camera's picture is as high in the lens plane as that display, so placing the
display by the camera puts the scene into it at that scale.

That display begins its rays 10 mm in front of the lens plane, and spreads a point at z over ``|z| / 54.4 mm`` lens
pitches. The scenes therefore reach from some 50 mm behind the lens plane to just under 10 mm in front of it: as deep
as can be without blur.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, cos, radians, sin
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from lippmann.scene.values.description import Camera, Matrix

if TYPE_CHECKING:
    from lippmann.scene.values.whitted_scene import ClassicCamera

Point = tuple[float, float, float]

PICTURE_HEIGHT = 512 * 0.264583


@dataclass(frozen=True)
class Stage:
    """The point of a scene in the middle of the lens plane, the direction of view, and the scale.

    ``target`` (scene units) is that point; ``elevation`` and ``azimuth`` (degrees) tell how far the eye is raised above
    the horizon and turned about the vertical +y (0: the eye looks along -z; positive: it has moved toward +x).
    ``eye_distance`` is in mm from the target, ``unit`` the millimetres per scene unit.
    """

    target: Point
    elevation: float
    azimuth: float = 0.0
    eye_distance: float = 400.0
    unit: float = 1.0

    @property
    def rotation(self) -> Matrix:
        """Columns: the display's right, up and toward-the-viewer directions in the scene, ``(3, 3)``."""
        e, a = radians(self.elevation), radians(self.azimuth)
        return np.array(
            [
                [cos(a), -sin(e) * sin(a), cos(e) * sin(a)],
                [0.0, cos(e), sin(e)],
                [-sin(a), -sin(e) * cos(a), cos(e) * cos(a)],
            ]
        )

    @property
    def world_from_display(self) -> Matrix:
        """Similarity ``(4, 4)`` that puts the display frame (mm, +z toward the viewer) into the scene."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.rotation / self.unit
        matrix[:3, 3] = self.target
        return matrix

    @property
    def eye(self) -> Point:
        """The place of the eye in the scene."""
        x, y, z = np.asarray(self.target) + self.rotation[:, 2] * (self.eye_distance / self.unit)
        return float(x), float(y), float(z)

    def camera(self, name: str = "main") -> Camera:
        """The camera at the eye, focused on the lens plane."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.rotation
        matrix[:3, 3] = self.eye
        fov_y = 2 * atan(PICTURE_HEIGHT / 2 / self.eye_distance)
        return Camera(name, matrix, fov_y=fov_y, focus_distance=self.eye_distance / self.unit)

    def classic_camera(self, *, ray_depth: int) -> ClassicCamera:
        """The same camera in the classic models' terms; focus is not among those."""
        from lippmann.scene.values.whitted_scene import ClassicCamera

        right_up_back = self.rotation
        return ClassicCamera(
            center=self.eye,
            view=vector_of(-right_up_back[:, 2]),
            up=vector_of(right_up_back[:, 1]),
            zoom=self.eye_distance / PICTURE_HEIGHT,
            ray_depth=ray_depth,
            handedness="right",
            pixel_point="center",
        )


def vector_of(numbers: ArrayLike) -> Point:
    """Three numbers as a tuple."""
    x, y, z = (float(number) for number in np.asarray(numbers))
    return x, y, z


def level_rectangle(
    first: tuple[float, float], last: tuple[float, float]
) -> tuple[list[tuple[float, float, float]], list[tuple[int, int, int]]]:
    """Corners and triangles, facing up, of a rectangle at y = 0 between two opposite corners (x, z)."""
    (x0, z0), (x1, z1) = first, last
    return [(x0, 0, z0), (x0, 0, z1), (x1, 0, z1), (x1, 0, z0)], [(0, 1, 2), (0, 2, 3)]
