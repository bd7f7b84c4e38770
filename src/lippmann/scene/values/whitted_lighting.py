"""Light sources, sky light, background, fog and shading of Whitted-style scenes, as plain values."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from lippmann.scene.values.whitted_numbers import Color, Vector, check, check_finite


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
