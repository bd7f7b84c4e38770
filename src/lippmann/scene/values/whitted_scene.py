"""Scenes for the classic light models (Tachyon's and NFF's), as plain values, independent of readers and renderers.

The readers ``tachyon`` and ``nff`` and the bundled scenes produce a :class:`ClassicScene`; the ``classic``
integrator renders it. Primitives come in batches (``whitted_shapes``), materials and lights as small values.
:class:`lippmann.scene.whitted.builder.ClassicSceneBuilder` puts a scene together.

World units are the file's own. Colours are linear RGB as written, with no range imposed. Tachyon's frame is
left-handed (x right, y up, z away from the viewer looking along +z), NFF's right-handed; ``ClassicScene.handedness``
says which. Angles are degrees, as the files have them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.values.whitted_camera import ClassicCamera, Handedness
from lippmann.scene.values.whitted_lighting import AmbientOcclusion, Background, ClassicLight, Fog, Shading
from lippmann.scene.values.whitted_numbers import check
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
from lippmann.scene.values.whitted_surfaces import ClassicImage, ClassicMaterial

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
