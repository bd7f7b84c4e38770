"""The archived specular-glossiness model, as metallic-roughness."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.description import Color, Image, Texture
from lippmann.scene.resources import linear_from_srgb

_DIELECTRIC = 0.04  # reflectance at normal incidence of the metallic-roughness model's dielectric
_TINY = 1e-6
_LUMINANCE = np.array([0.299, 0.587, 0.114], np.float32)

_Values = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class MetallicRoughness:
    """Factors in [0, 1] and the textures that they multiply."""

    base_color: Color
    base_color_texture: Texture | None
    metallic: float
    roughness: float
    metallic_roughness_texture: Texture | None


def metallic_roughness_of(
    *,
    diffuse: Color,
    diffuse_texture: Texture | None,
    specular: Color,
    glossiness: float,
    specular_glossiness_texture: Texture | None,
) -> MetallicRoughness:
    """The metallic-roughness surface nearest to a specular-glossiness one; texels are converted one by one.

    Parameters
    ----------
    diffuse_texture, specular_glossiness_texture:
        sRGB-coded colours; alpha holds coverage in the first and glossiness in the second. Where both are given they
        lie alike on the surface (:func:`lie_alike`).
    """
    # Without metal the diffuse colour stands as a plain factor, so the texture may stay as it is.
    is_plain = diffuse_texture is None or _brightness(np.array(specular, np.float32)) <= _DIELECTRIC
    if specular_glossiness_texture is None and is_plain:
        base, metallic = _convert(np.array(diffuse, np.float32), np.array(specular, np.float32))
        return MetallicRoughness(_color(base), diffuse_texture, float(metallic), 1.0 - glossiness, None)
    textures = [texture for texture in (diffuse_texture, specular_glossiness_texture) if texture is not None]
    height, width = (max(texture.image.pixels.shape[axis] for texture in textures) for axis in (0, 1))
    diffuse_texels = _texels(diffuse_texture, height, width)
    specular_texels = _texels(specular_glossiness_texture, height, width)
    base, metallic = _convert(
        linear_from_srgb(diffuse_texels[..., :3]) * np.array(diffuse, np.float32),
        linear_from_srgb(specular_texels[..., :3]) * np.array(specular, np.float32),
    )
    roughness = 1.0 - specular_texels[..., 3] * np.float32(glossiness)
    base_texels = np.dstack([_srgb_from_linear(base), diffuse_texels[..., 3]])
    metallic_texels = np.dstack([np.zeros_like(roughness), roughness, metallic])
    return MetallicRoughness(
        base_color=(1.0, 1.0, 1.0),
        base_color_texture=_with_texels(textures[0], base_texels, srgb=True),
        metallic=1.0,
        roughness=1.0,
        metallic_roughness_texture=_with_texels(textures[0], metallic_texels, srgb=False),
    )


def lie_alike(first: Texture, second: Texture) -> bool:
    """Whether two textures put the same place of their images at the same place of a surface."""
    return (
        first.uv_set == second.uv_set
        and (first.wrap_u, first.wrap_v) == (second.wrap_u, second.wrap_v)
        and bool(np.array_equal(first.uv_transform, second.uv_transform))
    )


def _convert(diffuse: _Values, specular: _Values) -> tuple[_Values, _Values]:
    """Linear base colour ``(..., 3)`` and metallic ``(...)`` of diffuse and specular colours ``(..., 3)``.

    What is reflected by both models agrees when diffuse (1 - max specular) = base (1 - 0.04) (1 - metallic) and
    specular = 0.04 (1 - metallic) + base metallic. Eliminating base gives a quadratic for metallic, solved here for
    the colours' brightness; base then follows from the diffuse equation for dielectrics and from the specular one for
    metals. It is the conversion of the Khronos group's appendix to KHR_materials_pbrSpecularGlossiness.
    """
    strength = 1.0 - specular.max(axis=-1)
    specular_brightness = _brightness(specular)
    b = _brightness(diffuse) * strength / (1.0 - _DIELECTRIC) + specular_brightness - 2.0 * _DIELECTRIC
    c = _DIELECTRIC - specular_brightness
    root = np.sqrt(np.maximum(b * b - 4.0 * _DIELECTRIC * c, 0.0))
    metallic = np.where(c >= 0.0, 0.0, np.clip((root - b) / (2.0 * _DIELECTRIC), 0.0, 1.0))[..., None]
    from_diffuse = diffuse * strength[..., None] / (1.0 - _DIELECTRIC) / np.maximum(1.0 - metallic, _TINY)
    from_specular = (specular - _DIELECTRIC * (1.0 - metallic)) / np.maximum(metallic, _TINY)
    base = np.clip(from_diffuse + (from_specular - from_diffuse) * metallic**2, 0.0, 1.0)
    return base.astype(np.float32), metallic[..., 0].astype(np.float32)


def _brightness(color: _Values) -> _Values:
    brightness: _Values = np.sqrt((color * color) @ _LUMINANCE)
    return brightness


def _color(values: _Values) -> Color:
    red, green, blue = (float(value) for value in values)
    return red, green, blue


def _texels(texture: Texture | None, height: int, width: int) -> _Values:
    """Coded RGBA in [0, 1], ``(height, width, 4)``, by nearest texels; white and opaque without a texture."""
    if texture is None:
        return np.ones((height, width, 4), np.float32)
    pixels = texture.image.pixels
    rows = np.arange(height) * pixels.shape[0] // height
    columns = np.arange(width) * pixels.shape[1] // width
    scale = np.float32(1.0 / 255.0 if pixels.dtype == np.uint8 else 1.0)
    found = pixels[rows[:, None], columns[None, :]].astype(np.float32) * scale
    if found.shape[2] == 1:
        found = np.repeat(found, 3, axis=2)
    return found if found.shape[2] == 4 else np.dstack([found, np.ones((height, width), np.float32)])


def _srgb_from_linear(linear: _Values) -> _Values:
    """sRGB-coded values of linear light in [0, 1] (IEC 61966-2-1)."""
    coded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1.0 / 2.4) - 0.055)
    return coded.astype(np.float32)


def _with_texels(texture: Texture, texels: _Values, *, srgb: bool) -> Texture:
    coded = np.rint(texels * 255.0).astype(np.uint8)
    return replace(texture, image=Image(texture.image.name, coded), srgb=srgb)
