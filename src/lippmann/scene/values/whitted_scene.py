"""Scenes for the classic light models (Tachyon's and NFF's), as plain values: no reader and no renderer in sight.

The readers ``tachyon`` and ``nff`` and the bundled scenes produce a :class:`ClassicScene`; the ``classic``
integrator renders it. Primitives come in batches (``primitives.py``), materials and lights as small values.
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

from lippmann.errors import SceneError
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

Vector = tuple[float, float, float]
Color = tuple[float, float, float]
Rules = Literal["tachyon", "nff"]
Handedness = Literal["left", "right"]
Projection = Literal["perspective", "perspective-dof", "orthographic", "fisheye"]
TextureKind = Literal[
    "constant",
    "checker",
    "grit",
    "marble",
    "wood",
    "noise",
    "cylindrical-checker",
    "cylindrical-image",
    "spherical-image",
    "planar-image",
    "volume-image",
]
TEXTURE_KINDS: tuple[TextureKind, ...] = (
    "constant",
    "checker",
    "grit",
    "marble",
    "wood",
    "noise",
    "cylindrical-checker",
    "cylindrical-image",
    "spherical-image",
    "planar-image",
    "volume-image",
)
"""Texture kinds in the order of Tachyon's TEXFUNC numbers 0 to 10."""


def _check(good: bool, what: str, rule: str) -> None:
    if not good:
        raise SceneError(what, rule=rule)


def _finite(name: str, *values: float) -> None:
    for value in values:
        _check(math.isfinite(value), f"{name} is {value}", "numbers are finite")


@dataclass(frozen=True, eq=False)
class ClassicImage:
    """Texels ``(depth, height, width, 3)`` uint8, indexed ``[w, v, u]``; row 0 is v = 0. A picture has depth 1.

    The values mean value / 255, without any transfer curve. Which row of a picture file is row 0 is settled by the
    reader (the top row for PPM and JPEG, the bottom row for TGA and PNG, as Tachyon does).
    """

    name: str
    texels: NDArray[np.uint8]

    def __post_init__(self) -> None:
        fair = self.texels.ndim == 4 and self.texels.shape[3] == 3 and self.texels.dtype == np.uint8
        _check(fair and self.texels.size > 0, f"image '{self.name}' is no RGB picture or volume", "")
        self.texels.setflags(write=False)


@dataclass(frozen=True)
class ClassicTexture:
    """A function of the hit point p (world coordinates) that gives the surface colour.

    ``kind`` names the function; ``image`` is an index into ``ClassicScene.images`` for the image kinds, else None.
    ``center``, ``scale``, ``rotate`` and the axes are the file's parameters. For images, u = fract(u_axis . (p -
    center) scale.x + rotate.x) and so on: ``rotate`` is an offset. Procedural kinds other than wood ignore ``rotate``
    and ``scale``.
    """

    kind: TextureKind = "constant"
    center: Vector = (0.0, 0.0, 0.0)
    rotate: Vector = (0.0, 0.0, 0.0)
    scale: Vector = (1.0, 1.0, 1.0)
    u_axis: Vector = (1.0, 0.0, 0.0)
    v_axis: Vector = (0.0, 1.0, 0.0)
    w_axis: Vector = (0.0, 0.0, 1.0)
    image: int | None = None

    def __post_init__(self) -> None:
        for name in ("center", "rotate", "scale", "u_axis", "v_axis", "w_axis"):
            _finite(f"texture {name}", *getattr(self, name))
        _check(self.kind in TEXTURE_KINDS, f"texture kind '{self.kind}' is unknown", f"one of {TEXTURE_KINDS}")
        _check(
            (self.image is not None) == self.kind.endswith("image"),
            f"a {self.kind} texture with image {self.image}",
            "image kinds have an image, others none",
        )


@dataclass(frozen=True)
class ClassicMaterial:
    """A surface in the terms of both light models. Equal materials are one material.

    Local colour = C (ambient + diffuse * sum of light) + highlight, with C the texture's colour (``color`` where the
    texture is constant). ``specular`` is the factor of the untinted mirror reflection. ``opacity`` < 1 lets light
    through: straight under Tachyon's rules, refracted by ``ior`` under NFF's. ``phong`` is the factor of the
    highlight, ``phong_size`` its exponent, ``phong_kind`` 'plastic' (light's colour) or 'metal' (surface's colour).
    ``outline`` and ``outline_width`` darken diffuse light near silhouettes; ``raster3d`` makes the opacity depend on
    the angle. Under NFF's rules ``ambient`` is the file's Kd times the ambient intensity.
    """

    color: Color = (1.0, 1.0, 1.0)
    ambient: float = 0.1
    diffuse: float = 0.9
    specular: float = 0.0
    opacity: float = 1.0
    phong: float = 0.0
    phong_size: float = 100.0
    phong_kind: Literal["plastic", "metal"] = "plastic"
    outline: float = 0.0
    outline_width: float = 0.0
    raster3d: bool = False
    ior: float = 1.0
    texture: ClassicTexture = field(default_factory=ClassicTexture)

    def __post_init__(self) -> None:
        _finite("a material's color", *self.color)
        for name in ("ambient", "diffuse", "specular", "opacity", "phong", "phong_size", "outline", "outline_width"):
            _finite(f"a material's {name}", getattr(self, name))
        _check(self.phong_size >= 0, f"phong_size is {self.phong_size}", "an exponent is 0 or more")
        _check(math.isfinite(self.ior) and self.ior > 0, f"ior is {self.ior}", "an index of refraction is positive")


@dataclass(frozen=True)
class ClassicLight:
    """A lamp. ``center`` and ``radius`` (point, spot): an emissive sphere of that size is seen, radius 0 is unseen.

    Shadows are hard, from the center, whatever the radius. ``direction`` (spot, directional) is the unit direction in
    which the light travels. A spot is full inside ``falloff_start`` degrees off its axis and falls linearly with the
    angle to nothing at ``falloff_end``. ``attenuation`` (c, l, q) divides diffuse light by c + l r + q r^2; None: no
    attenuation. ``clip_group`` cuts the visible sphere alone.
    """

    kind: Literal["point", "spot", "directional"]
    color: Color = (1.0, 1.0, 1.0)
    center: Vector = (0.0, 0.0, 0.0)
    radius: float = 0.0
    direction: Vector = (0.0, 0.0, 1.0)
    falloff_start: float = 180.0
    falloff_end: float = 180.0
    attenuation: Vector | None = None
    clip_group: int = -1

    def __post_init__(self) -> None:
        _finite("a light's color", *self.color)
        _finite("a light's center", *self.center)
        _finite("a light's falloff", self.falloff_start, self.falloff_end)
        _check(math.isfinite(self.radius) and self.radius >= 0, f"a light's radius is {self.radius}", "0 or more")
        _check(abs(math.hypot(*self.direction) - 1.0) < 1e-6, f"direction {self.direction}", "a unit vector")
        if self.attenuation is not None:
            fair = all(math.isfinite(k) and k >= 0 for k in self.attenuation) and any(self.attenuation)
            _check(fair, f"attenuation {self.attenuation}", "factors are 0 or more and not all 0")


@dataclass(frozen=True)
class AmbientOcclusion:
    """Sky light: ``samples`` random rays over the hemisphere, of ``color``, added to the diffuse light."""

    samples: int
    color: Color = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        _check(self.samples >= 1, f"{self.samples} samples of ambient occlusion", "1 or more")
        _finite("ambient occlusion color", *self.color)


@dataclass(frozen=True)
class Background:
    """What a ray sees where it hits nothing.

    ``solid``: ``color``. The gradients blend ``bottom_color`` to ``top_color`` by t = clamp((x . up - bottom_value) /
    (top_value - bottom_value)) with x the ray's direction ('sky-sphere') or its origin ('sky-plane'); ``up`` is used
    as given, not normalised.
    """

    kind: Literal["solid", "sky-sphere", "sky-plane"] = "solid"
    color: Color = (0.0, 0.0, 0.0)
    up: Vector = (0.0, 1.0, 0.0)
    top_value: float = 0.3
    bottom_value: float = 0.0
    top_color: Color = (0.0, 0.0, 0.0)
    bottom_color: Color = (0.0, 0.0, 0.5)

    def __post_init__(self) -> None:
        _finite("background", *self.color, *self.up, *self.top_color, *self.bottom_color)
        _finite("background gradient", self.top_value, self.bottom_value)
        _check(self.top_value != self.bottom_value, f"a gradient from {self.top_value} to itself", "two values")


@dataclass(frozen=True)
class Fog:
    """Fog of ``color``: colour = f C + (1 - f) fog, f clamped to [0, 1], r the distance along the ray.

    linear: f = (end - r) / (end - start); exp: f = e^(-v); exp2: f = e^(-v^2), v = density (r - start). ``planar``
    takes the depth along the view direction for primary rays and leaves the background untouched.
    """

    kind: Literal["linear", "exp", "exp2"]
    start: float
    end: float
    density: float
    color: Color
    planar: bool = False

    def __post_init__(self) -> None:
        _finite("fog", self.start, self.end, self.density, *self.color)
        _check(self.kind != "linear" or self.start != self.end, f"fog from {self.start} to itself", "start is not end")


@dataclass(frozen=True)
class Shading:
    """How the whole scene is shaded.

    ``mode`` 'full'; 'medium' without shadows and sky light; 'low' texture colour alone; 'lowest' white where anything
    is hit. ``shadow_filter``: surfaces that are not opaque dim the light behind them once per crossing (else it passes
    unchanged). ``max_transparent_surfaces``: how many such surfaces a ray may pass and still see shaded (None: all).
    ``raster3d``: opacity depends on the angle for all materials; ``local_times_opacity``: a surface's own colour is
    multiplied by its opacity (Tachyon's TRANS_VMD). ``light_scale`` multiplies all direct light. ``highlight``:
    Blinn's half vector, or Phong's reflected ray.
    """

    mode: Literal["full", "medium", "low", "lowest"] = "full"
    shadow_filter: bool = True
    max_transparent_surfaces: int | None = None
    raster3d: bool = False
    local_times_opacity: bool = False
    light_scale: float = 1.0
    highlight: Literal["blinn", "phong"] = "blinn"

    def __post_init__(self) -> None:
        _finite("light_scale", self.light_scale)
        fair = self.max_transparent_surfaces is None or self.max_transparent_surfaces >= 0
        _check(fair, f"max_transparent_surfaces is {self.max_transparent_surfaces}", "0 or more")


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
        _finite("camera", *self.center, *self.view, *self.up, self.aperture, *(self.frustum or ()))
        _check(self.zoom > 0 and self.aspect > 0, f"zoom {self.zoom}, aspect {self.aspect}", "both are positive")
        _finite("camera zoom and aspect", self.zoom, self.aspect)
        _check(self.antialiasing >= 0, f"antialiasing is {self.antialiasing}", "0 or more extra samples")
        _check(self.ray_depth >= 1, f"ray depth is {self.ray_depth}", "1 or more: the primary ray counts 1")
        if self.angle is not None:
            _check(0 < self.angle < 180, f"the camera's angle is {self.angle}", "between 0 and 180 degrees")
        if self.frustum is not None:
            left, right, bottom, top = self.frustum
            _check(left != right and bottom != top, f"frustum {self.frustum}", "left is not right, bottom not top")
        view, up = np.array(self.view), np.array(self.up)
        across = float(np.linalg.norm(np.cross(up, view)))
        fair = across > 1e-9 * float(np.linalg.norm(up) * np.linalg.norm(view)) > 0
        _check(fair, f"camera looks along {self.view}, up is {self.up}", "directions with a length, not parallel")

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


@dataclass(frozen=True, eq=False)
class ClassicScene:
    """All that a Tachyon or NFF file said.

    ``rules`` names the light model. ``clip_groups`` are arrays ``(k, 4)``: of a primitive in group i, points with
    a x + b y + c z <= d are kept for all its planes (a, b, c, d). ``resolution`` (width, height) is the picture size
    that the file asks for. ``notes`` are the reader's one-line remarks: what it could not honour and what it assumed.
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
            fair = planes.ndim == 2 and planes.shape[1] == 4 and bool(np.isfinite(planes).all())
            _check(fair, f"a clip group of shape {planes.shape}", "rows of four finite numbers")
            planes.setflags(write=False)
        groups, materials = len(self.clip_groups), len(self.materials)
        for batch in self.batches():
            _check(_within(batch.material, 0, materials), f"a {batch.kind} without material", "an index in range")
            _check(_within(batch.clip_group, -1, groups), f"a {batch.kind} without clip group", "an index, or -1")
        for light in self.lights:
            _check(-1 <= light.clip_group < groups, f"a light in clip group {light.clip_group}", "an index, or -1")
        for material in self.materials:
            image = material.texture.image
            _check(image is None or 0 <= image < len(self.images), f"a texture with image {image}", "an index in range")
        _check(min(self.resolution) >= 1, f"resolution {self.resolution}", "at least one pixel")

    def batches(self) -> tuple[Batch, ...]:
        """All batches, empty ones too, in the order of :meth:`counts`."""
        return (self.spheres, self.tubes, self.cylinders, self.rings, self.boxes, self.planes, self.triangles)

    def counts(self) -> dict[str, int]:
        """How many primitives of each kind ('sphere', 'tube', 'cylinder', 'ring', 'box', 'plane', 'triangle')."""
        return {batch.kind: len(batch) for batch in self.batches()}

    def bounds(self) -> Numbers | None:
        """The box ``(2, 3)`` around all finite primitives, before clipping, without lamps; None for none."""
        boxes = [box for box in (batch.bounds() for batch in self.batches()) if box is not None]
        if not boxes:
            return None
        corners = np.stack(boxes)
        return np.stack([corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)])


def _within(indices: NDArray[np.int32], low: int, high: int) -> bool:
    return not len(indices) or bool(indices.min() >= low and indices.max() < high)
