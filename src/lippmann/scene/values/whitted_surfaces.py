"""Images, textures and materials of Whitted-style scenes, as plain values."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.values.whitted_numbers import Color, Vector, check, check_finite

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
