"""Surfaces of other models by the inputs of ``UsdPreviewSurface``: MaterialX's, Arnold's, RealityKit's, OmniPBR.

Names and defaults are those of MaterialX's definitions of nodes (``libraries/bxdf``, 1.39), which also has the
translation to ``UsdPreviewSurface``, and of NVIDIA's OmniPBR.mdl and OmniGlass.mdl. Arnold's are those of MaterialX.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pxr import Usd, UsdShade

from lippmann.color.primaries import ACES_AP1, P3_D65, REC2020
from lippmann.scene.readers.usd.records import Record

PREVIEW = "UsdPreviewSurface"
#: Blender's surface of a plain colour for what it writes for MaterialX alone.
_PLACEHOLDER = "previewShader"
#: Contexts of rendering whose surfaces are looked at where that for all of them is not read.
_CONTEXTS = ("mtlx", "mdl", "arnold")


@dataclass(frozen=True)
class _Model:
    """Inputs by those of ``UsdPreviewSurface``: name and default; and what multiplies them, with its default.

    ``subsurface`` is the share of light that is scattered below the surface, and has ``subsurface_color``;
    ``transmission_color`` tints what is let through in place of the base, within where there is a ``depth``. ``unread``
    are shares of what is left out, and ``numbers`` inputs that are left out unless they are numbers.
    """

    inputs: dict[str, tuple[str, Any]]
    weights: dict[str, tuple[str, float]] = field(default_factory=dict)
    coat_color: str = ""
    subsurface: str = ""
    transmission_color: str = ""
    unread: tuple[str, ...] = ()
    numbers: tuple[str, ...] = ()


_WHITE, _LIGHT_GREY = [1.0, 1.0, 1.0], [0.8, 0.8, 0.8]
_MODELS = {
    "ND_standard_surface_surfaceshader": _Model(
        {
            "diffuseColor": ("base_color", _LIGHT_GREY),
            "metallic": ("metalness", 0.0),
            "roughness": ("specular_roughness", 0.2),
            "ior": ("specular_IOR", 1.5),
            "clearcoat": ("coat", 0.0),
            "clearcoatRoughness": ("coat_roughness", 0.1),
            "emissiveColor": ("emission_color", _WHITE),
            "opacity": ("opacity", 1.0),
            "normal": ("normal", None),
            "transmission": ("transmission", 0.0),
            "thinWalled": ("thin_walled", 0.0),
            "specular": ("specular", 1.0),
            "highlightColor": ("specular_color", _WHITE),
            "sheenColor": ("sheen_color", _WHITE),
            "sheenRoughness": ("sheen_roughness", 0.3),
            "filmThickness": ("thin_film_thickness", 0.0),
            "filmIor": ("thin_film_IOR", 1.5),
            "depth": ("transmission_depth", 0.0),
        },
        {"diffuseColor": ("base", 1.0), "emissiveColor": ("emission", 0.0), "sheenColor": ("sheen", 0.0)},
        "coat_color",
        "subsurface",
        "transmission_color",
        ("specular_anisotropy", "transmission_scatter"),
        ("thin_film_thickness", "transmission_depth"),
    ),
    "ND_open_pbr_surface_surfaceshader": _Model(
        {
            "diffuseColor": ("base_color", _LIGHT_GREY),
            "metallic": ("base_metalness", 0.0),
            "roughness": ("specular_roughness", 0.3),
            "ior": ("specular_ior", 1.5),
            "clearcoat": ("coat_weight", 0.0),
            "clearcoatRoughness": ("coat_roughness", 0.0),
            "emissiveColor": ("emission_color", _WHITE),
            "opacity": ("geometry_opacity", 1.0),
            "normal": ("geometry_normal", None),
            "transmission": ("transmission_weight", 0.0),
            "thinWalled": ("geometry_thin_walled", 0.0),
            "specular": ("specular_weight", 1.0),
            "highlightColor": ("specular_color", _WHITE),
            "sheenColor": ("fuzz_color", _WHITE),
            "sheenRoughness": ("fuzz_roughness", 0.5),
            "film": ("thin_film_weight", 0.0),
            "filmThickness": ("thin_film_thickness", 0.5),
            "filmUnit": ("", 1000.0),  # micrometres
            "filmIor": ("thin_film_ior", 1.4),
            "depth": ("transmission_depth", 0.0),
        },
        {
            "diffuseColor": ("base_weight", 1.0),
            "emissiveColor": ("emission_luminance", 0.0),
            "sheenColor": ("fuzz_weight", 0.0),
        },
        "coat_color",
        "subsurface_weight",
        "transmission_color",
        ("specular_roughness_anisotropy", "transmission_scatter"),
        ("thin_film_thickness", "transmission_depth"),
    ),
    "ND_gltf_pbr_surfaceshader": _Model(
        {
            "diffuseColor": ("base_color", _WHITE),
            "metallic": ("metallic", 1.0),
            "roughness": ("roughness", 1.0),
            "ior": ("ior", 1.5),
            "clearcoat": ("clearcoat", 0.0),
            "clearcoatRoughness": ("clearcoat_roughness", 0.0),
            "emissiveColor": ("emissive", [0.0, 0.0, 0.0]),
            "opacity": ("alpha", 1.0),
            "normal": ("normal", None),
            "transmission": ("transmission", 0.0),
            "specular": ("specular", 1.0),
            "highlightColor": ("specular_color", _WHITE),
            "sheenColor": ("sheen_color", [0.0, 0.0, 0.0]),
            "sheenRoughness": ("sheen_roughness", 0.0),
            "film": ("iridescence", 0.0),
            "filmThickness": ("iridescence_thickness", 100.0),
            "filmIor": ("iridescence_ior", 1.3),
            "depth": ("attenuation_distance", 0.0),
            "depthColor": ("attenuation_color", _WHITE),
        },
        {"emissiveColor": ("emissive_strength", 1.0)},
        unread=("anisotropy_strength", "dispersion"),
        numbers=("iridescence_thickness", "attenuation_distance"),
    ),
    # Its emissive_intensity counts for a camera's exposure: the colour alone is taken.
    "OmniPBR": _Model(
        {
            "diffuseColor": ("diffuse_color_constant", [0.2, 0.2, 0.2]),
            "metallic": ("metallic_constant", 0.0),
            "roughness": ("reflection_roughness_constant", 0.5),
            "emissiveColor": ("emissive_color", [1.0, 0.1, 0.1]),
            "opacity": ("opacity_constant", 1.0),
            "opacityThreshold": ("opacity_threshold", 0.0),
        },
        {"emissiveColor": ("enable_emission", 0.0)},
        unread=("albedo_desaturation", "texture_rotate", "project_uvw"),
    ),
}
_MODELS |= {
    "arnold:standard_surface": _MODELS["ND_standard_surface_surfaceshader"],
    "arnold:openpbr_surface": _MODELS["ND_open_pbr_surface_surfaceshader"],
    "ND_realitykit_pbr_surfaceshader": _Model(
        {
            "diffuseColor": ("baseColor", [0.18, 0.18, 0.18]),
            "metallic": ("metallic", 0.0),
            "roughness": ("roughness", 0.5),
            "clearcoat": ("clearcoat", 0.0),
            "clearcoatRoughness": ("clearcoatRoughness", 0.0),
            "emissiveColor": ("emissiveColor", [0.0, 0.0, 0.0]),
            "opacity": ("opacity", 1.0),
            "opacityThreshold": ("opacityThreshold", 0.0),
            "normal": ("normal", None),
        }
    ),
    "ND_realitykit_unlit_surfaceshader": _Model(
        {
            "diffuseColor": ("color", _WHITE),
            "opacity": ("opacity", 1.0),
            "opacityThreshold": ("opacityThreshold", 0.0),
            "unlit": ("", 1.0),
        }
    ),
    "ND_surface_unlit": _Model(
        {"diffuseColor": ("emission_color", _WHITE), "opacity": ("opacity", 1.0), "unlit": ("", 1.0)},
        {"diffuseColor": ("emission", 1.0)},
    ),
    "arnold:flat": _Model({"diffuseColor": ("color", _WHITE), "unlit": ("", 1.0)}),
    "OmniPBR_Opacity": _MODELS["OmniPBR"],
    "OmniPBR_ClearCoat": replace(
        _MODELS["OmniPBR"],
        inputs={
            **_MODELS["OmniPBR"].inputs,
            "clearcoat": ("clearcoat_weight", 1.0),
            "clearcoatRoughness": ("clearcoat_reflection_roughness", 0.0),
        },
    ),
    "OmniGlass": _Model(
        {
            "diffuseColor": ("glass_color", _WHITE),
            "roughness": ("frosting_roughness", 0.0),
            "ior": ("glass_ior", 1.491),
            "transmission": ("", 1.0),  # of all that it is
            "thinWalled": ("thin_walled", 0.0),
        }
    ),
}
_MODELS["OmniPBR_ClearCoat_Opacity"] = _MODELS["OmniPBR_ClearCoat"]
#: Pictures of OmniPBR that stand for its constants: their channel, and what must be set for them to count.
_OMNI_PICTURES = {
    "diffuseColor": ("diffuse_texture", "rgb", None),
    "normal": ("normalmap_texture", "rgb", None),
    "metallic": ("metallic_texture", "r", "metallic_texture_influence"),
    "roughness": ("reflectionroughness_texture", "r", "reflection_roughness_texture_influence"),
    "opacity": ("opacity_texture", "r", "enable_opacity_texture"),
    "emissiveColor": ("emissive_color_texture", "rgb", "enable_emission"),
}
_OMNI_PACKED = {"roughness": "g", "metallic": "b"}  # of ORM_texture


def surface_of(material: UsdShade.Material) -> tuple[UsdShade.Shader, str]:
    """The surface that is read, and its kind; of a kind that is not read, if there is no other."""
    surfaces = [material.ComputeSurfaceSource(context)[0] for context in ("", *_CONTEXTS)]
    kinds = [_kind_of(surface) if surface else "" for surface in surfaces]
    if surfaces[0] and surfaces[0].GetPrim().GetName() == _PLACEHOLDER and any(map(is_read, kinds[1:])):
        kinds[0] = ""
    best = next((number for number, kind in enumerate(kinds) if is_read(kind)), None)
    if best is None:
        best = next((number for number, kind in enumerate(kinds) if kind), 0)
    return surfaces[best], kinds[best]


def is_read(kind: str) -> bool:
    """Whether surfaces of a kind are read."""
    return kind == PREVIEW or kind in _MODELS


def _kind_of(surface: UsdShade.Shader) -> str:
    kind = str(surface.GetShaderId() or surface.GetSourceAssetSubIdentifier("mdl") or "")
    return PREVIEW if kind == f"ND_{PREVIEW}_surfaceshader" else kind.split("(")[0]


def unread_inputs(kind: str, given: Record) -> list[str]:
    """Inputs that a surface has, and that make it look otherwise than it is shown."""
    model = _MODELS.get(kind, _Model({}))
    unread = [name for name in model.unread if name in given and np.any(given[name].get("value", 1.0))]
    return unread + [name for name in model.numbers if name in given and "value" not in given[name]]


def as_preview(kind: str, given: Record) -> Record:
    """The inputs of a surface of any kind that is read, by the names of ``UsdPreviewSurface``."""
    if kind == PREVIEW:
        return given
    model = _MODELS[kind]
    inputs: Record = {}
    for preview, (name, default) in model.inputs.items():
        source = given.get(name, None if default is None else {"value": default})
        if source is not None:
            inputs[preview] = source
    if kind.startswith("OmniPBR"):
        if not _number(given, "enable_clearcoat", 0.0):
            inputs.pop("clearcoat", None)
        inputs.update(_omni_pictures(given))
        if "texture" in inputs["diffuseColor"]:
            brightness, more = _number(given, "albedo_brightness", 1.0), _number(given, "albedo_add", 0.0)
            inputs["diffuseColor"] = _affine(inputs["diffuseColor"], brightness, more)
        inputs["diffuseColor"] = _affine(inputs["diffuseColor"], _numeric(given.get("diffuse_tint"), 1.0), 0.0)
        if not _number(given, "enable_opacity", float(kind.endswith("Opacity"))):
            inputs.pop("opacity")
    if kind == "ND_gltf_pbr_surfaceshader":
        inputs["thinWalled"] = {"value": float(_number(given, "thickness", 0.0) == 0.0)}
        mode = _number(given, "alpha_mode", 0.0)
        if mode == 0.0:
            inputs.pop("opacity")
        elif mode == 1.0:
            inputs["opacityThreshold"] = given.get("alpha_cutoff", {"value": 0.5})
    for preview, (name, usual) in model.weights.items():
        weight = _number(given, name, usual)
        inputs[preview] = _affine(inputs[preview], weight, 0.0)
    if share := _number(given, model.subsurface, 0.0):
        inputs["diffuseColor"] = _mix(inputs["diffuseColor"], given.get("subsurface_color", {"value": _WHITE}), share)
    if through := _number(inputs, "transmission", 0.0) if model.transmission_color else 0.0:
        tint = given.get(model.transmission_color, {"value": _WHITE})
        if _number(inputs, "depth", 0.0) > 0.0 and not _number(inputs, "thinWalled", 0.0):
            inputs["depthColor"], tint = tint, {"value": _WHITE}
        inputs["diffuseColor"] = _mix(inputs["diffuseColor"], tint, through)
    coat, tint = _number(inputs, "clearcoat", 0.0), given.get(model.coat_color)
    if coat > 0.0 and tint is not None:
        inputs["diffuseColor"] = _under_coat(inputs["diffuseColor"], tint, coat)
    if isinstance(opacity := inputs.get("opacity", {}).get("value"), list):
        inputs["opacity"] = {"value": sum(opacity) / len(opacity)}
    return inputs


def _omni_pictures(given: Record) -> Record:
    inputs: Record = {}
    for preview, (name, channel, switch) in _OMNI_PICTURES.items():
        asset = given.get(name)
        if asset is not None and asset.get("asset", {}).get("name") and (switch is None or _number(given, switch, 0.0)):
            is_in_alpha = name == "opacity_texture" and _number(given, "opacity_mode", 1.0) == 0.0
            inputs[preview] = _picture(asset, "a" if is_in_alpha else channel, preview, given)
    packed = given.get("ORM_texture")
    if packed is not None and packed.get("asset", {}).get("name") and _number(given, "enable_ORM_texture", 0.0):
        inputs |= {preview: _picture(packed, channel, preview, given) for preview, channel in _OMNI_PACKED.items()}
    return inputs


def _picture(asset: Record, channel: str, preview: str, given: Record) -> Record:
    repeat = {"value": "repeat"}
    place = {"scale": given.get("texture_scale"), "translation": given.get("texture_translate")}
    texture: Record = {"file": asset, "wrapS": repeat, "wrapT": repeat, "st": {"transform": place}}
    if preview == "normal":
        texture |= _AS_DIRECTIONS
    elif channel != "rgb":
        texture["sourceColorSpace"] = {"value": "raw"}
    return {"texture": texture, "channel": channel}


_AS_DIRECTIONS: Record = {"scale": {"value": [2.0, 2.0, 2.0, 1.0]}, "bias": {"value": [-1.0, -1.0, -1.0, 0.0]}}


def _under_coat(base: Record, tint: Record, coat: float) -> Record:
    """A base colour below a coloured coat, which light passes; where both are pictures, the base alone."""
    if isinstance(color := tint.get("value"), list):
        return _affine(base, 1.0 + coat * (np.array(color) - 1.0), 0.0)
    if coat == 1.0 and isinstance(color := base.get("value"), list):
        return _affine(tint, color, 0.0)
    return base


def _mix(below: Record, above: Record, share: float) -> Record:
    """One colour over another; of two pictures that of the larger share."""
    if (color := _numeric(above)) is not None:
        return _affine(below, 1.0 - share, share * color)
    if (color := _numeric(below)) is not None:
        return _affine(above, share, (1.0 - share) * color)
    return above if share >= 0.5 else below


def _affine(source: Record, factor: ArrayLike, shift: ArrayLike) -> Record:
    """A value or a picture times a factor, plus a shift: numbers, or one of each for a channel."""
    if "texture" in source:
        node = source["texture"]
        scale, bias = (node.get(name, {}).get("value", [usual] * 4) for name, usual in (("scale", 1.0), ("bias", 0.0)))
        # The alpha of a colour does not count, and a number may be that of any channel.
        factors, shifts = (np.pad(each := np.ravel(given)[:4], (0, 4 - len(each)), "edge") for given in (factor, shift))
        own = {"scale": {"value": (factors * scale).tolist()}, "bias": {"value": (factors * bias + shifts).tolist()}}
        return {**source, "texture": {**node, **own}}
    value = _numeric(source)
    if value is None:
        return source
    given = source["value"]
    return {"value": (value * factor + shift)[..., : len(given) if isinstance(given, list) else None].tolist()}


def _numeric(source: Record | None, default: float | None = None) -> Any:
    """The number of a source, or its first three, as an array; the default, if any, where it has none."""
    value = (source or {}).get("value", default)
    if value is None or isinstance(value, str):
        return None
    return (
        np.pad(value[:3], (0, 3 - len(value[:3])), "edge") if isinstance(value, list) else np.array(value, np.float64)
    )


def _number(given: Record, name: str, default: float) -> float:
    value = given.get(name, {}).get("value", default)
    return float(value) if isinstance(value, (bool, int, float)) else default


_CODED = re.compile(r"(?!.*lin).*(?:srgb|g\d\d|gamma|rec709_display)", re.IGNORECASE)


#: Chromaticities of red, green, blue and white of colour spaces, by what their names hold.
_PRIMARIES = {"ap1|acescg": ACES_AP1, "p3": P3_D65, "2020": REC2020}


def primaries_of(space: str) -> Sequence[float] | None:
    """The chromaticities of a colour space of MaterialX or USD; None for those of Rec. 709 and unknown ones."""
    return next((each for words, each in _PRIMARIES.items() if re.search(words, space, re.IGNORECASE)), None)


def is_coded(space: str) -> bool:
    """Whether values in a colour space are codes, near enough those of sRGB, and no linear light."""
    return _CODED.match(space) is not None


_WRAPS = {"periodic": "repeat", "clamp": "clamp", "mirror": "mirror", "constant": "black", "black": "black"}


def materialx_node(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record | None:
    """The node of ``UsdPreviewSurface`` that equals a node of MaterialX; None for nodes that are not read."""
    for beginning, read in _NODES.items():
        if kind.startswith(beginning):
            return read(kind, channel, given, node)
    return None


def _image(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record:
    """An image: codes of sRGB where its file says so; others by what kind of values it gives."""
    attribute = node.GetAttribute("inputs:file")
    space = str(attribute.GetColorSpace()) if attribute else ""
    is_color = "color" in kind
    texture: Record = {
        "file": given.get("file", {}),
        "sourceColorSpace": {"value": "sRGB" if is_coded(space) else "auto" if is_color and not space else "raw"},
        "wrapS": {"value": _WRAPS.get(given.get("uaddressmode", {}).get("value", ""), "repeat")},
        "wrapT": {"value": _WRAPS.get(given.get("vaddressmode", {}).get("value", ""), "repeat")},
        "st": given.get("texcoord", {"primvar": "st"}),
    }
    if "uvtiling" in given or "uvoffset" in given:
        shift = given.get("uvoffset", {}).get("value", [0.0, 0.0])
        translation = {"value": [-number for number in shift]}
        texture["st"] = {"transform": {"in": texture["st"], "scale": given.get("uvtiling"), "translation": translation}}
    return {"texture": texture, "channel": "rgb" if is_color or "vector" in kind else "r"}


def _arnold_image(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record:
    """An image, whose outputs are the whole of it and its channels; its file may stand in a text."""
    file = given.get("filename", {})
    attribute = node.GetAttribute("inputs:filename")
    if attribute and isinstance(name := file.get("value"), str):
        layer = attribute.GetPropertyStack(Usd.TimeCode.Default())[0].layer.realPath
        file = {"asset": {"name": name, "found": "", "folder": os.path.dirname(layer)}}
    space = str(given.get("color_space", {}).get("value", "auto"))
    texture: Record = {
        "file": file,
        "sourceColorSpace": {"value": "auto" if space in ("", "auto") else "sRGB" if is_coded(space) else "raw"},
        "wrapS": {"value": _WRAPS.get(given.get("swrap", {}).get("value", ""), "repeat")},
        "wrapT": {"value": _WRAPS.get(given.get("twrap", {}).get("value", ""), "repeat")},
    }
    return {"texture": texture, "channel": channel if channel in "rgba" else "rgb"}


def _arnold_normal_map(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record | None:
    return _normal_map(kind, channel, {"in": given.get("input", {})}, node)


def _normal_map(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record | None:
    source = given.get("in", {})
    if "texture" not in source:
        return None
    return {**source, "texture": {**source["texture"], **_AS_DIRECTIONS}}


def _gltf_image(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record | None:
    """An image of glTF's materials, whose colours may be tinted; None of one that is placed otherwise than whole."""
    if given.keys() & {"offset", "rotate", "scale"}:
        return None
    image = _image(f"{kind}_color" if "color" in kind else kind, channel, given, node)
    if channel == "outa":
        return {**image, "channel": "a"}
    return _affine(image, _numeric(given.get("color") or given.get("factor"), 1.0), 0.0)


def _gltf_normal_map(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record | None:
    return _normal_map(kind, channel, {"in": _gltf_image("vector", channel, given, node) or {}}, node)


def _passed_on(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record | None:
    return given.get("in", given.get("value"))


def _separate(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record | None:
    source, chosen = given.get("in", {}), str(given.get("channels", {}).get("value", ""))
    index = {"outr": "r", "outg": "g", "outb": "b", "outa": "a", "outx": "r", "outy": "g", "outz": "b"}.get(channel)
    index = index or chosen.translate(str.maketrans("xyzw", "rgba")) or "rgba"[int(_number(given, "index", 0.0)) % 4]
    if index not in tuple("rgba"):
        return None
    if (value := _numeric(source)) is not None:
        return {"value": float(np.ravel(value)["rgba".index(index) % value.size])}
    return {**source, "channel": index} if "texture" in source else None


def _arithmetic(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record | None:
    """Sum, difference, product or quotient of two values, or of an image, or coordinates, and a value."""
    operation = kind.split("_")[1]
    one, other = (_fed(given, node, name, float(operation in ("multiply", "divide"))) for name in ("in1", "in2"))
    if "in1" not in given and "value" in one:
        one = {"value": 0.0}
    number, sign = _numeric(other), -1.0 if operation == "subtract" else 1.0
    if number is not None and operation == "divide":
        return _computed(kind, one, 1.0 / np.where(number == 0.0, 1.0, number), 0.0)
    if number is None and operation != "divide":
        one, number = other, _numeric(one)
        if number is not None and operation == "subtract":
            return _computed(kind, one, -1.0, number)
    if number is None:
        return None
    return _computed(kind, one, number, 0.0) if operation == "multiply" else _computed(kind, one, 1.0, sign * number)


def _blend(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record | None:
    below, above, share = (_fed(given, node, name, 0.0) for name in ("bg", "fg", "mix"))
    weight = _numeric(share)
    if weight is None:
        return None
    if (value := _numeric(above)) is not None:
        return _computed(kind, below, 1.0 - weight, weight * value)
    value = _numeric(below)
    return None if value is None else _computed(kind, above, weight, (1.0 - weight) * value)


def _invert(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record | None:
    return _computed(kind, _fed(given, node, "in", 0.0), -1.0, _numeric(given.get("amount"), 1.0))


def _remap(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record | None:
    low, high = _numeric(given.get("inlow"), 0.0), _numeric(given.get("inhigh"), 1.0)
    to_low, to_high = _numeric(given.get("outlow"), 0.0), _numeric(given.get("outhigh"), 1.0)
    factor = (to_high - to_low) / np.where(high == low, 1.0, high - low)
    return _computed(kind, _fed(given, node, "in", 0.0), factor, to_low - factor * low)


def _rotate(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record | None:
    """What is turned by nothing, as Blender's placed textures are three times; None of others."""
    return given.get("in") if _fed(given, node, "amount", 0.0).get("value") == 0.0 else None


def _fed(given: Record, node: Usd.Prim, name: str, usual: float) -> Record:
    """An input, or its default; nothing, where a node feeds it that is not read."""
    attribute = node.GetAttribute(f"inputs:{name}")
    is_fed = bool(attribute) and attribute.HasAuthoredConnections()
    return given.get(name, {} if is_fed else {"value": usual})  # type: ignore[no-any-return]


def _computed(kind: str, source: Record, factor: ArrayLike, shift: ArrayLike) -> Record | None:
    """A value, an image, or coordinates by their places, times a factor, plus a shift; None of what meshes have."""
    if "vector" in kind and source.keys() & {"primvar", "transform"}:
        scale, translation = ({"value": np.resize(each, 2).tolist()} for each in (factor, shift))
        return {"transform": {"in": source, "scale": scale, "translation": translation}}
    return _affine(source, factor, shift) if source.keys() & {"texture", "value"} else None


def _join(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record | None:
    """A colour of three numbers; None where one of them is a picture."""
    numbers = [_numeric(_fed(given, node, f"in{place}", 0.0)) for place in (1, 2, 3)]
    return None if any(each is None for each in numbers) else {"value": [float(np.ravel(each)[0]) for each in numbers]}


def _place(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record:
    """Texture coordinates that are divided by a scale, turned clockwise and moved back, all about a pivot."""
    pivot, offset = (np.array(given.get(name, {}).get("value", [0.0, 0.0])) for name in ("pivot", "offset"))
    scale = np.array(given.get("scale", {}).get("value", [1.0, 1.0]))
    angle = _number(given, "rotate", 0.0)
    scale = 1.0 / np.where(scale == 0.0, 1.0, scale)
    cos, sin = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    shift = pivot - offset - np.array([[cos, sin], [-sin, cos]]) @ (scale * pivot)
    return {
        "transform": {
            "in": given.get("texcoord", {"primvar": "st"}),
            "scale": {"value": scale.tolist()},
            "rotation": {"value": -angle},
            "translation": {"value": shift.tolist()},
        }
    }


def _coordinates(kind: str, channel: str, given: Record, node: Usd.Prim) -> Record:
    usual = "displayColor" if "color" in kind else "st"
    name = (given.get("geomprop") or given.get("varname") or {}).get("value", usual)
    return {"primvar": name, "fallback": given.get("default")}


_NODES: dict[str, Callable[[str, str, Record, Usd.Prim], Record | None]] = {
    "ND_image_": _image,
    "ND_tiledimage_": _image,
    "ND_normalmap": _normal_map,
    "ND_normal_map_decode": _normal_map,
    "ND_RealityKitTexture2D_": _image,
    "ND_convert_": _passed_on,
    "ND_dot_": _passed_on,
    "ND_constant_": _passed_on,
    **{f"ND_{operation}_": _arithmetic for operation in ("add", "subtract", "multiply", "divide")},
    "ND_mix_": _blend,
    "ND_invert_": _invert,
    "ND_remap_": _remap,
    "ND_rotate3d_": _rotate,
    "ND_combine3_": _join,
    "ND_swizzle_": _separate,
    "ND_geomcolor_": _coordinates,
    "ND_place2d_": _place,
    "ND_extract_": _separate,
    "ND_separate": _separate,
    "ND_texcoord_": _coordinates,
    "ND_geompropvalue_": _coordinates,
    "ND_gltf_normalmap": _gltf_normal_map,
    "ND_gltf_colorimage": _gltf_image,
    "ND_gltf_image_": _gltf_image,
    "arnold:image": _arnold_image,
    "arnold:normal_map": _arnold_normal_map,
}
