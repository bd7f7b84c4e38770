"""Scenes for the classic light models (Tachyon's and NFF's), as plain values, independent of readers and renderers.

The readers ``tachyon`` and ``nff`` and the bundled scenes produce a :class:`ClassicScene`; the ``classic``
integrator renders it. Primitives come in batches (``whitted_shapes``), materials and lights as small values.
:class:`lippmann.scene.whitted.builder.ClassicSceneBuilder` puts a scene together.

World units are the file's own. Colours are linear RGB as written, with no range imposed. Tachyon's frame is
left-handed (x right, y up, z away from the viewer looking along +z), NFF's right-handed; ``ClassicScene.handedness``
says which. Angles are degrees, as the files have them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.values.whitted_shapes import (
    Batch,
    Boxes,
    Cylinders,
    Numbers,
    Planes,
    Rings,
    Spheres,
    Triangles,
    Tubes,
)
from lippmann.scene.values.whitted_surfaces import (
    AmbientOcclusion,
    Background,
    ClassicImage,
    ClassicLight,
    ClassicMaterial,
    Fog,
    Shading,
    Vector,
    check,
    check_finite,
)

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


Rules = Literal["tachyon", "nff"]


@dataclass(frozen=True, eq=False)
class ClassicScene:
    """The content of a Tachyon or NFF file.

    ``rules`` names the light model. ``clip_groups`` are arrays ``(k, 4)``: of a primitive in group i, points with
    a x + b y + c z <= d are kept for all its planes (a, b, c, d). ``resolution`` (width, height) is the picture size
    that the file asks for. ``notes`` are one-line remarks of the reader: features that it ignored, and its assumptions.
    """

    name: str
    rules: Rules = "tachyon"
    handedness: Handedness = "left"
    spheres: Spheres = field(default_factory=Spheres)
    tubes: Tubes = field(default_factory=Tubes)
    cylinders: Cylinders = field(default_factory=Cylinders)
    rings: Rings = field(default_factory=Rings)
    boxes: Boxes = field(default_factory=Boxes)
    planes: Planes = field(default_factory=Planes)
    triangles: Triangles = field(default_factory=Triangles)
    clip_groups: tuple[Numbers, ...] = ()
    materials: tuple[ClassicMaterial, ...] = ()
    images: tuple[ClassicImage, ...] = ()
    lights: tuple[ClassicLight, ...] = ()
    ambient_occlusion: AmbientOcclusion | None = None
    background: Background = field(default_factory=Background)
    fog: Fog | None = None
    shading: Shading = field(default_factory=Shading)
    camera: ClassicCamera = field(default_factory=ClassicCamera)
    resolution: tuple[int, int] = (512, 512)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for planes in self.clip_groups:
            valid = planes.ndim == 2 and planes.shape[1] == 4 and bool(np.isfinite(planes).all())
            check(valid, f"a clip group of shape {planes.shape}", "rows of four finite numbers")
            planes.setflags(write=False)
        groups, materials = len(self.clip_groups), len(self.materials)
        for batch in self.batches():
            check(_within(batch.material, 0, materials), f"a {batch.kind} without material", "an index in range")
            check(_within(batch.clip_group, -1, groups), f"a {batch.kind} without clip group", "an index, or -1")
        for light in self.lights:
            check(-1 <= light.clip_group < groups, f"a light in clip group {light.clip_group}", "an index, or -1")
        for material in self.materials:
            image = material.texture.image
            check(image is None or 0 <= image < len(self.images), f"a texture with image {image}", "an index in range")
        check(min(self.resolution) >= 1, f"resolution {self.resolution}", "at least one pixel")

    def batches(self) -> tuple[Batch, ...]:
        """All batches, empty ones too, in the order of :meth:`counts`."""
        return (self.spheres, self.tubes, self.cylinders, self.rings, self.boxes, self.planes, self.triangles)

    def counts(self) -> dict[str, int]:
        """Number of primitives of each kind ('sphere', 'tube', 'cylinder', 'ring', 'box', 'plane', 'triangle')."""
        return {batch.kind: len(batch) for batch in self.batches()}

    def bounds(self) -> Numbers | None:
        """The box ``(2, 3)`` around all finite primitives, before clipping, without light sources; None for none."""
        boxes = [box for box in (batch.bounds() for batch in self.batches()) if box is not None]
        if not boxes:
            return None
        corners = np.stack(boxes)
        return np.stack([corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)])


def _within(indices: NDArray[np.int32], low: int, high: int) -> bool:
    return not len(indices) or bool(indices.min() >= low and indices.max() < high)
