"""glTF materials as Mitsuba BSDFs: which plugin stands for which family of materials, and with what textures.

Perfectly smooth glass, panes and mirrors become Mitsuba's own plugins, whose rays an integrator can follow exactly;
all else is a :mod:`~lippmann.device.pbr.gltf_bsdf`. ``docs/reference/materials.md`` holds the mapping field by field.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.device.pbr import material_groups, microfacet
from lippmann.device.pbr.gltf_bsdf import surface_bsdf
from lippmann.device.pbr.gltf_bsdf_parameters import Anisotropy, NormalMap, SurfaceModel, ThinFilm
from lippmann.device.pbr.lookup_texture import signal_texture
from lippmann.device.pbr.material_groups import Kind, Structure, Variant
from lippmann.device.pbr.texture_lookup import Signal, numbers, uv_attribute
from lippmann.device.pbr.textures import TextureStore
from lippmann.device.types import BSDF
from lippmann.scene.values.description import Color, Material, Texture


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
    groups = material_groups.group(materials, variants, store)
    finishes = [
        _Maker([materials[variant.material] for variant in group], group, store, compensates).finish()
        for group in groups
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
        self._structure: Structure = material_groups.structure_of(members[0], variants[0].faded, store)
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
            emission=self._emission(model) if material_groups.glows(first, self._store) else None,
            absorption=material_groups.absorption(first),
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
        if structure.opacity != "full":
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
        covered = model if model.opacity is not None else None
        if first.unlit:
            return Emission(model.base_color, two_sided=True, model=covered, tinted=model.tinted)
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
    textures = material_groups.textures_of(m)
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
