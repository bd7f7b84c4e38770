"""Textures on the device: each image is uploaded once per use of its channels, and looked up by every material.

A :class:`Lookup` turns a surface point into texel values as glTF's samplers say: texture transform, wrap mode per axis,
filter. A :class:`Signal` is what a material asks for: a factor times a lookup, either of which may be absent.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.description import Image, Texture, Wrap

#: Mesh attribute that says which of a family of like materials a triangle has.
MEMBER_ATTRIBUTE = "face_member"
#: Which mesh attribute carries a uv set; None is the mesh's own coordinates.
UvAttributes = Mapping[int, "str | None"]


def srgb_to_linear(values: NDArray[Any]) -> NDArray[np.float64]:
    """Linear light of sRGB-coded values in [0, 1] (IEC 61966-2-1)."""
    v = np.asarray(values, dtype=np.float64)
    return np.asarray(np.where(v <= 0.04045, v / 12.92, ((np.maximum(v, 0.04045) + 0.055) / 1.055) ** 2.4))


# The classes below are dataclasses so that Dr.Jit finds the arrays in them when it records or freezes a function.


@dataclass(eq=False)
class Lookup:
    """Texels at a surface point.

    ``transform`` holds the two upper rows of the texture transform; ``wraps`` the wrap modes per axis where they
    differ, with the size of the image that folding needs. ``attribute`` names the mesh attribute that carries the uv
    set, or is None for the mesh's own.
    """

    bitmap: Any
    channels: int
    transform: tuple[Any, ...] | None = None
    wraps: tuple[Wrap, Wrap] | None = None
    size: tuple[int, int] = (0, 0)
    attribute: str | None = None

    def eval(self, si: Any, active: Any) -> Any:
        """``Color3f`` or ``Float`` at ``si``, by the number of channels."""
        import mitsuba as mi

        if self.attribute is not None or self.transform is not None or self.wraps is not None:
            si = mi.SurfaceInteraction3f(si)
            si.uv = self._texture_uv(si, active)
        return self.bitmap.eval_3(si, active) if self.channels == 3 else self.bitmap.eval_1(si, active)

    def _texture_uv(self, si: Any, active: Any) -> Any:
        import drjit as dr
        import mitsuba as mi

        uv = si.uv
        if self.attribute is not None:
            carried = si.shape.eval_attribute_3(self.attribute, si, active)
            uv = mi.Point2f(carried.x, carried.y)
        if self.transform is not None:
            a, b, c, d, e, f = self.transform
            uv = mi.Point2f(dr.fma(a, uv.x, dr.fma(b, uv.y, c)), dr.fma(d, uv.x, dr.fma(e, uv.y, f)))
        if self.wraps is not None:
            # The bitmap itself repeats; coordinates are folded so that no lookup reaches across a border that clamps
            # or mirrors. Half a texel from it, interpolation sees the border texel alone: exactly what both modes mean.
            uv = mi.Point2f(*(_fold(uv[axis], self.wraps[axis], self.size[axis]) for axis in range(2)))
        return uv


def _fold(x: Any, wrap: Wrap, texels: int) -> Any:
    import drjit as dr

    if wrap == "repeat":
        return x
    if wrap == "mirror":
        x = 1 - dr.abs(x - 2 * dr.floor(x * 0.5) - 1)
    margin = 0.5 / texels
    return dr.clip(x, margin, 1 - margin)


@dataclass(eq=False)
class Table:
    """One value per member of a family of materials, picked by :data:`MEMBER_ATTRIBUTE`."""

    values: Any
    channels: int

    def eval(self, si: Any, active: Any) -> Any:
        import drjit as dr
        import mitsuba as mi

        member = mi.UInt32(si.shape.eval_attribute_1(MEMBER_ATTRIBUTE, si, active) + 0.5)
        return dr.gather(mi.Color3f if self.channels == 3 else mi.Float, self.values, member, active)


@dataclass(eq=False)
class Signal:
    """``factor`` times ``lookup`` at a surface point; None stands for 1. Both are never None."""

    factor: Any
    lookup: Lookup | None = None

    def eval(self, si: Any, active: Any) -> Any:
        factor = self.factor.eval(si, active) if isinstance(self.factor, Table) else self.factor
        if self.lookup is None:
            return factor
        value = self.lookup.eval(si, active)
        return value if factor is None else value * factor

    @property
    def follows_uv_only(self) -> bool:
        """Whether texture coordinates are all that the value depends on, the mesh's attributes nothing."""
        return not isinstance(self.factor, Table) and (self.lookup is None or self.lookup.attribute is None)


def numbers(values: Sequence[float] | NDArray[np.float64]) -> Any:
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


class TextureStore:
    """Uploads images and remembers them, so that materials that share a texture share its memory."""

    def __init__(self) -> None:
        self._bitmaps: dict[tuple[object, ...], Any] = {}
        self._constants: dict[tuple[object, ...], NDArray[np.float64] | None] = {}
        self._images: dict[int, Image] = {}  # keeps them alive, so that their ids stay theirs

    @property
    def bitmap_count(self) -> int:
        """Textures on the device."""
        return len(self._bitmaps)

    def color(self, texture: Texture | None, factors: NDArray[np.float64], uv: UvAttributes) -> Signal:
        """An RGB signal; ``factors`` is ``(members, 3)``."""
        return self._signal(texture, (0, 1, 2), factors, uv)

    def channel(self, texture: Texture | None, channel: int, factors: NDArray[np.float64], uv: UvAttributes) -> Signal:
        """A scalar signal from one channel, 0 red to 3 alpha; ``factors`` is ``(members,)``. A missing alpha is 1."""
        return self._signal(texture, (channel,), factors, uv)

    def normals(self, texture: Texture, uv: UvAttributes) -> Lookup:
        """The lookup of a normal map."""
        return self._upload(texture, (0, 1, 2), uv)

    def table(self, name: str, make: Callable[[], NDArray[np.float32]]) -> Any:
        """A function of two variables in [0, 1], sampled at texel centres: ``make`` gives ``(rows, columns, 1)``."""
        key = ("table", name)
        if key not in self._bitmaps:
            self._bitmaps[key] = _bitmap(make(), coded=False, filtering="linear", wrap="clamp")
        return self._bitmaps[key]

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
                self._constants[key] = srgb_to_linear(value) if _is_coded(texture, channels) else np.asarray(value)
        return self._constants[key]

    def _signal(
        self, texture: Texture | None, channels: tuple[int, ...], factors: NDArray[np.float64], uv: UvAttributes
    ) -> Signal:
        factors = np.asarray(factors, dtype=np.float64)
        constant = self.constant(texture, channels)
        if constant is not None:
            return Signal(numbers(factors * (constant if len(channels) > 1 else constant[0])))
        assert texture is not None
        return Signal(None if np.all(factors == 1) else numbers(factors), self._upload(texture, channels, uv))

    def _upload(self, texture: Texture, channels: tuple[int, ...], uv: UvAttributes) -> Lookup:
        mixed = texture.wrap_u != texture.wrap_v
        wrap = "repeat" if mixed else texture.wrap_u
        coded = _is_coded(texture, channels)
        key = (self._identity(texture.image), channels, coded, texture.filter, wrap)
        if key not in self._bitmaps:
            self._bitmaps[key] = _bitmap(_channels_of(texture.image, channels), coded, texture.filter, wrap)
        height, width = texture.image.pixels.shape[:2]
        matrix = np.asarray(texture.uv_transform, dtype=np.float64)
        return Lookup(
            bitmap=self._bitmaps[key],
            channels=len(channels),
            transform=None if np.array_equal(matrix, np.eye(3)) else tuple(numbers([v]) for v in matrix[:2].ravel()),
            wraps=(texture.wrap_u, texture.wrap_v) if mixed else None,
            size=(width, height),
            attribute=uv.get(texture.uv_set),
        )

    def _identity(self, image: Image) -> int:
        self._images[id(image)] = image
        return id(image)


def _bitmap(texels: NDArray[np.generic], coded: bool, filtering: str, wrap: str) -> Any:
    import mitsuba as mi

    if coded and texels.dtype != np.uint8:
        texels = srgb_to_linear(texels).astype(np.float32)
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
