"""Classic scenes in the right-handed world of the rest of the program: transformation, bounds, camera.

A left-handed scene (Tachyon's) lies in the world with its z negated; its own numbers stay as the file has them, and the
classic integrator negates the z of rays instead. So a display's place in the world is a rotation without mirroring, and
the picture comes out as the format's own program shows it.
"""

from __future__ import annotations

from dataclasses import replace
from math import atan, pi

import numpy as np

from lippmann.errors import SceneError
from lippmann.scene.values.description import Camera, Matrix
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_shapes import Batch, Boxes, Numbers, Rings, Spheres, Triangles, Tubes

#: A camera of wider angle (fisheye) stands in the world with this field.
_WIDEST_FIELD = 2 * pi / 3


def world_from_scene(scene: ClassicScene) -> Matrix:
    """The matrix ``(4, 4)`` from the file's coordinates to the world's."""
    return np.diag([1.0, 1.0, -1.0 if scene.handedness == "left" else 1.0, 1.0])


def world_bounds(scene: ClassicScene, frame: Matrix | None = None) -> Numbers:
    """The box ``(2, 3)`` around all shapes that have an end, in the world or along the axes of another frame.

    ``frame`` ``(4, 4)`` leads there from the world: a similarity, but that its depth (z) may be scaled besides.

    Raises
    ------
    SceneError
        No shape has an end.
    """
    similarity = np.eye(4) if frame is None else np.array(frame, np.float64)
    # The depth's own scale is taken out, for spheres to stay spheres, and given to the box.
    depth_scale = np.linalg.norm(similarity[2, :3]) / np.linalg.norm(similarity[0, :3])
    similarity[2] /= depth_scale
    matrix = similarity @ world_from_scene(scene)
    finite: tuple[Batch, ...] = (scene.spheres, scene.tubes, scene.rings, scene.triangles)
    corners = [np.stack(_transform(batch, matrix).extents()) for batch in (*finite, scene.boxes) if len(batch)]
    if not corners:
        raise SceneError(
            "the scene has no extent that could be measured",
            where=scene.name,
            rule="it needs a shape that has an end; planes and infinite cylinders have none",
        )
    bounds = np.stack(
        [
            np.min([low.min(axis=0) for low, _ in corners], axis=0),
            np.max([high.max(axis=0) for _, high in corners], axis=0),
        ]
    )
    return np.asarray(bounds * (1.0, 1.0, depth_scale), np.float64)


def world_camera(scene: ClassicScene, name: str = "camera") -> Camera:
    """The scene's own camera in the world.

    Left out, for only the classic camera has them: an off-centre window, a fisheye's projection, depth of field.
    """
    source = scene.camera
    right, up, view = source.frame()
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, up, -view], axis=1)
    matrix[:3, 3] = source.center
    matrix = world_from_scene(scene) @ matrix
    left, right_edge, bottom, top = source.window(*scene.resolution)
    width, height = abs(right_edge - left), abs(top - bottom)
    if source.projection == "orthographic":
        return Camera(name, matrix, height=height, aspect=width / height)
    field = height if source.projection == "fisheye" else 2 * atan(height / 2)
    return Camera(name, matrix, fov_y=min(field, _WIDEST_FIELD), aspect=width / height)


def _transform(batch: Batch, matrix: Matrix) -> Batch:
    """A batch under a similarity; boxes become the boxes around them."""
    scale = float(np.linalg.norm(matrix[:3, 0]))

    def point(points: Numbers) -> Numbers:
        return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3], np.float64)

    def direction(vectors: Numbers) -> Numbers:
        return np.asarray(vectors @ matrix[:3, :3].T / scale, np.float64)

    if isinstance(batch, Spheres):
        return replace(batch, centers=point(batch.centers), radii=batch.radii * scale)
    if isinstance(batch, Tubes):
        return replace(
            batch,
            base=point(batch.base),
            apex=point(batch.apex),
            base_radius=batch.base_radius * scale,
            apex_radius=batch.apex_radius * scale,
        )
    if isinstance(batch, Rings):
        return replace(
            batch,
            centers=point(batch.centers),
            normals=direction(batch.normals),
            inner=batch.inner * scale,
            outer=batch.outer * scale,
        )
    if isinstance(batch, Boxes):
        corners = point(batch.corners())
        return replace(batch, minimum=corners.min(axis=1), maximum=corners.max(axis=1))
    assert isinstance(batch, Triangles)
    return replace(batch, positions=point(batch.positions))
