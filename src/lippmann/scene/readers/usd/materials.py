"""``UsdPreviewSurface`` in metallic-roughness terms (UsdPreviewSurface Specification 2.6)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import decode_srgb
from lippmann.scene.parsing import texture_maps
from lippmann.scene.parsing.udim import TiledImage
from lippmann.scene.readers.usd.assets import Assets
from lippmann.scene.readers.usd.records import Record
from lippmann.scene.values.description import AlphaMode, Color, Image, Material, Matrix, Texture, Wrap

#: Others are black beyond the picture: ``black``, and ``useMetadata``, of which pictures that are read have none.
_WRAPS: dict[str, Wrap] = {"repeat": "repeat", "mirror": "mirror", "clamp": "clamp"}
_CHANNELS = {"r": 0, "g": 1, "b": 2, "a": 3}
#: The roughness of surfaces that say nothing of it.
_DULL = 0.5
#: Of no reflection but what the specular colour says.
_ENDLESS_IOR = 1000.0
#: v upwards to v downwards, and back.
_FLIP = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, 1.0]])

Plane = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Surface:
    """A material, and what it reads from meshes.

    Attributes
    ----------
    uv_names:
        Names of its texture coordinates in the order of their sets; empty where any do.
    color, opacity:
        Values of meshes that lack the colour or display opacity that it reads; None where it reads none.
    color_name:
        The primvar that is its colour.
    tiled:
        Its textures in tiles, with the transformation of their coordinates to those of tiles.
    """

    material: Material
    uv_names: tuple[str, ...]
    color: Color | None = None
    opacity: float | None = None
    color_name: str = "displayColor"
    tiled: tuple[Texture, ...] = ()


@dataclass(eq=False)
class SurfaceReader:
    """Makes materials of the inputs of ``UsdPreviewSurface``.

    ``notes`` says what is not honoured; ``unit`` is that of the stage in metres.
    """

    assets: Assets
    notes: dict[str, None]
    unit: float
    _uv_names: list[str] = field(default_factory=list)
    _tiled: list[Texture] = field(default_factory=list)

    def read(self, record: Record) -> Surface:
        """The material of a record.

        Raises
        ------
        SceneError
            A texture is damaged.
        """
        self._uv_names, self._tiled = [], []
        inputs = record["inputs"]
        name = record["name"]
        if _is_displaced(inputs):
            self.notes["displacement is not honoured"] = None
        color, color_texture = self._color(inputs, "diffuseColor", (0.18, 0.18, 0.18))
        emission, emission_texture = self._color(inputs, "emissiveColor", (0.0, 0.0, 0.0))
        material = Material(
            name=name,
            base_color=color,
            base_color_texture=color_texture,
            emission=emission,
            emission_texture=emission_texture,
            ior=max(self._number(inputs, "ior", 1.5), 1.0) or 1.5,
            double_sided=True,
            unlit=self._number(inputs, "unlit", 0.0) > 0.0,
        )
        material = self._with_reflection(material, inputs)
        material = self._with_opacity(material, inputs)
        material = self._with_coat(material, inputs)
        material = self._with_highlight_and_sheen(material, inputs)
        transmission = min(max(self._number(inputs, "transmission", material.transmission), 0.0), 1.0)
        is_solid = transmission > material.transmission and not self._number(inputs, "thinWalled", 0.0)
        material = replace(material, transmission=transmission, thickness=float(is_solid))
        material = self._with_film_and_depth(material, inputs)
        material = replace(material, normal_texture=self._normal_map(inputs))
        by_color, by_opacity = self._reads(inputs, "diffuseColor"), self._reads(inputs, "opacity")
        for unread in inputs.keys() - {"diffuseColor", "opacity"}:
            if "primvar" in inputs[unread]:
                self._note_unread(unread, inputs[unread])
        if by_color is not None:
            material = replace(material, base_color=(1.0, 1.0, 1.0))
        if by_opacity is not None:
            material = replace(material, alpha=1.0)
        return Surface(
            material,
            tuple(self._uv_names),
            None if by_color is None else _color_of(by_color.get("fallback"), (1.0, 1.0, 1.0)),
            None if by_opacity is None else min(max(_scalar_of(by_opacity.get("fallback"), 1.0), 0.0), 1.0),
            "displayColor" if by_color is None else str(by_color["primvar"] or "displayColor"),
            tuple(self._tiled),
        )

    def _reads(self, inputs: Record, name: str) -> Record | None:
        """The source of an input, if that is a colour or the display opacity of the mesh."""
        source = inputs.get(name)
        if source is None or "primvar" not in source:
            return None
        if name == "opacity" and source["primvar"] not in ("displayOpacity", ""):
            self._note_unread(name, source)
            return None
        return cast(Record, source)

    def _note_unread(self, name: str, source: Record) -> None:
        self.notes[f"{name} by the primvar '{source['primvar']}' is not read: its fallback is taken"] = None

    def _with_reflection(self, material: Material, inputs: Record) -> Material:
        roughness, rough = self._scalar(inputs, "roughness", _DULL)
        if self._number(inputs, "useSpecularWorkflow", 0.0):
            specular, texture = self._color(inputs, "specularColor", (0.0, 0.0, 0.0))
            material = replace(
                material, ior=_ENDLESS_IOR, specular_color=_fraction(specular), specular_color_texture=texture
            )
            metallic, metal = 0.0, None
        else:
            metallic, metal = self._scalar(inputs, "metallic", 0.0)
        packed = None
        if rough is not None or metal is not None:
            lead = cast(Texture, rough or metal)
            planes = [None if each is None else texture_maps.unit(each.image)[..., 0] for each in (rough, metal)]
            packed = replace(lead, image=texture_maps.pack_channels(None, *planes, name=lead.image.name))
        return replace(material, roughness=roughness, metallic=metallic, metallic_roughness_texture=packed)

    def _with_opacity(self, material: Material, inputs: Record) -> Material:
        opacity, texture = self._scalar(inputs, "opacity", 1.0)
        threshold = self._number(inputs, "opacityThreshold", 0.0)
        if opacity >= 1.0 and texture is None and "primvar" not in inputs.get("opacity", {}):
            return material
        if texture is not None:
            alpha = texture_maps.unit(texture.image)[..., 0]
            own = material.base_color_texture
            image = texture_maps.with_alpha(None if own is None else _encode(own), alpha, texture.image.name)
            carrier = texture if own is None else own
            material = replace(material, base_color_texture=replace(carrier, image=image, srgb=True))
        is_presence = inputs.get("opacityMode", {}).get("value") == "presence"
        is_plain = texture is None and "primvar" not in inputs.get("opacity", {}) and not threshold
        if is_plain and opacity == 0.0 and not is_presence and material.metallic == 0.0 and material.roughness < _DULL:
            # Glass, as Blender writes it: the highlights stay, and what lies behind is neither blurred nor tinted.
            return replace(
                material, base_color=(1.0, 1.0, 1.0), base_color_texture=None, roughness=0.0, transmission=1.0
            )
        mode: AlphaMode = "mask" if threshold > 0.0 else "blend"
        if mode == "blend" and not is_presence:
            self.notes["highlights fade with opacity, as opacityMode 'presence' has it"] = None
        return replace(material, alpha=opacity, alpha_mode=mode, alpha_cutoff=threshold or 0.5)

    def _with_coat(self, material: Material, inputs: Record) -> Material:
        coat, texture = self._scalar(inputs, "clearcoat", 0.0)
        rough, rough_texture = self._scalar(inputs, "clearcoatRoughness", 0.01)
        return replace(
            material,
            clearcoat=coat,
            clearcoat_texture=_in_channel(texture, 0),
            clearcoat_roughness=rough,
            clearcoat_roughness_texture=_in_channel(rough_texture, 1),
        )

    def _with_highlight_and_sheen(self, material: Material, inputs: Record) -> Material:
        """Of surfaces that ``UsdPreviewSurface`` has no words for."""
        if "specular" not in inputs:
            return material
        specular, texture = self._scalar(inputs, "specular", 1.0)
        color, color_texture = self._color(inputs, "highlightColor", (1.0, 1.0, 1.0))
        sheen, sheen_texture = self._color(inputs, "sheenColor", (0.0, 0.0, 0.0))
        rough, rough_texture = self._scalar(inputs, "sheenRoughness", 0.0)
        return replace(
            material,
            specular=specular,
            specular_texture=_in_alpha(texture),
            specular_color=_fraction(color),
            specular_color_texture=color_texture,
            sheen_color=_fraction(sheen),
            sheen_color_texture=sheen_texture,
            sheen_roughness=rough,
            sheen_roughness_texture=_in_alpha(rough_texture),
        )

    def _with_film_and_depth(self, material: Material, inputs: Record) -> Material:
        """A thin film, and the distance within at which light has the colour of what is let through."""
        thickness = self._number(inputs, "filmThickness", 0.0) * self._number(inputs, "filmUnit", 1.0)
        if thickness > 0.0:
            film, texture = self._scalar(inputs, "film", 1.0)
            material = replace(
                material,
                iridescence=film,
                iridescence_texture=_in_channel(texture, 0),
                iridescence_ior=max(self._number(inputs, "filmIor", 1.5), 1.0),
                iridescence_thickness_maximum=thickness,
            )
        depth = self._number(inputs, "depth", 0.0) * self.unit
        if depth > 0.0 and material.thickness:
            color = _fraction(self._color(inputs, "depthColor", (1.0, 1.0, 1.0))[0])
            material = replace(material, attenuation_color=color, attenuation_distance=depth)
        return material

    def _number(self, inputs: Record, name: str, default: float) -> float:
        return _scalar_of(inputs.get(name), default)

    def _scalar(self, inputs: Record, name: str, default: float) -> tuple[float, Texture | None]:
        """A factor in [0, 1] and its texture, whose first channel holds the values."""
        source = inputs.get(name)
        if source is None or "texture" not in source:
            value = source["fallback"] if source is not None and "primvar" in source else source
            return min(max(_scalar_of(value, default), 0.0), 1.0), None
        texture = self._texture(source)
        if texture is None:
            return min(max(_fallback(source["texture"], default)[0], 0.0), 1.0), None
        values = _values(texture, source["texture"], self._is_srgb(source["texture"], texture.image))
        channel = min(_CHANNELS.get(source["channel"], 0), values.shape[2] - 1)
        plane = np.clip(values[..., channel : channel + 1], 0.0, 1.0)
        return 1.0, replace(texture, image=Image(texture.image.name, plane), srgb=False)

    def _color(self, inputs: Record, name: str, default: Color) -> tuple[Color, Texture | None]:
        """A colour, which is a factor of its texture."""
        source = inputs.get(name)
        if source is None:
            return default, None
        if "primvar" in source:
            return _color_of(source.get("fallback"), (1.0, 1.0, 1.0)), None
        if "texture" not in source:
            return _color_of(source, default), None
        texture = self._texture(source)
        if texture is None:
            red, green, blue, _ = _fallback(source["texture"], *default)
            return (max(red, 0.0), max(green, 0.0), max(blue, 0.0)), None
        srgb = self._is_srgb(source["texture"], texture.image)
        if texture.image.pixels.dtype != np.uint8 and name != "emissiveColor":  # linear light may exceed 1
            texture = replace(texture, image=replace(texture.image, pixels=np.minimum(texture.image.pixels, 1.0)))
        scale, bias = _scale_bias(source["texture"])
        pixels = texture.image.pixels
        whole = source["channel"] in ("rgb", "") or pixels.shape[2] == 1
        if whole and not any(bias[:3]) and min(scale[:3]) >= 0.0:
            image = texture_maps.without_alpha(texture.image) if pixels.shape[2] == 4 else texture.image
            return (scale[0], scale[1], scale[2]), replace(texture, image=image, srgb=srgb)
        values = _values(texture, source["texture"], srgb)
        if not whole:
            channel = min(_CHANNELS.get(source["channel"], 0), values.shape[2] - 1)
            values = np.repeat(values[..., channel : channel + 1], 3, axis=2)
        image = Image(texture.image.name, np.clip(values[..., :3], 0.0, None))
        return (1.0, 1.0, 1.0), replace(texture, image=image, srgb=False)

    def _normal_map(self, inputs: Record) -> Texture | None:
        source = inputs.get("normal")
        if source is None or "texture" not in source:
            return None
        texture = self._texture(source)
        if texture is None or texture.image.pixels.shape[2] < 3:
            return None
        scale, bias = _scale_bias(source["texture"])
        pixels = texture.image.pixels
        if scale[:3] == (2.0, 2.0, 2.0) and bias[:3] == (-1.0, -1.0, -1.0):
            image = texture_maps.without_alpha(texture.image) if pixels.shape[2] == 4 else texture.image
            return replace(texture, image=image, srgb=False)
        directions = _values(texture, source["texture"], False)[..., :3]
        coded = np.clip(0.5 * directions + 0.5, 0.0, 1.0).astype(np.float32)
        return replace(texture, image=Image(texture.image.name, coded), srgb=False)

    def _texture(self, source: Record) -> Texture | None:
        """An image and its sampler; its values are those of the file."""
        node = source["texture"]
        asset = node.get("file", {}).get("asset")
        if asset is None or not asset["name"]:
            return None
        image = self.assets.image(asset)
        if image is None:
            return None
        uv_name, transform = _coordinates(node.get("st"))
        if uv_name not in self._uv_names:
            self._uv_names.append(uv_name)
        wraps = [_WRAPS.get(str(node.get(key, {}).get("value", ""))) for key in ("wrapS", "wrapT")]
        uv_set = self._uv_names.index(uv_name)
        if "value" in node.get("st", {}):
            image, wraps = _texel(image, *_pair(node["st"], (0.0, 0.0))), ["clamp", "clamp"]
        if isinstance(image, TiledImage):
            self._tiled.append(Texture(image, srgb=False, uv_transform=transform, uv_set=uv_set))
            wraps, transform = [None, None], image.inside @ transform  # no tile, no colour: as in OpenUSD's Storm
        border = [2 * int(wrap is None) for wrap in wraps]
        inside = _inside_border(image, border[0], border[1])
        return Texture(
            image=image if not any(border) else _with_border(image, border[0], border[1]),
            srgb=False,
            wrap_u=wraps[0] or "clamp",
            wrap_v=wraps[1] or "clamp",
            uv_transform=inside @ transform,
            uv_set=uv_set,
        )

    def _is_srgb(self, node: Record, image: Image) -> bool:
        """``auto``: pictures of 8 bits with three channels or more are sRGB-coded."""
        space = str(node.get("sourceColorSpace", {}).get("value", "auto"))
        if space == "auto":
            return image.pixels.dtype == np.uint8 and image.pixels.shape[2] >= 3
        return space.lower() == "srgb"


def _texel(image: Image, u: float, v: float) -> Image:
    """The texel at coordinates that are the same everywhere, v upwards."""
    height, width = image.pixels.shape[:2]
    row = height - 1 - int(np.clip(v * height, 0, height - 1))
    column = int(np.clip(u * width, 0, width - 1))
    return Image(image.name, image.pixels[row : row + 1, column : column + 1])


def _with_border(image: Image, columns: int, rows: int) -> Image:
    """An image with so many columns and rows more at its ends, the last of them black, which clamping repeats.

    The others repeat the image's own, so that interpolation darkens nothing inside of it.
    """
    sides = [(max(count - 1, 0),) * 2 for count in (rows, columns)]
    within = np.pad(image.pixels, (*sides, (0, 0)), "edge")
    return Image(image.name, np.pad(within, ((min(rows, 1),) * 2, (min(columns, 1),) * 2, (0, 0))))


def _inside_border(image: Image, columns: int, rows: int) -> Matrix:
    """From coordinates of an image to those within its border."""
    height, width = image.pixels.shape[:2]
    wide, high = width + 2 * columns, height + 2 * rows
    return np.array([[width / wide, 0.0, columns / wide], [0.0, height / high, rows / high], [0.0, 0.0, 1.0]])


def _values(texture: Texture, node: Record, srgb: bool) -> NDArray[np.float32]:
    """Texels ``(h, w, c)``: linear, then scaled and shifted as the node says."""
    values = texture_maps.unit(texture.image)
    if srgb:
        values = np.concatenate([decode_srgb(values[..., :3]), values[..., 3:]], axis=2)
    scale, bias = _scale_bias(node)
    count = values.shape[2]
    return np.asarray(values * np.array(scale[:count], np.float32) + np.array(bias[:count], np.float32), np.float32)


def _encode(texture: Texture) -> Image:
    """The colours of a texture as sRGB codes."""
    if texture.srgb:
        return texture.image
    from lippmann.color.transfer import encode_srgb

    values = np.clip(texture_maps.unit(texture.image)[..., :3], 0.0, 1.0)
    return Image(texture.image.name, np.asarray(encode_srgb(values), np.float32))


def _in_alpha(texture: Texture | None) -> Texture | None:
    """A texture of one channel, which the opacity of a white one holds."""
    if texture is None:
        return None
    image = texture_maps.with_alpha(None, texture_maps.unit(texture.image)[..., 0], texture.image.name)
    return replace(texture, image=image)


def _in_channel(texture: Texture | None, channel: int) -> Texture | None:
    if texture is None:
        return None
    plane = texture_maps.unit(texture.image)[..., 0]
    planes = [plane if index == channel else None for index in range(3)]
    return replace(texture, image=texture_maps.pack_channels(*planes, name=texture.image.name))


def _coordinates(source: Record | None, depth: int = 0) -> tuple[str, Matrix]:
    """The primvar of a texture's coordinates, and the transformation on the way, for v downwards."""
    if source is None or depth > 8:
        return "st", np.eye(3)
    if "value" in source:
        return "", np.eye(3)
    if "primvar" in source:
        return str(source["primvar"] or "st"), np.eye(3)
    if "transform" not in source:
        return "st", np.eye(3)
    node = source["transform"]
    name, before = _coordinates(node.get("in"), depth + 1)
    angle = np.radians(_scalar_of(node.get("rotation"), 0.0))
    scale = _pair(node.get("scale"), (1.0, 1.0))
    shift = _pair(node.get("translation"), (0.0, 0.0))
    cos, sin = np.cos(angle), np.sin(angle)
    # Scale, then rotation counter-clockwise, then translation, with v upwards.
    own = np.array(
        [[cos * scale[0], -sin * scale[1], shift[0]], [sin * scale[0], cos * scale[1], shift[1]], [0.0, 0.0, 1.0]]
    )
    return name, np.asarray(_FLIP @ own @ _FLIP @ before, np.float64)


def _scale_bias(node: Record) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return _numbers(node.get("scale"), 4, 1.0), _numbers(node.get("bias"), 4, 0.0)


def _fallback(node: Record, *default: float) -> tuple[float, ...]:
    """The colour in place of a picture: the node's own, else the input's default, as the schema's black hides shape."""
    given = node.get("fallback")
    return _numbers(given, 4, 0.0) if given is not None else (*default, 1.0)


def _numbers(source: Record | None, count: int, default: float) -> tuple[float, ...]:
    value: Any = None if source is None else source.get("value")
    if not isinstance(value, list) or len(value) != count or not np.isfinite(value).all():
        return (default,) * count
    return tuple(float(number) for number in value)


def _pair(source: Record | None, default: tuple[float, float]) -> tuple[float, float]:
    value: Any = None if source is None else source.get("value")
    if not isinstance(value, list) or len(value) != 2 or not np.isfinite(value).all():
        return default
    return float(value[0]), float(value[1])


def _scalar_of(source: Record | None, default: float) -> float:
    value: Any = None if source is None else source.get("value")
    if not isinstance(value, (int, float)) or not np.isfinite(value):
        return default
    return float(value)


def _color_of(source: Record | None, default: Color) -> Color:
    red, green, blue = _numbers(source, 3, -1.0)
    return default if min(red, green, blue) < 0.0 else (red, green, blue)


def _fraction(color: Color) -> Color:
    red, green, blue = (min(max(value, 0.0), 1.0) for value in color)
    return (red, green, blue)


def _is_displaced(inputs: Record) -> bool:
    source = inputs.get("displacement")
    return source is not None and ("texture" in source or _scalar_of(source, 0.0) != 0.0)
