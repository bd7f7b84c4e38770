"""Textures, materials, lights and backgrounds of Whitted-style scenes, as plain values; checks of their numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError

Vector = tuple[float, float, float]
Color = tuple[float, float, float]


def check(valid: bool, what: str, rule: str) -> None:
    """Raise :class:`SceneError` unless ``valid``."""
    if not valid:
        raise SceneError(what, rule=rule)


def check_finite(name: str, *values: float) -> None:
    """Raise :class:`SceneError` if one of the numbers called ``name`` is not finite."""
    for value in values:
        check(math.isfinite(value), f"{name} is {value}", "numbers are finite")


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
TEXTURE_KINDS: tuple[TextureKind, ...] = get_args(TextureKind)
"""Texture kinds in the order of Tachyon's TEXFUNC numbers 0 to 10."""


@dataclass(frozen=True, eq=False)
class ClassicImage:
    """Texels ``(depth, height, width, 3)`` uint8, indexed ``[w, v, u]``; row 0 is v = 0. A picture has depth 1.

    The values mean value / 255, without any transfer curve. Which row of a picture file is row 0 is settled by the
    reader (the top row for PPM and JPEG, the bottom row for TGA and PNG, as Tachyon does).
    """

    name: str
    texels: NDArray[np.uint8]

    def __post_init__(self) -> None:
        valid = self.texels.ndim == 4 and self.texels.shape[3] == 3 and self.texels.dtype == np.uint8
        check(valid and self.texels.size > 0, f"image '{self.name}' is no RGB picture or volume", "")
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
            check_finite(f"texture {name}", *getattr(self, name))
        check(self.kind in TEXTURE_KINDS, f"texture kind '{self.kind}' is unknown", f"one of {TEXTURE_KINDS}")
        check(
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
        check_finite("a material's color", *self.color)
        for name in ("ambient", "diffuse", "specular", "opacity", "phong", "phong_size", "outline", "outline_width"):
            check_finite(f"a material's {name}", getattr(self, name))
        check(self.phong_size >= 0, f"phong_size is {self.phong_size}", "an exponent is 0 or more")
        check(math.isfinite(self.ior) and self.ior > 0, f"ior is {self.ior}", "an index of refraction is positive")


@dataclass(frozen=True)
class ClassicLight:
    """A light source. ``center`` and ``radius`` (point, spot): an emissive sphere, invisible of radius 0.

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
        check_finite("a light's color", *self.color)
        check_finite("a light's center", *self.center)
        check_finite("a light's falloff", self.falloff_start, self.falloff_end)
        check(math.isfinite(self.radius) and self.radius >= 0, f"a light's radius is {self.radius}", "0 or more")
        check(abs(math.hypot(*self.direction) - 1.0) < 1e-6, f"direction {self.direction}", "a unit vector")
        if self.attenuation is not None:
            valid = all(math.isfinite(k) and k >= 0 for k in self.attenuation) and any(self.attenuation)
            check(valid, f"attenuation {self.attenuation}", "factors are 0 or more and not all 0")


@dataclass(frozen=True)
class AmbientOcclusion:
    """Sky light: ``samples`` random rays over the hemisphere, of ``color``, added to the diffuse light."""

    samples: int
    color: Color = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        check(self.samples >= 1, f"{self.samples} samples of ambient occlusion", "1 or more")
        check_finite("ambient occlusion color", *self.color)


@dataclass(frozen=True)
class Background:
    """Colour of rays that hit nothing.

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
        check_finite("background", *self.color, *self.up, *self.top_color, *self.bottom_color)
        check_finite("background gradient", self.top_value, self.bottom_value)
        check(self.top_value != self.bottom_value, f"a gradient from {self.top_value} to itself", "two values")


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
        check_finite("fog", self.start, self.end, self.density, *self.color)
        check(self.kind != "linear" or self.start != self.end, f"fog from {self.start} to itself", "start is not end")


@dataclass(frozen=True)
class Shading:
    """Shading options of the whole scene.

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
        check_finite("light_scale", self.light_scale)
        valid = self.max_transparent_surfaces is None or self.max_transparent_surfaces >= 0
        check(valid, f"max_transparent_surfaces is {self.max_transparent_surfaces}", "0 or more")
