"""glTF materials as Mitsuba BSDFs: which plugin stands for which material, and with what textures.

Perfectly smooth glass, panes and mirrors become Mitsuba's own plugins, whose rays an integrator can follow exactly; all
else is a :mod:`lippmann.scene.surface`. Materials that differ in numbers only form a family that shares one plugin.
``docs/materials.md`` holds the mapping field by field.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.scene import microfacet
from lippmann.scene.description import Color, Material, Texture
from lippmann.scene.signal_texture import signal_texture
from lippmann.scene.surface import surface_bsdf
from lippmann.scene.surface_model import NormalMap, SurfaceModel
from lippmann.scene.textures import Signal, TextureStore, UvAttributes, numbers

#: At or below this roughness a surface without textures for it counts as perfectly smooth.
SMOOTH_ROUGHNESS = math.sqrt(microfacet.MIN_ALPHA)
#: Least transmitted share per attenuation distance: a colour of zero would ask for infinite absorption.
MIN_ATTENUATION = 1e-4

Kind = Literal["surface", "glass", "pane", "mirror", "lamp"]


@dataclass(frozen=True)
class Variant:
    """A material as one mesh wears it: ``tinted`` and ``faded`` say that its vertex colours and their alpha count."""

    material: int
    tinted: bool = False
    faded: bool = False


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

    bsdf: Any
    members: dict[Variant, int]
    uv_sets: tuple[int, ...]
    tinted: bool
    faded: bool
    emission: Emission | None
    absorption: Color | None


def uv_attribute(uv_set: int) -> str:
    """Mesh attribute that carries a uv set beyond the mesh's own: u and v in the first two of three channels."""
    return f"vertex_uv{uv_set}"


def make_finishes(materials: Sequence[Material], variants: Sequence[Variant], store: TextureStore) -> list[Finish]:
    """Finishes that together hold every variant once."""
    families: dict[tuple[object, ...], list[Variant]] = {}
    for variant in dict.fromkeys(variants):
        material = materials[variant.material]
        families.setdefault(_family(material, variant, store), []).append(variant)
    return [_finish([materials[variant.material] for variant in family], family, store) for family in families.values()]


def glows(material: Material, store: TextureStore) -> bool:
    """Whether the surface gives off light."""
    if material.unlit:
        return True
    texels = store.constant(material.emission_texture, (0, 1, 2))
    return any(material.emission) and (texels is None or bool(np.any(texels)))


def absorption(material: Material) -> Color | None:
    """Beer-Lambert coefficients per world unit (KHR_materials_volume), None without a coloured body."""
    distance = material.attenuation_distance
    if not _is_solid(material) or not 0 < distance < math.inf:
        return None
    red, green, blue = (-math.log(min(max(c, MIN_ATTENUATION), 1.0)) / distance for c in material.attenuation_color)
    return (red, green, blue) if max(red, green, blue) > 0 else None


def _is_solid(material: Material) -> bool:
    return material.transmission > 0 and material.thickness > 0 and not material.unlit


# ---- which plugin, which family ----


@dataclass(frozen=True)
class _Shape:
    """What of a material decides the plugin's structure, as against its numbers."""

    kind: Kind
    metal: Literal["all", "none", "some"]
    dull: bool
    specular: bool
    transmission: bool
    solid: bool
    clearcoat: bool
    sheen: bool
    opacity: Literal["full", "mask", "blend"]


def _shape(m: Material, faded: bool, store: TextureStore) -> _Shape:
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
    clearcoat = value(m.clearcoat_texture, 0, m.clearcoat) != 0
    sheen = any(m.sheen_color)
    covers = m.alpha_mode == "opaque" or (alpha is not None and alpha >= threshold and not faded)
    shape = _Shape(
        kind="surface",
        metal="all" if metallic == 1 else "none" if metallic == 0 else "some",
        dull=specular == 0,
        specular=not plain_specular and specular != 0,
        transmission=transmission != 0 and metallic != 1,
        solid=_is_solid(m) and metallic != 1,
        clearcoat=clearcoat,
        sheen=sheen,
        opacity="full" if covers else "mask" if m.alpha_mode == "mask" else "blend",
    )
    smooth = roughness is not None and roughness <= SMOOTH_ROUGHNESS
    bare = not (clearcoat or sheen or m.normal_texture)
    kind: Kind = "surface"
    if m.unlit:
        kind = "lamp"
    elif smooth and bare and shape.metal == "all":
        kind = "mirror"
    elif smooth and bare and shape.metal == "none" and transmission == 1 and plain_specular and m.ior >= 1:
        kind = "glass" if shape.solid else "pane"
    return _Shape(**{**shape.__dict__, "kind": kind})


def _textures(m: Material) -> tuple[Texture | None, ...]:
    return tuple(value for name, value in vars(m).items() if name.endswith("_texture"))


def _family(m: Material, variant: Variant, store: TextureStore) -> tuple[object, ...]:
    shape = _shape(m, variant.faded, store)
    alone = shape.kind in ("glass", "pane") or glows(m, store) or absorption(m) is not None
    textures = tuple(None if texture is None else _texture_key(texture) for texture in _textures(m))
    return (variant.material if alone else None, shape, textures, variant.tinted, variant.faded)


def _texture_key(texture: Texture) -> tuple[object, ...]:
    fields = {name: value for name, value in vars(texture).items() if name not in ("image", "uv_transform")}
    return (id(texture.image), texture.uv_transform.tobytes(), *fields.items())


# ---- making ----


def _uv_sets(m: Material) -> tuple[int, ...]:
    """Sets in use, the mesh's own first: a normal map needs its tangents, and a lamp is drawn by nothing else."""
    preferred = [m.normal_texture, m.clearcoat_normal_texture, m.emission_texture, m.base_color_texture]
    return tuple(dict.fromkeys(texture.uv_set for texture in [*preferred, *_textures(m)] if texture is not None))


def _finish(members: list[Material], variants: list[Variant], store: TextureStore) -> Finish:
    first, variant = members[0], variants[0]
    sets = _uv_sets(first)
    uv: UvAttributes = {number: uv_attribute(number) for number in sets[1:]}
    shape = _shape(first, variant.faded, store)
    numbers_of = _Numbers(members)
    opacity = None if shape.opacity == "full" else store.channel(first.base_color_texture, 3, numbers_of("alpha"), uv)
    cutoff = Signal(numbers(numbers_of("alpha_cutoff"))) if shape.opacity == "mask" else None
    model = SurfaceModel(
        base_color=store.color(first.base_color_texture, numbers_of("base_color"), uv),
        roughness=store.channel(first.metallic_roughness_texture, 1, numbers_of("roughness"), uv),
        ior=Signal(numbers(numbers_of("ior"))),
        metal=shape.metal == "all",
        dull=shape.dull,
        solid=shape.solid,
        opacity=opacity,
        opacity_cutoff=cutoff,
        tinted=variant.tinted,
        faded=variant.faded,
    )
    makers: dict[Kind, Callable[[], Any]] = {
        "surface": lambda: surface_bsdf(_complete(model, shape, first, numbers_of, store, uv)),
        "lamp": lambda: surface_bsdf(_black(model)),
        "mirror": lambda: _masked(_mirror(model), model),
        "glass": lambda: _masked(_glass("dielectric", model, first), model),
        "pane": lambda: _masked(_glass("thindielectric", model, first), model),
    }
    return Finish(
        bsdf=makers[shape.kind](),
        members={member: number for number, member in enumerate(variants)},
        uv_sets=sets,
        tinted=variant.tinted,
        faded=variant.faded,
        emission=_emission(model, first, store, uv) if glows(first, store) else None,
        absorption=absorption(first),
    )


class _Numbers:
    """One field of every member of a family."""

    def __init__(self, members: Sequence[Material]) -> None:
        self._members = members

    def __call__(self, name: str) -> NDArray[np.float64]:
        return np.array([getattr(member, name) for member in self._members], dtype=np.float64)


def _complete(
    model: SurfaceModel, shape: _Shape, m: Material, numbers_of: _Numbers, store: TextureStore, uv: UvAttributes
) -> SurfaceModel:
    """Add to ``model`` the features that ``shape`` asks for."""

    def normal_map(texture: Texture | None, scale: str) -> NormalMap | None:
        return None if texture is None else NormalMap(store.normals(texture, uv), Signal(numbers(numbers_of(scale))))

    if shape.metal == "some":
        model.metallic = store.channel(m.metallic_roughness_texture, 2, numbers_of("metallic"), uv)
    if shape.specular:
        model.specular = store.channel(m.specular_texture, 3, numbers_of("specular"), uv)
        model.specular_color = store.color(m.specular_color_texture, numbers_of("specular_color"), uv)
    if shape.transmission:
        model.transmission = store.channel(m.transmission_texture, 0, numbers_of("transmission"), uv)
    model.normal = normal_map(m.normal_texture, "normal_scale")
    if shape.clearcoat:
        model.clearcoat = store.channel(m.clearcoat_texture, 0, numbers_of("clearcoat"), uv)
        model.clearcoat_roughness = store.channel(
            m.clearcoat_roughness_texture, 1, numbers_of("clearcoat_roughness"), uv
        )
        model.clearcoat_normal = normal_map(m.clearcoat_normal_texture, "clearcoat_normal_scale")
    if shape.sheen:
        model.sheen_color = store.color(m.sheen_color_texture, numbers_of("sheen_color"), uv)
        model.sheen_roughness = store.channel(m.sheen_roughness_texture, 3, numbers_of("sheen_roughness"), uv)
        model.sheen_albedo = store.table("sheen", microfacet.sheen_albedo_table)
    return model


def _black(model: SurfaceModel) -> SurfaceModel:
    """Absorbs all light, where it covers at all."""
    black = Signal(numbers(np.zeros((1, 3))))
    return SurfaceModel(
        black, model.roughness, model.ior, dull=True, opacity=model.opacity, opacity_cutoff=model.opacity_cutoff,
        faded=model.faded,
    )  # fmt: skip


def _mirror(model: SurfaceModel) -> Any:
    import mitsuba as mi

    tint = signal_texture(model, "metal")
    conductor = mi.load_dict({"type": "conductor", "material": "none", "specular_reflectance": tint})
    return mi.load_dict({"type": "twosided", "bsdf": conductor})


def _glass(plugin: str, model: SurfaceModel, m: Material) -> Any:
    import mitsuba as mi

    return mi.load_dict(
        {"type": plugin, "int_ior": m.ior, "ext_ior": 1.0, "specular_transmittance": signal_texture(model, "base")}
    )


def _masked(bsdf: Any, model: SurfaceModel) -> Any:
    import mitsuba as mi

    if model.opacity is None:
        return bsdf
    return mi.load_dict({"type": "mask", "opacity": signal_texture(model, "coverage"), "bsdf": bsdf})


def _emission(model: SurfaceModel, m: Material, store: TextureStore, uv: UvAttributes) -> Emission:
    covered = model if model.opacity is not None else None
    if m.unlit:
        return Emission(model.base_color, two_sided=True, model=covered, tinted=model.tinted)
    radiance = store.color(m.emission_texture, np.array([m.emission]), uv)
    return Emission(radiance, m.double_sided, covered, tinted=False)
