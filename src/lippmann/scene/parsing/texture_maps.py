"""Arithmetic on the texels of images: channels extracted and packed, and normal maps made of height maps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.values.description import Image

Plane = NDArray[np.float32]


def unit(image: Image) -> Plane:
    """Texels ``(h, w, c)`` as float32 in [0, 1]."""
    if image.pixels.dtype == np.uint8:
        return image.pixels.astype(np.float32) / np.float32(255.0)
    return image.pixels.astype(np.float32)


def scalar(image: Image, channel: str) -> Plane:
    """One value per texel, ``(h, w)``: ``r``, ``g``, ``b``, ``m`` (alpha where there is one), else luminance."""
    pixels = unit(image)
    count = pixels.shape[2]
    if channel == "m" and count == 4:
        return pixels[..., 3]
    if count == 1:
        return pixels[..., 0]
    if channel in ("r", "g", "b"):
        return pixels[..., "rgb".index(channel)]
    # Rec. 709 weights, on the stored values: such maps are mostly grey.
    return np.asarray(pixels[..., :3] @ np.array([0.2126, 0.7152, 0.0722], np.float32), np.float32)


def pack_channels(*planes: Plane | None, name: str) -> Image:
    """An RGB image of three planes, white where a plane is None; smaller planes are enlarged to the largest."""
    present = [plane for plane in planes if plane is not None]
    height, width = max(plane.shape[0] for plane in present), max(plane.shape[1] for plane in present)
    pixels = np.ones((height, width, 3), np.float32)
    for channel, plane in enumerate(planes):
        if plane is not None:
            pixels[..., channel] = resize(plane, (height, width))
    return Image(name, pixels)


def with_alpha(image: Image | None, alpha: Plane, name: str) -> Image:
    """``image`` (white if None) with ``alpha`` as its fourth channel, in the size of the larger."""
    color = np.ones((*alpha.shape, 3), np.float32) if image is None else unit(image)
    if color.shape[2] == 1:
        color = np.repeat(color, 3, axis=2)
    shape = (max(color.shape[0], alpha.shape[0]), max(color.shape[1], alpha.shape[1]))
    planes = [resize(plane, shape) for plane in (*np.moveaxis(color[..., :3], -1, 0), alpha)]
    coded = np.rint(np.stack(planes, axis=-1) * 255.0).astype(np.uint8)
    return Image(image.name if image else name, coded)


def without_alpha(image: Image) -> Image:
    """The colour channels alone."""
    return replace(image, pixels=np.ascontiguousarray(image.pixels[..., :3]))


def resize(plane: Plane, shape: tuple[int, int]) -> Plane:
    """``plane`` resampled to ``shape`` by bilinear interpolation."""
    if plane.shape == shape:
        return plane
    from PIL import Image as Pillow

    picture = Pillow.fromarray(np.ascontiguousarray(plane, np.float32))
    return np.asarray(picture.resize((shape[1], shape[0]), Pillow.Resampling.BILINEAR), np.float32)


def looks_like_normals(image: Image) -> bool:
    """True for a tangent-space normal map: bluish, and level on average.

    Exporters write normal maps under ``map_Bump``, where the format has a height map.
    """
    if image.pixels.shape[2] < 3:
        return False
    red, green, blue = unit(image)[..., :3].reshape(-1, 3).mean(axis=0)
    return bool(blue > 0.6 and 0.35 < red < 0.65 and 0.35 < green < 0.65 and blue - max(red, green) > 0.1)


def normals_from_height(height: Plane, strength: float, periodic: bool, name: str) -> Image:
    """A tangent-space normal map, float32 in [0, 1], of a height map ``(h, w)``.

    With strength 1 a rise from black to white over one texel is a slope of 45 degrees. Slopes are central differences.
    """
    padded = np.pad(height.astype(np.float32), 1, mode="wrap" if periodic else "edge")
    right = strength * (padded[1:-1, 2:] - padded[1:-1, :-2]) / 2.0
    down = strength * (padded[2:, 1:-1] - padded[:-2, 1:-1]) / 2.0
    normal = np.stack([-right, down, np.ones_like(right)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return Image(name, (normal * 0.5 + 0.5).astype(np.float32))
