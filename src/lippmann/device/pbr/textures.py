"""Pictures on the device: each is uploaded once per use of its channels, and looked up by every material."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import decode_srgb
from lippmann.device.pbr.texture_lookup import Bitmap, Lookup, PooledBitmap, Sampler, Signal, Table, TexelPool, numbers
from lippmann.device.types import MitsubaTexture
from lippmann.scene.values.description import Image, Texture

#: Which mesh attribute carries a uv set; sets that are not in it are the mesh's own.
UvAttributes = Mapping[int, str]
#: One texture per member of a family.
Textures = Sequence["Texture | None"]


class TextureStore:
    """Uploads pictures and remembers them, so that materials that share one share its memory.

    Call :meth:`finish` once all signals are asked for.
    """

    def __init__(self) -> None:
        self._bitmaps: dict[tuple[object, ...], MitsubaTexture] = {}
        self._tables: dict[str, MitsubaTexture] = {}
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

    def table(self, name: str, make: Callable[[], NDArray[np.float32]]) -> MitsubaTexture:
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
            texels = _channels_of(image, channels).reshape(-1, len(channels))
            self._constants[key] = None
            if (texels[:256] == texels[0]).all() and (texels == texels[0]).all():
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
            return self._bitmap(first, channels, sampler)
        return self._pooled_bitmap(given, channels, sampler)

    def _bitmap(self, texture: Texture, channels: tuple[int, ...], sampler: Sampler) -> Bitmap:
        wrap = texture.wrap_u if texture.wrap_u == texture.wrap_v else "repeat"
        coded = _is_coded(texture, channels)
        key = (self._identity(texture.image), channels, coded, texture.filter, wrap)
        if key not in self._bitmaps:
            self._bitmaps[key] = _upload(_channels_of(texture.image, channels), coded, texture.filter, wrap)
        height, width = texture.image.pixels.shape[:2]
        return Bitmap(self._bitmaps[key], len(channels), sampler, (width, height))

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


def _upload(texels: NDArray[np.generic], coded: bool, filtering: str, wrap: str) -> MitsubaTexture:
    import mitsuba as mi

    if coded and texels.dtype != np.uint8:
        texels = decode_srgb(texels).astype(np.float32)
    for axis in range(2):  # Mitsuba asks for two texels per axis; a repeated one changes no lookup
        if texels.shape[axis] == 1:
            texels = np.repeat(texels, 2, axis=axis)
    return mi.load_dict(
        {
            "type": "bitmap",
            "bitmap": mi.Bitmap(np.require(texels, requirements=["C", "W"])),  # it refuses read-only arrays
            "raw": not (coded and texels.dtype == np.uint8),
            "filter_type": "nearest" if filtering == "nearest" else "bilinear",
            "wrap_mode": wrap,
        }
    )


def _is_coded(texture: Texture, channels: tuple[int, ...]) -> bool:
    return texture.srgb and channels != (3,)  # alpha is never sRGB-coded


def _channels_of(image: Image, channels: tuple[int, ...]) -> NDArray[np.generic]:
    """``(h, w, len(channels))`` uint8 or float32; grey serves as red, green and blue."""
    pixels = image.pixels if image.pixels.dtype == np.uint8 else image.pixels.astype(np.float32, copy=False)
    grey = pixels.shape[2] < 3
    return pixels[..., [0 if grey and channel < 3 else channel for channel in channels]]


def _pack_texels(image: Image) -> NDArray[np.uint32]:
    """Texels of an 8-bit picture, red in the lowest byte; what is missing is full."""
    texels = np.full((*image.pixels.shape[:2], 4), 255, np.uint8)
    colors = image.pixels.shape[2]
    texels[..., :3] = image.pixels[..., : min(colors, 3)]
    if colors == 4:
        texels[..., 3] = image.pixels[..., 3]
    return texels.view("<u4").ravel()
