"""The camera of a Whitted-style scene file, and one frame of a camera path, as plain values."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from lippmann.scene.values.whitted_numbers import Vector, check, check_finite
from lippmann.scene.values.whitted_shapes import Numbers

Handedness = Literal["left", "right"]
Projection = Literal["perspective", "perspective-dof", "orthographic", "fisheye"]


@dataclass(frozen=True)
class ClassicCamera:
    """The file's own camera.

    ``center`` is the eye, ``view`` and ``up`` are directions of any length. The image plane lies at distance 1
    (perspective) or at the center (orthographic); 'fisheye' takes the window's numbers as angles in radians.
    ``window`` gives its extent. ``zoom``, ``aspect``: see there; ``frustum`` (left, right, bottom, top) replaces both;
    ``angle`` (degrees, NFF) is the field between the centres of the outermost pixel rows. ``antialiasing`` n: n extra
    jittered samples per pixel. ``ray_depth``: the primary ray counts 1. ``aperture``: extent of the eye's jitter as a
    fraction of the window ('perspective-dof'; focus at distance 1). ``pixel_point``: where a pixel's first sample
    lies, its upper right corner (Tachyon) or its center.
    """

    center: Vector = (0.0, 0.0, 0.0)
    view: Vector = (0.0, 0.0, 1.0)
    up: Vector = (0.0, 1.0, 0.0)
    projection: Projection = "perspective"
    zoom: float = 1.0
    aspect: float = 1.0
    antialiasing: int = 0
    ray_depth: int = 6
    aperture: float = 0.0
    frustum: tuple[float, float, float, float] | None = None
    angle: float | None = None
    handedness: Handedness = "left"
    pixel_point: Literal["upper-right", "center"] = "upper-right"

    def __post_init__(self) -> None:
        check_finite("camera", *self.center, *self.view, *self.up, self.aperture, *(self.frustum or ()))
        check(self.zoom > 0 and self.aspect > 0, f"zoom {self.zoom}, aspect {self.aspect}", "both are positive")
        check_finite("camera zoom and aspect", self.zoom, self.aspect)
        check(self.antialiasing >= 0, f"antialiasing is {self.antialiasing}", "0 or more extra samples")
        check(self.ray_depth >= 1, f"ray depth is {self.ray_depth}", "1 or more: the primary ray counts 1")
        if self.angle is not None:
            check(0 < self.angle < 180, f"the camera's angle is {self.angle}", "between 0 and 180 degrees")
        if self.frustum is not None:
            left, right, bottom, top = self.frustum
            check(left != right and bottom != top, f"frustum {self.frustum}", "left is not right, bottom not top")
        view, up = np.array(self.view), np.array(self.up)
        across = float(np.linalg.norm(np.cross(up, view)))
        valid = across > 1e-9 * float(np.linalg.norm(up) * np.linalg.norm(view)) > 0
        check(valid, f"camera looks along {self.view}, up is {self.up}", "directions with a length, not parallel")

    def frame(self) -> tuple[Numbers, Numbers, Numbers]:
        """Unit vectors right, up, view as seen in the picture: right = up x view, in a right-handed world view x up."""
        view = np.array(self.view, dtype=np.float64)
        view /= np.linalg.norm(view)
        right = np.cross(np.array(self.up, dtype=np.float64), view)
        right /= np.linalg.norm(right)
        up = np.cross(view, right)
        return (right if self.handedness == "left" else -right), up, view

    def window(self, width: int, height: int) -> tuple[float, float, float, float]:
        """Left, right, bottom, top edge of a picture of ``width`` x ``height`` pixels, on the plane at distance 1.

        Without frustum or angle the height is 1 / zoom and the width (width / height) / aspect / zoom, so zoom 1 is a
        vertical field of 53.13 degrees. With ``angle`` pixels are square.
        """
        if self.frustum is not None:
            return self.frustum
        if self.angle is not None:
            pixel = 2.0 * math.tan(math.radians(self.angle) / 2.0) / max(height - 1, 1)
            half_width, half_height = pixel * width / 2.0, pixel * height / 2.0
        else:
            half_width, half_height = 0.5 * width / height / self.aspect / self.zoom, 0.5 / self.zoom
        return -half_width, half_width, -half_height, half_height


@dataclass(frozen=True)
class CameraPose:
    """One frame of a camera path: ``view`` and ``up`` directions and the eye's ``center``."""

    view: Vector
    up: Vector
    center: Vector
