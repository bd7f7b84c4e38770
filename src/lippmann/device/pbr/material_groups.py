"""Which materials are alike but for their numbers and pictures: they share one plugin and their meshes one shape."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from lippmann.device.pbr import microfacet
from lippmann.device.pbr.textures import TextureStore, sampler_key, texture_key
from lippmann.scene.values.description import Color, Material, Texture

#: At or below this roughness a surface without textures for it counts as perfectly smooth.
SMOOTH_ROUGHNESS = math.sqrt(microfacet.MIN_ALPHA)
#: Least transmitted share per attenuation distance: a colour of zero would ask for infinite absorption.
MIN_ATTENUATION = 1e-4
#: From this many sets of pictures on, a family keeps them in one pool, which is a little slower to look up than
#: textures of their own, but spares every frame the cost of as many plugins and shapes.
MIN_POOLED = 8

Kind = Literal["surface", "glass", "pane", "mirror", "unlit"]

#: Channels that each texture is read by, apart from normal maps, which are always looked up.
_USES: dict[str, tuple[tuple[int, ...], ...]] = {
    "base_color_texture": ((0, 1, 2), (3,)),
    "metallic_roughness_texture": ((1,), (2,)),
    "emission_texture": ((0, 1, 2),),
    "transmission_texture": ((0,),),
    "specular_texture": ((3,),),
    "specular_color_texture": ((0, 1, 2),),
    "clearcoat_texture": ((0,),),
    "clearcoat_roughness_texture": ((1,),),
    "sheen_color_texture": ((0, 1, 2),),
    "sheen_roughness_texture": ((3,),),
    "anisotropy_texture": ((0, 1, 2),),
    "iridescence_texture": ((0,),),
    "iridescence_thickness_texture": ((1,),),
}


@dataclass(frozen=True)
class Variant:
    """A material as one mesh wears it.

    ``tinted`` and ``faded`` say that the mesh's vertex colours and their alpha count, ``alone`` that its shape cannot
    tell several materials apart, ``tangents`` that the mesh's own tangents count.
    """

    material: int
    tinted: bool = False
    faded: bool = False
    alone: bool = False
    tangents: bool = False


@dataclass(frozen=True)
class Structure:
    """Properties of a material that decide its plugin's structure, as against its numbers."""

    kind: Kind
    metal: Literal["all", "none", "some"]
    dull: bool
    specular: bool
    transmission: bool
    solid: bool
    clearcoat: bool
    sheen: bool
    anisotropic: bool
    iridescent: bool
    opacity: Literal["full", "mask", "blend"]


def group(materials: Sequence[Material], variants: Sequence[Variant], store: TextureStore) -> list[list[Variant]]:
    """Families that together hold every variant once."""
    alike: dict[tuple[object, ...], dict[tuple[object, ...], list[Variant]]] = {}
    for variant in dict.fromkeys(variants):
        material = materials[variant.material]
        pictures = tuple(texture_key(texture) for texture in textures_of(material).values())
        alike.setdefault(_key(material, variant, store), {}).setdefault(pictures, []).append(variant)
    families: list[list[Variant]] = []
    for by_pictures in alike.values():
        if len(by_pictures) < MIN_POOLED:
            families.extend(by_pictures.values())
        else:
            families.append([variant for variants in by_pictures.values() for variant in variants])
    return families


def structure_of(m: Material, faded: bool, store: TextureStore) -> Structure:
    """See :class:`Structure`; textures that are the same everywhere count as numbers."""

    def value(texture: Texture | None, channel: int, factor: float) -> float | None:
        constant = np.zeros(1) if factor == 0 else store.constant(texture, (channel,))
        return None if constant is None else factor * float(constant[0])

    metallic = value(m.metallic_roughness_texture, 2, m.metallic)
    roughness = value(m.metallic_roughness_texture, 1, m.roughness)
    transmission = value(m.transmission_texture, 0, m.transmission)
    specular = value(m.specular_texture, 3, m.specular)
    plain_specular = specular == 1 and m.specular_color == (1.0, 1.0, 1.0) and m.specular_color_texture is None
    alpha = value(m.base_color_texture, 3, m.alpha)
    threshold = m.alpha_cutoff if m.alpha_mode == "mask" else 1.0
    whole = m.alpha_mode == "opaque" or (alpha is not None and alpha >= threshold and not faded)
    clearcoat = value(m.clearcoat_texture, 0, m.clearcoat) != 0
    sheen = any(m.sheen_color)
    solid = is_solid(m) and metallic != 1
    smooth = roughness is not None and roughness <= SMOOTH_ROUGHNESS
    anisotropic = m.anisotropy > 0
    iridescent = value(m.iridescence_texture, 0, m.iridescence) != 0
    bare = smooth and not (clearcoat or sheen or m.normal_texture or anisotropic or iridescent)
    kind: Kind = "surface"
    if m.unlit:
        kind = "unlit"
    elif bare and metallic == 1:
        kind = "mirror"
    elif bare and metallic == 0 and transmission == 1 and plain_specular and m.ior >= 1:
        kind = "glass" if solid else "pane"
    return Structure(
        kind=kind,
        metal="all" if metallic == 1 else "none" if metallic == 0 else "some",
        dull=specular == 0,
        specular=not plain_specular and specular != 0,
        transmission=transmission != 0 and metallic != 1,
        solid=solid,
        clearcoat=clearcoat,
        sheen=sheen,
        anisotropic=anisotropic,
        iridescent=iridescent,
        opacity="full" if whole else "mask" if m.alpha_mode == "mask" else "blend",
    )


def follows_tangents(m: Material) -> bool:
    """Whether a mesh's tangents change the looks of a material."""
    return m.anisotropy > 0 or not (m.normal_texture is None and m.clearcoat_normal_texture is None)


def glows(m: Material, store: TextureStore) -> bool:
    """Whether the surface gives off light."""
    texels = store.constant(m.emission_texture, (0, 1, 2))
    return m.unlit or (any(m.emission) and (texels is None or bool(np.any(texels))))


def is_solid(m: Material) -> bool:
    """Whether the surface encloses a transparent body."""
    return m.transmission > 0 and m.thickness > 0 and not m.unlit


def absorption(m: Material) -> Color | None:
    """Beer-Lambert coefficients per world unit (KHR_materials_volume), None without a coloured body."""
    distance = m.attenuation_distance
    if not is_solid(m) or not 0 < distance < math.inf:
        return None
    red, green, blue = (-math.log(min(max(c, MIN_ATTENUATION), 1.0)) / distance for c in m.attenuation_color)
    return (red, green, blue) if max(red, green, blue) > 0 else None


def textures_of(m: Material) -> dict[str, Texture]:
    """The textures of a material by field."""
    return {name: value for name, value in vars(m).items() if isinstance(value, Texture)}


def _key(m: Material, variant: Variant, store: TextureStore) -> tuple[object, ...]:
    structure = structure_of(m, variant.faded, store)
    glass = structure.kind in ("glass", "pane")  # their refractive index is no texture
    alone = variant.alone or glass or absorption(m) is not None or (glows(m, store) and not m.unlit)
    looks: list[object] = []
    for name, texture in textures_of(m).items():
        varying = [store.constant(texture, channels) is None for channels in _USES.get(name, ())]
        unpoolable = None if texture.image.pixels.dtype == np.uint8 else id(texture.image)
        looks.append((name, sampler_key(texture), tuple(varying), unpoolable))
    return (variant.material if alone else None, structure, tuple(looks), replace(variant, material=0))
