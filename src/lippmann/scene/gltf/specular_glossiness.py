"""The archived specular-glossiness model (KHR_materials_pbrSpecularGlossiness)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lippmann.scene.description import Color, Image, Material, Texture


def as_specular_glossiness(
    material: Material,
    *,
    diffuse: tuple[float, float, float, float],
    diffuse_texture: Texture | None,
    specular: Color,
    glossiness: float,
    specular_glossiness_texture: Texture | None,
    ior: float,
) -> Material:
    """``material`` with its reflection replaced by that of the specular-glossiness model.

    KHR_materials_specular, which took the extension's place, names the equivalent: no metal, the diffuse colour as
    base colour, the specular one as specular colour, and an index of refraction without end, so that the specular
    colour alone is the reflectance at normal incidence.

    Parameters
    ----------
    diffuse:
        Linear RGB and alpha.
    specular_glossiness_texture:
        sRGB-coded specular colour in RGB, glossiness in alpha.
    ior:
        What stands for an endless index of refraction.
    """
    roughness, roughness_texture = 1.0 - glossiness, None
    if specular_glossiness_texture is not None and specular_glossiness_texture.image.pixels.shape[2] == 4:
        roughness = 1.0
        image = _roughness(specular_glossiness_texture.image, glossiness)
        roughness_texture = replace(specular_glossiness_texture, image=image, srgb=False)
    return replace(
        material,
        base_color=diffuse[:3],
        base_color_texture=diffuse_texture,
        alpha=diffuse[3],
        metallic=0.0,
        roughness=roughness,
        metallic_roughness_texture=roughness_texture,
        specular=1.0,
        specular_texture=None,
        specular_color=specular,
        specular_color_texture=specular_glossiness_texture,
        ior=ior,
    )


def _roughness(image: Image, glossiness: float) -> Image:
    """Roughness in G (and no metal in B) where ``image`` holds glossiness in alpha."""
    most = 255.0 if image.pixels.dtype == np.uint8 else 1.0
    alpha = image.pixels[..., 3].astype(np.float32) / np.float32(most)
    texels = np.zeros((*alpha.shape, 3), np.uint8)
    texels[..., 1] = np.rint(255.0 * (1.0 - np.float32(glossiness) * alpha))
    return Image(image.name, texels)
