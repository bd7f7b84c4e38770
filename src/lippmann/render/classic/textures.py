"""Texture functions of the classic scenes on the device: colours as functions of the point in space."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.render.classic.crossings import xyz
from lippmann.render.classic.images import ImageTable
from lippmann.render.classic.noise import Noise
from lippmann.render.sampling import hash32
from lippmann.scene.classic import TEXTURE_KINDS, ClassicImage, ClassicMaterial, ClassicTexture, TextureKind

_ORANGE, _BLUE = (1.0, 0.2, 0.0), (0.0, 0.2, 1.0)
_GREEN, _BLACK = (0.8, 1.0, 0.2), (0.0, 0.0, 0.0)
#: Share by which distance turns to reduced copies of an image.
_BLUR = 0.05


class TextureTable:
    """The textures of a scene's materials. ``numbers`` gives each material's, -1 for a constant colour."""

    def __init__(self, materials: Sequence[ClassicMaterial], images: Sequence[ClassicImage]) -> None:
        textures = {m.texture: None for m in materials if m.texture.kind != "constant"}
        places = {texture: number for number, texture in enumerate(textures)}
        self.numbers = [places.get(m.texture, -1) for m in materials]
        self.kinds: list[TextureKind] = sorted({texture.kind for texture in textures}, key=TEXTURE_KINDS.index)
        self.has_images = any(kind.endswith("image") for kind in self.kinds)
        if textures:
            self._rows = mi.Float(np.array([_row(texture) for texture in textures], np.float32).ravel())
        if self.has_images:
            self._images = ImageTable(images)
        if {"marble", "noise"} & set(self.kinds):
            self._noise = Noise()

    def color(self, number: Any, color: Any, p: Any, path: Any, active: Any) -> Any:
        """Colour at ``p`` of texture ``number`` (Int32, -1: ``color`` itself); ``path`` is the way the ray has come."""
        if not self.kinds:
            return color
        active = active & (number >= 0)
        index = mi.UInt32(number)
        a, b, c = (dr.gather(mi.Vector4f, self._rows, 6 * index + part, active) for part in range(3))
        center, kind, scale, image, rotate, largest = xyz(a), a.w, xyz(b), mi.UInt32(b.w), xyz(c), c.w
        q = p - center
        for name in self.kinds:
            this = active & (kind == float(TEXTURE_KINDS.index(name)))
            if name.endswith("image"):
                value = self._image(name, index, image, q, scale, rotate, largest, path, this)
            else:
                value = self._procedure(name, color, p, q, scale, this)
            color = dr.select(this, value, color)
        return color

    def _procedure(self, name: TextureKind, color: Any, p: Any, q: Any, scale: Any, active: Any) -> Any:
        if name == "checker":
            return _checker(q)
        if name == "cylindrical-checker":
            return _cylindrical_checker(q)
        if name == "wood":
            return _wood(q / scale)
        if name == "grit":
            return color * (0.8 + 0.2 * _scatter(p))
        if name == "marble":
            return _marble(p, self._noise.at(p, active))
        return color * dr.clip(self._noise.at(q, active), 0.01, 1)

    def _image(
        self,
        name: TextureKind,
        index: Any,
        image: Any,
        q: Any,
        scale: Any,
        rotate: Any,
        largest: Any,
        path: Any,
        on: Any,
    ) -> Any:
        reduction = _BLUR * path * largest
        w = mi.Float(0)
        if name in ("planar-image", "volume-image"):
            u_axis, v_axis = (xyz(dr.gather(mi.Vector4f, self._rows, 6 * index + part, on)) for part in (3, 4))
            u, v = dr.dot(u_axis, q), dr.dot(v_axis, q)
            if name == "volume-image":
                w_axis = xyz(dr.gather(mi.Vector4f, self._rows, 6 * index + 5, on))
                w = _fraction(dr.dot(w_axis, q) * scale.z + rotate.z)
        else:
            reduction /= 8 * dr.norm(q)
            u, v = _around(q.x, q.z), q.y
            if name == "spherical-image":
                v = dr.safe_acos(-q.y / dr.norm(q)) * (1 / pi)
        u, v = _fraction(u * scale.x + rotate.x), _fraction(v * scale.y + rotate.y)
        return self._images.lookup(image, u, v, w, reduction, on)


def _row(texture: ClassicTexture) -> list[float]:
    sizes = texture.scale if texture.kind == "volume-image" else texture.scale[:2]
    image = 0 if texture.image is None else texture.image
    return [
        *texture.center,
        TEXTURE_KINDS.index(texture.kind),
        *texture.scale,
        image,
        *texture.rotate,
        max(abs(size) for size in sizes),
        *(number for axis in (texture.u_axis, texture.v_axis, texture.w_axis) for number in (*axis, 0.0)),
    ]


def _fraction(x: Any) -> Any:
    return x - dr.floor(x)


def _either(odd: Any, first: tuple[float, float, float], second: tuple[float, float, float]) -> Any:
    return dr.select(odd, mi.Color3f(*first), mi.Color3f(*second))


def _checker(q: Any) -> Any:
    cells = mi.Vector3u(*(mi.UInt32(dr.abs(c) * 3 + 0.5) for c in (q.x, q.y, q.z)))
    return _either(((cells.x + cells.y + cells.z) & 1) == 1, _ORANGE, _BLUE)


def _cylindrical_checker(q: Any) -> Any:
    u = mi.UInt32(dr.abs(_around(q.x, q.y)) * 18)
    v = mi.UInt32(dr.abs(q.z) * 10)
    return _either(((u + v) & 1) == 1, _ORANGE, _BLUE)


def _wood(q: Any) -> Any:
    angle = dr.select(q.z == 0, pi / 2, dr.atan(q.x / q.z))
    radius = dr.sqrt(q.x * q.x + q.z * q.z) + 3 * dr.sin(20 * angle + q.y / 150)
    # Below the first ring all is wood.
    return _either((mi.UInt32(dr.maximum(radius + 0.5, 0)) % 60) < 40, _GREEN, _BLACK)


def _marble(p: Any, noise: Any) -> Any:
    d = p.x + 0.0006 * noise
    whole = mi.Int32(d)
    d = d * mi.Float(whole - dr.trunc(mi.Float(whole) / 25) * 25)
    shade = dr.clip(0.1 * dr.abs(d - 10 - 20 * (mi.Float(mi.Int32(d)) * 0.05)), 0, 1)
    return mi.Color3f((1 + dr.sin(shade * 6.28)) / 2, (1 + dr.sin(shade * 16.28)) / 2, (1 + dr.cos(shade * 30.28)) / 2)


def _around(x: Any, y: Any) -> Any:
    """Angle in the plane from +x, in turns from 0 to 1."""
    turn = dr.safe_acos(x * dr.rsqrt(x * x + y * y)) * (0.5 / pi)
    return dr.select(y < 0, 1 - turn, turn)


def _scatter(p: Any) -> Any:
    """A number in [0, 1) that depends on every bit of the point: grit looks random and is always the same."""
    bits = [dr.reinterpret_array(mi.UInt32, mi.Float(c)) for c in (p.x, p.y, p.z)]
    mixed = hash32(bits[0] ^ hash32(bits[1] ^ hash32(bits[2])))
    return mi.Float(mixed >> 20) * (1 / 4096)
