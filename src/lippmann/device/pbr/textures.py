"""Pictures on the device: each is uploaded once per use of its channels, and looked up by every material.

A :class:`Signal` is a factor times a lookup, either of which may be absent; texels are as glTF's samplers say.
Materials that are alike but for their numbers and pictures form a family with one plugin. Which member a triangle has,
it says by a mesh attribute.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import decode_srgb
from lippmann.device.types import (
    Array,
    Bool,
    Color3f,
    DeviceTexture,
    Float,
    FloatOrColor,
    Point2f,
    SurfaceInteraction3f,
    UInt32,
    Vector3f,
)
from lippmann.scene.values.description import Filter, Image, Texture, Wrap

#: Mesh attributes that carry a triangle's member number, and vertex colours with their alpha.
MEMBER_ATTRIBUTE, COLOR_ATTRIBUTE, ALPHA_ATTRIBUTE = "face_member", "vertex_color", "vertex_alpha"
#: Mesh attribute that carries tangents: see :mod:`lippmann.device.pbr.tangents`.
TANGENT_ATTRIBUTE = "vertex_tangent"


def uv_attribute(uv_set: int) -> str:
    """Mesh attribute that carries a uv set beyond the mesh's own: u and v in the first two of three channels."""
    return f"vertex_uv{uv_set}"


class Place:
    """A surface point (``mi.SurfaceInteraction3f``), with what its mesh says there looked up once."""

    def __init__(self, si: SurfaceInteraction3f, active: Bool) -> None:
        self.si = si
        self.active = active
        self._cache: dict[str, Array] = {}

    @property
    def member(self) -> UInt32:
        """Number in the family (UInt32)."""
        import mitsuba as mi

        return self.once(
            MEMBER_ATTRIBUTE,
            lambda: mi.UInt32(self.si.shape.eval_attribute_1(MEMBER_ATTRIBUTE, self.si, self.active) + 0.5),
        )

    @property
    def color(self) -> Color3f:
        """Vertex colour; grey on slivers, within which Mitsuba's single precision finds no place (3.9: NaN)."""
        import drjit as dr

        color = self.si.shape.eval_attribute_3(COLOR_ATTRIBUTE, self.si, self.active)
        return dr.select(dr.isfinite(color), color, 0.5)

    @property
    def alpha(self) -> Float:
        """Vertex alpha; 1 on slivers."""
        import drjit as dr

        alpha = self.si.shape.eval_attribute_1(ALPHA_ATTRIBUTE, self.si, self.active)
        return dr.select(dr.isfinite(alpha), alpha, 1)

    @property
    def tangent(self) -> Vector3f:
        """The mesh's own tangent, as its attribute has it."""
        return self.si.shape.eval_attribute_3(TANGENT_ATTRIBUTE, self.si, self.active)

    def uv(self, attribute: str | None) -> Point2f:
        """Texture coordinates: the mesh's own, or those in an attribute."""
        import mitsuba as mi

        if attribute is None:
            return self.si.uv
        carried = self.once(attribute, lambda: self.si.shape.eval_attribute_3(attribute, self.si, self.active))
        return mi.Point2f(carried.x, carried.y)

    def once(self, key: str, look_up: Callable[[], Array]) -> Array:
        """What ``look_up`` returns, which is called for the first of all that ask for ``key``."""
        if key not in self._cache:
            self._cache[key] = look_up()
        return self._cache[key]


# The classes below are dataclasses so that Dr.Jit finds the arrays in them when it records or freezes a function.


@dataclass(eq=False)
class Table:
    """One value per member: ``channels`` numbers each, in a row."""

    values: FloatOrColor
    channels: int = 1

    def at(self, place: Place) -> FloatOrColor:
        import drjit as dr
        import mitsuba as mi

        kind = mi.Color3f if self.channels == 3 else type(self.values)
        return dr.gather(kind, self.values, place.member, place.active)


def numbers(values: Sequence[float] | NDArray[np.float64]) -> Table | FloatOrColor:
    """A factor of one member, or a table of several: ``(n,)`` scalars or ``(n, 3)`` colours.

    Kernels read them as data, so that materials of the same make share one kernel.
    """
    import drjit as dr
    import mitsuba as mi

    array = np.asarray(values, dtype=np.float32)
    if len(array) > 1:
        return Table(mi.Float(array.ravel()), 3 if array.ndim == 2 else 1)
    if array.ndim == 2:
        return mi.Color3f(*(dr.opaque(mi.Float, float(value)) for value in array[0]))
    return dr.opaque(mi.Float, float(array[0]))


def _at(value: Table | FloatOrColor, place: Place) -> FloatOrColor:
    return value.at(place) if isinstance(value, Table) else value


@dataclass(eq=False)
class Sampler:
    """How a texture is looked at: ``transform`` holds the upper rows of the matrix on (u, v, 1), None for identity."""

    wraps: tuple[Wrap, Wrap]
    filter: Filter
    attribute: str | None
    transform: tuple[Table | Float, ...] | None

    def uv(self, place: Place) -> Point2f:
        """Coordinates after the transform, not yet wrapped."""
        import drjit as dr
        import mitsuba as mi

        uv = place.uv(self.attribute)
        if self.transform is None:
            return uv
        a, b, c, d, e, f = (_at(value, place) for value in self.transform)
        return mi.Point2f(dr.fma(a, uv.x, dr.fma(b, uv.y, c)), dr.fma(d, uv.x, dr.fma(e, uv.y, f)))


def _fold(x: Float, wrap: Wrap, texels: Float) -> Float:
    """Bring a coordinate into [0, 1] so that a lookup that repeats beyond it sees what ``wrap`` asks for.

    Half a texel from a border, interpolation sees the border texel alone: what clamping and mirroring mean there.
    """
    import drjit as dr

    if wrap == "repeat":
        return x - dr.floor(x)
    if wrap == "mirror":
        x = 1 - dr.abs(x - 2 * dr.floor(x * 0.5) - 1)
    margin = 0.5 / texels
    return dr.clip(x, margin, 1 - margin)


@dataclass(eq=False)
class Bitmap:
    """One picture for all: a texture of :func:`_upload`, which repeats where the wrap modes of the axes differ.

    ``channel`` is the one of a texture of three channels that is shown, such as the roughness beside the metalness;
    None for all of the texture.
    """

    texture: DeviceTexture
    channels: int
    sampler: Sampler
    size: tuple[int, int]
    channel: int | None = None

    def eval(self, place: Place) -> FloatOrColor:
        """``Color3f`` or ``Float``, by the number of channels shown."""
        if self.channel is None:
            return self._look_up(place)
        return place.once(f"{id(self.texture)} {id(self.sampler)}", lambda: self._look_up(place))[self.channel]

    def _look_up(self, place: Place) -> FloatOrColor:
        import mitsuba as mi

        uv = self.sampler.uv(place)
        wraps = self.sampler.wraps
        if wraps[0] != wraps[1]:
            uv = mi.Point2f(*(_fold(uv[axis], wraps[axis], self.size[axis]) for axis in range(2)))
        values = self.texture.eval(uv, place.active)
        return mi.Color3f(*values[:3]) if self.channels == 3 else values[0]


@dataclass(eq=False)
class TexelPool:
    """The texels of many pictures in one row, four 8-bit channels to a number; ``linear`` decodes sRGB codes."""

    texels: UInt32
    linear: Float


@dataclass(eq=False)
class PooledBitmap:
    """A picture for each member of a family, all of one sampler: ``first`` texel in the pool and size of each."""

    pool: TexelPool
    first: Table
    width: Table
    height: Table
    channels: tuple[int, ...]
    coded: bool
    sampler: Sampler

    def eval(self, place: Place) -> FloatOrColor:
        """``Color3f`` or ``Float``, by the number of channels shown."""
        import drjit as dr
        import mitsuba as mi

        sizes = self.width.at(place), self.height.at(place)
        uv = self.sampler.uv(place)
        x, y = (_fold(uv[axis], self.sampler.wraps[axis], sizes[axis]) * sizes[axis] for axis in range(2))
        if self.sampler.filter == "nearest":
            return self._texel(dr.minimum(dr.floor(x), sizes[0] - 1), dr.minimum(dr.floor(y), sizes[1] - 1), place)
        x, y = x - 0.5, y - 0.5
        left, top = dr.floor(x), dr.floor(y)
        share = mi.Point2f(x - left, y - top)
        left, right = dr.select(left < 0, left + sizes[0], left), dr.select(left + 1 >= sizes[0], 0, left + 1)
        top, bottom = dr.select(top < 0, top + sizes[1], top), dr.select(top + 1 >= sizes[1], 0, top + 1)
        upper = dr.lerp(self._texel(left, top, place), self._texel(right, top, place), share.x)
        lower = dr.lerp(self._texel(left, bottom, place), self._texel(right, bottom, place), share.x)
        return dr.lerp(upper, lower, share.y)

    def _texel(self, column: Float, row: Float, place: Place) -> FloatOrColor:
        import drjit as dr
        import mitsuba as mi

        index = self.first.at(place) + mi.UInt32(row) * mi.UInt32(self.width.at(place)) + mi.UInt32(column)
        packed = dr.gather(mi.UInt32, self.pool.texels, index, place.active)
        codes = [(packed >> (8 * channel)) & 255 for channel in self.channels]
        if self.coded:
            values = [dr.gather(mi.Float, self.pool.linear, code, place.active) for code in codes]
        else:
            values = [mi.Float(code) * (1 / 255) for code in codes]
        return mi.Color3f(*values) if len(values) == 3 else values[0]


Lookup = Bitmap | PooledBitmap


@dataclass(eq=False)
class Signal:
    """``factor`` times ``lookup`` at a surface point; None stands for 1. Both are never None."""

    factor: Table | FloatOrColor | None
    lookup: Lookup | None = None

    def eval(self, place: Place) -> FloatOrColor:
        factor = _at(self.factor, place)
        if self.lookup is None:
            return factor
        value = self.lookup.eval(place)
        return value if factor is None else value * factor

    def may_be_below(self, least: float) -> bool:
        """Whether a number may be less than ``least`` somewhere."""
        if self.lookup is not None:
            return True
        values = self.factor.values if isinstance(self.factor, Table) else self.factor
        return bool((np.array(values) < least).any())

    @property
    def follows_uv_only(self) -> bool:
        """Whether texture coordinates are all that the value depends on, the mesh's attributes nothing."""
        if isinstance(self.factor, Table) or isinstance(self.lookup, PooledBitmap):
            return False
        return self.lookup is None or self.lookup.sampler.attribute is None


#: Which mesh attribute carries a uv set; sets that are not in it are the mesh's own.
UvAttributes = Mapping[int, str]
#: One texture per member of a family.
Textures = Sequence["Texture | None"]


class TextureStore:
    """Uploads pictures and remembers them, so that materials that share one share its memory.

    Call :meth:`finish` once all signals are asked for.
    """

    def __init__(self) -> None:
        self._bitmaps: dict[tuple[object, ...], DeviceTexture] = {}
        self._samplers: dict[tuple[object, ...], Sampler] = {}
        self._tables: dict[str, DeviceTexture] = {}
        self._constants: dict[tuple[object, ...], NDArray[np.float64] | None] = {}
        self._images: dict[int, Image] = {}  # keeps them alive, so that their ids stay theirs
        self._pool = TexelPool(None, None)
        self._pooled: dict[int, int] = {}  # first texel of each picture in the pool
        self._pool_size = 0

    def color(self, textures: Textures, factors: NDArray[np.float64], uv: UvAttributes) -> Signal:
        """An RGB signal; ``factors`` is ``(members, 3)``."""
        return self._signal(textures, (0, 1, 2), factors, uv)

    def channel(self, textures: Textures, channel: int, factors: NDArray[np.float64], uv: UvAttributes) -> Signal:
        """A scalar signal from one channel, 0 red to 3 alpha; ``factors`` is ``(members,)``. A missing alpha is 1."""
        return self._signal(textures, (channel,), factors, uv)

    def normals(self, textures: Textures, uv: UvAttributes) -> Lookup:
        """The lookup of normal maps."""
        return self._lookup(textures, (0, 1, 2), uv)

    def table(self, name: str, make: Callable[[], NDArray[np.float32]]) -> DeviceTexture:
        """A function over the unit square, sampled at texel centres: ``make`` gives ``(rows, columns, 1 or 3)``."""
        if name not in self._tables:
            self._tables[name] = _upload(make(), coded=False, filtering="linear", wrap="clamp")
        return self._tables[name]

    def constant(self, texture: Texture | None, channels: tuple[int, ...]) -> NDArray[np.float64] | None:
        """The texels' linear value if all are alike (1 without a texture), else None."""
        if texture is None:
            return np.ones(len(channels))
        image = texture.image
        if channels == (3,) and image.pixels.shape[2] != 4:
            return np.ones(1)
        key = (self._identity(image), channels, texture.srgb)
        if key not in self._constants:
            self._constants[key] = None
            for pixels in (image.pixels[:1], image.pixels):  # the first row tells most pictures
                texels = _channels_of(pixels, channels).reshape(-1, len(channels))
                if (texels != texels[0]).any():
                    break
            else:
                value = texels[0] / 255.0 if texels.dtype == np.uint8 else texels[0].astype(np.float64)
                self._constants[key] = decode_srgb(value) if _is_coded(texture, channels) else np.asarray(value)
        return self._constants[key]

    def finish(self) -> None:
        """Upload the pool."""
        import mitsuba as mi

        if self._pooled:
            self._pool.texels = mi.UInt32(np.concatenate([_pack_texels(self._images[key]) for key in self._pooled]))
            self._pool.linear = mi.Float(decode_srgb(np.arange(256) / 255).astype(np.float32))

    def _signal(
        self, textures: Textures, channels: tuple[int, ...], factors: NDArray[np.float64], uv: UvAttributes
    ) -> Signal:
        factors = np.asarray(factors, dtype=np.float64)
        constants = [self.constant(texture, channels) for texture in textures]
        known = [constant for constant in constants if constant is not None]
        if len(known) == len(constants):
            return Signal(numbers(factors * np.reshape(known, factors.shape)))
        return Signal(None if np.all(factors == 1) else numbers(factors), self._lookup(textures, channels, uv))

    def _lookup(self, textures: Textures, channels: tuple[int, ...], uv: UvAttributes) -> Lookup:
        given = [texture for texture in textures if texture is not None]
        assert len(given) == len(textures)
        first = given[0]
        matrices = np.array([np.asarray(texture.uv_transform, dtype=np.float64)[:2].ravel() for texture in given])
        sampler = Sampler(
            wraps=(first.wrap_u, first.wrap_v),
            filter=first.filter,
            attribute=uv.get(first.uv_set),
            transform=None if (matrices == np.eye(3)[:2].ravel()).all() else tuple(numbers(row) for row in matrices.T),
        )
        if all(texture is first for texture in given) or len({texture_key(texture) for texture in given}) == 1:
            sampler.transform = None if sampler.transform is None else tuple(numbers([x]) for x in matrices[0])
            # One for all lookups of a texture, which are then one.
            key = (texture_key(first), sampler.attribute)
            return self._bitmap(first, channels, self._samplers.setdefault(key, sampler))
        return self._pooled_bitmap(given, channels, sampler)

    def _bitmap(self, texture: Texture, channels: tuple[int, ...], sampler: Sampler) -> Bitmap:
        wrap = texture.wrap_u if texture.wrap_u == texture.wrap_v else "repeat"
        coded, pixels = _is_coded(texture, channels), texture.image.pixels
        (height, width, depth), channel = pixels.shape, None
        if len(channels) == 1 and channels[0] < 3 <= depth and pixels.dtype == np.uint8:
            channel, channels = channels[0], (0, 1, 2)
        key = (self._identity(texture.image), channels, coded, texture.filter, wrap)
        if key not in self._bitmaps:
            self._bitmaps[key] = _upload(_channels_of(pixels, channels), coded, texture.filter, wrap)
        return Bitmap(self._bitmaps[key], len(channels), sampler, (width, height), channel)

    def _pooled_bitmap(self, textures: Sequence[Texture], channels: tuple[int, ...], sampler: Sampler) -> PooledBitmap:
        import mitsuba as mi

        for texture in textures:
            key = self._identity(texture.image)
            if key not in self._pooled:
                self._pooled[key] = self._pool_size
                self._pool_size += texture.image.pixels.shape[0] * texture.image.pixels.shape[1]
        sizes = np.array([texture.image.pixels.shape[:2] for texture in textures], dtype=np.float32)
        first = np.array([self._pooled[id(texture.image)] for texture in textures], dtype=np.uint32)
        return PooledBitmap(
            pool=self._pool,
            first=Table(mi.UInt32(first)),
            width=Table(mi.Float(sizes[:, 1])),
            height=Table(mi.Float(sizes[:, 0])),
            channels=channels,
            coded=_is_coded(textures[0], channels),
            sampler=sampler,
        )

    def _identity(self, image: Image) -> int:
        self._images[id(image)] = image
        return id(image)


def texture_key(texture: Texture) -> tuple[object, ...]:
    """Equal for textures that show the same picture in the same way."""
    return (id(texture.image), np.asarray(texture.uv_transform).tobytes(), *sampler_key(texture))


def sampler_key(texture: Texture) -> tuple[object, ...]:
    """Equal for textures that differ in picture and transform only."""
    return (texture.srgb, texture.wrap_u, texture.wrap_v, texture.filter, texture.uv_set)


def _upload(texels: NDArray[np.generic], coded: bool, filtering: str, wrap: str) -> DeviceTexture:
    """The texture of texels ``(h, w, 1 | 3)``: linear values, or where ``coded`` sRGB codes, decoded when looked up.

    Dr.Jit's own. Mitsuba's ``bitmap`` takes the mean of its texels, decoded, and gives them a fourth channel in a
    kernel: with two pictures of 2048 x 2048 texels that was a thirtieth of a small render.
    """
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.kernel_ops import upload

    if coded and texels.dtype != np.uint8:
        texels, coded = decode_srgb(texels).astype(np.float32), False
    height, width, channels = texels.shape
    packed = np.zeros((height, width, 4 if channels == 3 else channels), texels.dtype)
    for channel in range(channels):  # NumPy is slow over an axis of three
        packed[..., channel] = texels[..., channel]
    modes = {
        "filter_mode": dr.FilterMode.Nearest if filtering == "nearest" else dr.FilterMode.Linear,
        "wrap_mode": {"repeat": dr.WrapMode.Repeat, "mirror": dr.WrapMode.Mirror}.get(wrap, dr.WrapMode.Clamp),
    }
    if packed.dtype == np.uint8:
        return mi.Texture2f8u(mi.TensorXu8(upload(packed), packed.shape), srgb=coded, **modes)
    return mi.Texture2f(mi.TensorXf(upload(packed), packed.shape), **modes)


def _is_coded(texture: Texture, channels: tuple[int, ...]) -> bool:
    return texture.srgb and channels != (3,)  # alpha is never sRGB-coded


def _channels_of(pixels: NDArray[np.generic], channels: tuple[int, ...]) -> NDArray[np.generic]:
    """``(h, w, len(channels))`` uint8 or float32; grey serves as red, green and blue."""
    pixels = pixels if pixels.dtype == np.uint8 else pixels.astype(np.float32, copy=False)
    grey = pixels.shape[2] < 3
    chosen = [0 if grey and channel < 3 else channel for channel in channels]
    # Packed, as Mitsuba wants them: pixels[..., chosen] would be a transposed array, which has to be copied again.
    return pixels if chosen == [*range(pixels.shape[2])] else np.take(pixels, chosen, axis=2)


def _pack_texels(image: Image) -> NDArray[np.uint32]:
    """Texels of an 8-bit picture, red in the lowest byte; what is missing is full."""
    texels = np.full((*image.pixels.shape[:2], 4), 255, np.uint8)
    colors = image.pixels.shape[2]
    texels[..., :3] = image.pixels[..., : min(colors, 3)]
    if colors == 4:
        texels[..., 3] = image.pixels[..., 3]
    return texels.view("<u4").ravel()
