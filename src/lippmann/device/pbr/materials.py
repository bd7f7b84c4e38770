"""glTF materials as Mitsuba BSDFs: which plugin stands for which family of materials, and with what textures.

Perfectly smooth glass, panes and mirrors become Mitsuba's own plugins, whose rays an integrator can follow exactly;
all else is a :mod:`~lippmann.device.pbr.gltf_bsdf`. Materials that are alike but for their numbers and pictures share
one plugin, and their meshes one shape. ``docs/reference/materials.md`` holds the mapping field by field.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.device.pbr import microfacet
from lippmann.device.pbr.gltf_bsdf import surface_bsdf
from lippmann.device.pbr.gltf_bsdf_parameters import Anisotropy, NormalMap, SurfaceModel, ThinFilm
from lippmann.device.pbr.lookup_texture import signal_texture
from lippmann.device.pbr.textures import Signal, TextureStore, numbers, sampler_key, texture_key, uv_attribute
from lippmann.device.types import BSDF
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
    opacity: Literal["full", "front", "mask", "blend"]


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
        opacity=("front" if m.front_only else "full") if whole else "mask" if m.alpha_mode == "mask" else "blend",
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


@dataclass(frozen=True, eq=False)
class Emission:
    """Light that a surface gives off, from both sides or the front alone; ``model`` knows where it is cut out."""

    radiance: Signal
    two_sided: bool
    model: SurfaceModel | None
    tinted: bool


@dataclass(frozen=True, eq=False)
class Finish:
    """A family of materials, ready for shapes.

    ``members`` says which number each :class:`Variant` has in it. ``uv_sets`` lists the texture coordinates that
    shapes must carry: the first as the mesh's own, the others as attributes. ``absorption`` is the coefficient per
    world unit inside the body, None for no body or a clear one.
    """

    bsdf: BSDF
    members: dict[Variant, int]
    uv_sets: tuple[int, ...]
    tinted: bool
    faded: bool
    tangents: bool
    emission: Emission | None
    absorption: Color | None


def make_finishes(
    materials: Sequence[Material], variants: Sequence[Variant], store: TextureStore, *, compensates: bool = True
) -> list[Finish]:
    """Finishes that together hold every variant once.

    ``compensates`` says whether light that is reflected more than once between microfacets is given back.
    """
    families = group(materials, variants, store)
    finishes = [
        _Maker([materials[variant.material] for variant in family], family, store, compensates).finish()
        for family in families
    ]
    store.finish()
    return finishes


class _Maker:
    """Makes the plugin of one family."""

    def __init__(
        self, members: list[Material], variants: list[Variant], store: TextureStore, compensates: bool
    ) -> None:
        self._compensates = compensates
        self._members = members
        self._variants = variants
        self._store = store
        self._structure: Structure = structure_of(members[0], variants[0].faded, store)
        self._uv_sets = _uv_sets(members[0])
        self._uv = {number: uv_attribute(number) for number in self._uv_sets[1:]}

    def finish(self) -> Finish:
        first, variant = self._members[0], self._variants[0]
        model = self._model()
        makers: dict[Kind, Callable[[], BSDF]] = {
            "surface": lambda: surface_bsdf(model),
            "unlit": lambda: surface_bsdf(_black(model)),
            "mirror": lambda: _mask(_mirror(model), model),
            "glass": lambda: _mask(_glass("dielectric", model, first), model),
            "pane": lambda: _mask(_glass("thindielectric", model, first), model),
        }
        return Finish(
            bsdf=makers[self._structure.kind](),
            members={member: number for number, member in enumerate(self._variants)},
            uv_sets=self._uv_sets,
            tinted=variant.tinted,
            faded=variant.faded,
            tangents=variant.tangents,
            emission=self._emission(model) if glows(first, self._store) else None,
            absorption=absorption(first),
        )

    def _model(self) -> SurfaceModel:
        variant, structure = self._variants[0], self._structure
        model = SurfaceModel(
            base_color=self._color("base_color"),
            roughness=self._channel("roughness", 1, "metallic_roughness_texture"),
            ior=Signal(numbers(self._numbers("ior"))),
            metal=structure.metal == "all",
            dull=structure.dull,
            solid=structure.solid,
            compensates=self._compensates,
            normal=self._normal_map("normal"),
            tinted=variant.tinted,
            faded=variant.faded,
        )
        if structure.metal != "none" or not structure.dull or structure.clearcoat:
            model.gloss_albedo = self._store.table("gloss", microfacet.gloss_albedo_table)
        if structure.solid and self._compensates:
            model.interface_albedo = self._store.table("interface", microfacet.interface_albedo_table)
        if structure.opacity == "front":
            model.opacity, model.front_only = Signal(numbers(np.ones(1))), True
        elif structure.opacity != "full":
            model.opacity = self._channel("alpha", 3, "base_color_texture")
        if structure.opacity == "mask":
            model.opacity_cutoff = Signal(numbers(self._numbers("alpha_cutoff")))
        if structure.metal == "some":
            model.metallic = self._channel("metallic", 2, "metallic_roughness_texture")
        if structure.specular:
            model.specular = self._channel("specular", 3)
            model.specular_color = self._color("specular_color")
        if structure.transmission:
            model.transmission = self._channel("transmission", 0)
        if structure.clearcoat:
            model.clearcoat = self._channel("clearcoat", 0)
            model.clearcoat_roughness = self._channel("clearcoat_roughness", 1)
            model.clearcoat_normal = self._normal_map("clearcoat_normal")
        if structure.sheen:
            model.sheen_color = self._color("sheen_color")
            model.sheen_roughness = self._channel("sheen_roughness", 3)
            model.sheen_albedo = self._store.table("sheen", microfacet.sheen_albedo_table)
        if structure.anisotropic:
            model.anisotropy = self._anisotropy()
        if structure.iridescent:
            model.film = self._film()
        return model

    def _anisotropy(self) -> Anisotropy:
        rotation = self._numbers("anisotropy_rotation")
        textures = self._textures("anisotropy_texture")
        return Anisotropy(
            strength=Signal(numbers(self._numbers("anisotropy"))),
            cosine=Signal(numbers(np.cos(rotation))),
            sine=Signal(numbers(np.sin(rotation))),
            lookup=None if textures[0] is None else self._store.normals(textures, self._uv),
            tangents=self._variants[0].tangents,
        )

    def _film(self) -> ThinFilm:
        thinnest, thickest = (self._numbers(f"iridescence_thickness_{end}imum") for end in ("min", "max"))
        return ThinFilm(
            share=self._channel("iridescence", 0),
            ior=Signal(numbers(self._numbers("iridescence_ior"))),
            thinnest=Signal(numbers(thinnest)),
            range=Signal(numbers(thickest - thinnest)),
            texture=self._store.channel(
                self._textures("iridescence_thickness_texture"), 1, np.ones(len(thinnest)), self._uv
            ),
        )

    def _emission(self, model: SurfaceModel) -> Emission:
        first = self._members[0]
        covered = model if model.opacity is not None and not model.front_only else None
        if first.unlit:
            return Emission(model.base_color, two_sided=not model.front_only, model=covered, tinted=model.tinted)
        return Emission(self._color("emission"), first.double_sided, covered, tinted=False)

    def _numbers(self, name: str) -> NDArray[np.float64]:
        return np.array([getattr(member, name) for member in self._members], dtype=np.float64)

    def _textures(self, name: str) -> list[Texture | None]:
        return [getattr(member, name) for member in self._members]

    def _color(self, name: str) -> Signal:
        return self._store.color(self._textures(f"{name}_texture"), self._numbers(name), self._uv)

    def _channel(self, name: str, channel: int, texture: str | None = None) -> Signal:
        textures = self._textures(texture or f"{name}_texture")
        return self._store.channel(textures, channel, self._numbers(name), self._uv)

    def _normal_map(self, name: str) -> NormalMap | None:
        textures = self._textures(f"{name}_texture")
        if textures[0] is None:
            return None
        scale = Signal(numbers(self._numbers(f"{name}_scale")))
        return NormalMap(self._store.normals(textures, self._uv), scale, self._variants[0].tangents)


def _uv_sets(m: Material) -> tuple[int, ...]:
    """Sets in use, the mesh's own first: normal maps need its tangents, and emitters are sampled by it."""
    textures = textures_of(m)
    preferred = (
        "normal_texture",
        "anisotropy_texture",
        "clearcoat_normal_texture",
        "emission_texture",
        "base_color_texture",
    )
    first = [textures[name].uv_set for name in preferred if name in textures]
    if m.anisotropy > 0 and not ("normal_texture" in textures or "anisotropy_texture" in textures):
        first.insert(0, 0)  # its direction is told by tangents, too, even where there is no texture at all
    return tuple(dict.fromkeys([*first, *(texture.uv_set for texture in textures.values())]))


def _black(model: SurfaceModel) -> SurfaceModel:
    """Absorbs all light, where it covers at all."""
    return SurfaceModel(
        base_color=Signal(numbers(np.zeros((1, 3)))),
        roughness=model.roughness,
        ior=model.ior,
        dull=True,
        opacity=model.opacity,
        opacity_cutoff=model.opacity_cutoff,
        front_only=model.front_only,
        faded=model.faded,
    )


def _mirror(model: SurfaceModel) -> BSDF:
    import mitsuba as mi

    tint = signal_texture(model, "metal")
    conductor = mi.load_dict({"type": "conductor", "material": "none", "specular_reflectance": tint})
    return mi.load_dict({"type": "twosided", "bsdf": conductor})


def _glass(plugin: str, model: SurfaceModel, m: Material) -> BSDF:
    import mitsuba as mi

    tint = signal_texture(model, "base")
    return mi.load_dict({"type": plugin, "int_ior": m.ior, "ext_ior": 1.0, "specular_transmittance": tint})


def _mask(bsdf: BSDF, model: SurfaceModel) -> BSDF:
    import mitsuba as mi

    if model.opacity is None:
        return bsdf
    return mi.load_dict({"type": "mask", "opacity": signal_texture(model, "coverage"), "bsdf": bsdf})
