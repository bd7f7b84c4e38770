"""Textures of the classic scenes on the device: functions of the point in space, image maps, lattice noise."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.kernel_ops import upload
from lippmann.device.sobol import hash32
from lippmann.device.types import Bool, Color3f, Float, Point3f, UInt32, Vector3f
from lippmann.device.whitted.intersections import xyz
from lippmann.scene.values.whitted_surfaces import (
    TEXTURE_KINDS,
    ClassicImage,
    ClassicMaterial,
    ClassicTexture,
    TextureKind,
)

_ORANGE, _BLUE = (1.0, 0.2, 0.0), (0.0, 0.2, 1.0)
_GREEN, _BLACK = (0.8, 1.0, 0.2), (0.0, 0.0, 0.0)
#: Share by which distance turns to reduced copies of an image.
_BLUR = 0.05

#: Tachyon's lattice noise: 28^3 whole numbers up to 12000, the same on every machine.
_NOISE_SIDE = 28
_NOISE_SEED = 1234567
_NOISE_MULTIPLIER = 1099087573  # Fishman's, as in fractal_terrain.py
_NOISE_HIGHEST = 12000.0

Texels = NDArray[np.uint8]


class TextureTable:
    """The textures of a scene's materials. ``numbers`` gives each material's, -1 for a constant colour."""

    def __init__(self, materials: Sequence[ClassicMaterial], images: Sequence[ClassicImage]) -> None:
        textures = {m.texture: None for m in materials if m.texture.kind != "constant"}
        places = {texture: number for number, texture in enumerate(textures)}
        self.numbers = [places.get(m.texture, -1) for m in materials]
        self.kinds: list[TextureKind] = sorted({texture.kind for texture in textures}, key=TEXTURE_KINDS.index)
        self.has_images = any(kind.endswith("image") for kind in self.kinds)
        if textures:
            self._rows = upload(np.array([_row(texture) for texture in textures], np.float32))
        if self.has_images:
            self._images = ImageTable(images)
        if {"marble", "noise"} & set(self.kinds):
            self._noise = Noise()

    def color(self, number: UInt32, color: Color3f, p: Point3f, path: Float, active: Bool) -> Color3f:
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

    def _procedure(
        self, name: TextureKind, color: Color3f, p: Point3f, q: Vector3f, scale: Vector3f, active: Bool
    ) -> Color3f:
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
        index: UInt32,
        image: UInt32,
        q: Vector3f,
        scale: Vector3f,
        rotate: Vector3f,
        largest: Float,
        path: Float,
        on: Bool,
    ) -> Color3f:
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
                v = dr.atan2(dr.sqrt(q.x * q.x + q.z * q.z), -q.y) * (1 / pi)
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


def _fraction(x: Float) -> Float:
    return x - dr.floor(x)


def _either(odd: Bool, first: tuple[float, float, float], second: tuple[float, float, float]) -> Color3f:
    return dr.select(odd, mi.Color3f(*first), mi.Color3f(*second))


def _checker(q: Vector3f) -> Color3f:
    cells = mi.Vector3u(*(mi.UInt32(dr.abs(c) * 3 + 0.5) for c in (q.x, q.y, q.z)))
    return _either(((cells.x + cells.y + cells.z) & 1) == 1, _ORANGE, _BLUE)


def _cylindrical_checker(q: Vector3f) -> Color3f:
    u = mi.UInt32(dr.abs(_around(q.x, q.y)) * 18)
    v = mi.UInt32(dr.abs(q.z) * 10)
    return _either(((u + v) & 1) == 1, _ORANGE, _BLUE)


def _wood(q: Vector3f) -> Color3f:
    angle = dr.select(q.z == 0, pi / 2, dr.atan(q.x / q.z))
    radius = dr.sqrt(q.x * q.x + q.z * q.z) + 3 * dr.sin(20 * angle + q.y / 150)
    # Below the first ring all is wood.
    return _either((mi.UInt32(dr.maximum(radius + 0.5, 0)) % 60) < 40, _GREEN, _BLACK)


def _marble(p: Point3f, noise: Float) -> Color3f:
    d = p.x + 0.0006 * noise
    whole = mi.Int32(d)
    d = d * mi.Float(whole - dr.trunc(mi.Float(whole) / 25) * 25)
    shade = dr.clip(0.1 * dr.abs(d - 10 - 20 * (mi.Float(mi.Int32(d)) * 0.05)), 0, 1)
    return mi.Color3f((1 + dr.sin(shade * 6.28)) / 2, (1 + dr.sin(shade * 16.28)) / 2, (1 + dr.cos(shade * 30.28)) / 2)


def _around(x: Float, y: Float) -> Float:
    """Angle in the plane from +x, in turns from 0 to 1."""
    # An arc cosine would lose half the digits near +x and -x, several texels of a large picture.
    turn = dr.atan2(dr.abs(y), x) * (0.5 / pi)
    return dr.select(y < 0, 1 - turn, turn)


def _scatter(p: Point3f) -> Float:
    """A number in [0, 1) that depends on every bit of the point: grit looks random and is always the same."""
    bits = [dr.reinterpret_array(mi.UInt32, mi.Float(c)) for c in (p.x, p.y, p.z)]
    mixed = hash32(bits[0] ^ hash32(bits[1] ^ hash32(bits[2])))
    return mi.Float(mixed >> 20) * (1 / 4096)


def pyramid(texels: Texels) -> list[Texels]:
    """A picture ``(1, h, w, 3)`` and its halved copies down to one texel; a volume alone.

    A texel of a copy is the mean of 2 x 2 texels, rounded down; odd last rows and columns count no more.
    """
    levels = [texels]
    while texels.shape[0] == 1 and max(texels.shape[1:3]) > 1:
        height, width = (max(size // 2, 1) for size in texels.shape[1:3])
        rows, columns = min(texels.shape[1], 2 * height), min(texels.shape[2], 2 * width)
        blocks = (
            texels[0, :rows, :columns].astype(np.uint16).reshape(height, rows // height, width, columns // width, 3)
        )
        texels = (blocks.sum(axis=(1, 3)) // ((rows // height) * (columns // width))).astype(np.uint8)[None]
        levels.append(texels)
    return levels


class ImageTable:
    """The pictures of a scene with their reduced copies in one table on the device, looked up as Tachyon does."""

    def __init__(self, images: Sequence[ClassicImage]) -> None:
        parts: list[NDArray[np.uint32]] = []
        levels: list[tuple[int, int, int, int]] = []
        firsts, counts = [], []
        start = 0
        for image in images:
            copies = pyramid(image.texels)
            firsts.append(len(levels))
            counts.append(len(copies))
            for copy in copies:
                packed = copy.astype(np.uint32) @ np.array([1, 1 << 8, 1 << 16], np.uint32)
                parts.append(packed.ravel().astype(np.uint32))
                depth, height, width = copy.shape[:3]
                levels.append((start, width, height, depth))
                start += len(parts[-1])
        self._texels = upload(np.concatenate(parts))
        self._levels = upload(np.array(levels, np.uint32))
        self._first = upload(np.array(firsts, np.uint32))
        self._count = upload(np.array(counts, np.uint32))
        self._volumes = any(image.texels.shape[0] > 1 for image in images)

    def lookup(self, image: UInt32, u: Float, v: Float, w: Float, reduction: Float, active: Bool) -> Color3f:
        """Colour of ``image`` (number) at u, v, w in [0, 1]; ``reduction`` 0 takes the picture, 1 its smallest copy."""
        first = dr.gather(mi.UInt32, self._first, image, active)
        count = dr.gather(mi.UInt32, self._count, image, active)
        level = dr.clip(reduction, 0, 1) * (mi.Float(count) - 0.9999)
        lower = mi.UInt32(level)
        blends = mi.Int32(lower) < mi.Int32(count) - 2
        lower = dr.select(blends, lower, count - 1)
        upper = dr.select(blends, lower + 1, lower)
        share = dr.select(blends, level - mi.Float(lower), 0)
        a = self._sample(first + lower, u, v, w, active)
        b = self._sample(first + upper, u, v, w, active)
        return a + (b - a) * share

    def _sample(self, level: UInt32, u: Float, v: Float, w: Float, active: Bool) -> Color3f:
        """Between the nearest texels of one copy."""
        start, width, height, depth = (dr.gather(mi.UInt32, self._levels, 4 * level + k, active) for k in range(4))
        (x, fx), (y, fy), (z, fz) = (_place(c, size) for c, size in ((u, width), (v, height), (w, depth)))
        next_x = dr.minimum(x + 1, width - 1)
        next_y = dr.minimum(y + 1, height - 1)
        next_z = dr.minimum(z + 1, depth - 1)

        def texel(column: UInt32, row: UInt32, layer: UInt32) -> Color3f:
            packed = dr.gather(mi.UInt32, self._texels, start + (layer * height + row) * width + column, active)
            return mi.Color3f(packed & 255, (packed >> 8) & 255, packed >> 16)

        def layer_color(layer: UInt32) -> Color3f:
            lower = _mix(texel(x, y, layer), texel(next_x, y, layer), fx)
            upper = _mix(texel(x, next_y, layer), texel(next_x, next_y, layer), fx)
            return _mix(lower, upper, fy)

        color = layer_color(z)
        if self._volumes:
            color = _mix(color, layer_color(next_z), fz)
        return color * (1 / 255)


def _place(coordinate: Float, size: UInt32) -> tuple[UInt32, Float]:
    """Texel below a coordinate in [0, 1], and the way to the next one."""
    place = coordinate * (mi.Float(size) - 1)
    below = dr.minimum(mi.UInt32(place), size - 1)
    return below, place - mi.Float(below)


def _mix(a: Color3f, b: Color3f, share: Float) -> Color3f:
    return a + (b - a) * share


def lattice() -> NDArray[np.int32]:
    """The values of the noise ``(28^3 + 28^2 + 28 + 2,)``, z fastest.

    The last layer of each axis repeats the first. Beyond the end, where interpolation in the last layer reads, the last
    value stands in.
    """
    count = _NOISE_SIDE**3
    uniform = np.empty(count)
    state = _NOISE_SEED
    for number in range(count):
        state = state * _NOISE_MULTIPLIER % 2**32
        uniform[number] = state / 2**32
    values = (uniform * _NOISE_HIGHEST).astype(np.int32).reshape(_NOISE_SIDE, _NOISE_SIDE, _NOISE_SIDE)
    for axis in range(3):
        np.moveaxis(values, axis, 0)[-1] = np.moveaxis(values, axis, 0)[0]
    flat = values.ravel()
    return np.concatenate([flat, np.full(_NOISE_SIDE**2 + _NOISE_SIDE + 2, flat[-1])]).astype(np.int32)


class Noise:
    """Tachyon's lattice noise on the device."""

    def __init__(self) -> None:
        self._values = upload(lattice())

    def at(self, p: Point3f, active: Bool) -> Float:
        """Noise at points: whole numbers from 0 to 12000, mirrored about the planes through the origin.

        Cells join up along z into the next row, as they lie in memory; each step of the interpolation is cut to a
        whole number.
        """
        p = dr.abs(p)
        whole = mi.Vector3u(mi.UInt32(p.x), mi.UInt32(p.y), mi.UInt32(p.z))
        share = p - mi.Vector3f(whole)
        cell = (whole.x % _NOISE_SIDE * _NOISE_SIDE + whole.y % _NOISE_SIDE) * _NOISE_SIDE + whole.z % _NOISE_SIDE

        def value(x: int, y: int, z: int) -> Float:
            return dr.gather(mi.Int32, self._values, cell + (x * _NOISE_SIDE + y) * _NOISE_SIDE + z, active)

        def between(a: Float, b: Float, part: Float) -> Float:
            return a + mi.Int32(mi.Float(b - a) * part)

        along_x = [[between(value(0, y, z), value(1, y, z), share.x) for z in (0, 1)] for y in (0, 1)]
        along_y = [between(along_x[0][z], along_x[1][z], share.y) for z in (0, 1)]
        return mi.Float(between(along_y[0], along_y[1], share.z))
