"""MTL materials in metallic-roughness terms; ``docs/reference/scenes.md`` gives the mapping as a table."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.parsing import texture_maps
from lippmann.scene.parsing.files import MissingFileError, NamedFiles, read_image
from lippmann.scene.parsing.udim import TiledImage, is_tiled, read_tiles
from lippmann.scene.readers.environment_map import LINEAR_SUFFIXES, possible_light, read_linear
from lippmann.scene.readers.mtl import MapReference, MtlRecord
from lippmann.scene.values.description import Color, Image, Material, Texture, Wrap

# Reflection, refraction models of the "illum" statement.
_COLOR_ONLY, _DIFFUSE_ONLY = 0, 1
_REFRACTING = {6, 7}
# Exporters of principled materials write 0.5 for an ordinary dielectric (4 % at normal incidence).
_ORDINARY_SPECULAR = 0.5
_SHEEN_ROUGHNESS = 0.5  # the format has no word for it
_BLACK = 1e-3
# Slopes beyond it are walls; their squares stay within single precision.
_STEEPEST = 1e6


class MaterialMapper:
    """Maps the materials of one OBJ file; each texture file is decoded once.

    Attributes
    ----------
    notes:
        Statements that were ignored, one line each.
    """

    def __init__(self, named: NamedFiles) -> None:
        self._named = named
        self._images: dict[tuple[Path, float], Image] = {}
        self._paths: dict[str, Path] = {}
        self.notes: list[str] = []

    def default(self, name: str) -> Material:
        """The surface of faces whose material nobody describes."""
        return Material(name=name, base_color=(0.7, 0.7, 0.7), roughness=0.6, double_sided=True)

    def material(self, record: MtlRecord) -> Material:
        """One material.

        Raises
        ------
        SceneError
            A texture is damaged; the error names the file and line that ask for it.
        """
        record = self._without_missing_maps(record)
        if record.remark:
            self._note_once(record.remark)
        if record.ignored:
            self._note(record, f"not honoured: {', '.join(dict.fromkeys(record.ignored))}")
        illum = int(record.scalar("illum", 2))
        diffuse = self._tint(record, "kd", "map_kd", 0.8)
        material = Material(
            name=record.name,
            base_color=diffuse,
            emission=self._tint(record, "ke", "map_ke", 0.0, clip=False),
            emission_texture=self._color_map(record, "map_ke", brightest=np.inf),
            roughness=_roughness(record),
            metallic=min(max(record.scalar("pm", 0.0), 0.0), 1.0),
            metallic_roughness_texture=self._metallic_roughness(record),
            ior=record.scalar("ni", 1.5) if record.scalar("ni", 1.5) > 1.0 else 1.5,
            double_sided=True,
            unlit=illum == _COLOR_ONLY,
        )
        material = self._with_highlight(material, record, illum)
        material = self._with_opacity(material, record, illum)
        material = self._with_relief(material, record)
        return self._with_coats(material, record)

    def _without_missing_maps(self, record: MtlRecord) -> MtlRecord:
        """The record without maps whose files are missing, each with a note, and without factors of 0 beside them."""
        maps, numbers = dict(record.maps), dict(record.numbers)
        for key, reference in record.maps.items():
            try:
                by_itself = _is_linear(reference.file) and not is_tiled(reference.file)
                self._path(reference) if by_itself else self._image(reference)
            except MissingFileError as error:
                self._note_once(error.note("shown without it"))
                del maps[key]
                factor = key.removeprefix("map_")
                if max(numbers.get(factor, (1.0,))) <= 0.0:
                    del numbers[factor]
        return replace(record, maps=maps, numbers=numbers)

    def _with_highlight(self, material: Material, record: MtlRecord, illum: int) -> Material:
        physical = bool({"pr", "pm"} & set(record.numbers) or {"map_pr", "map_pm"} & set(record.maps))
        if illum == _DIFFUSE_ONLY and not physical:
            return replace(material, specular=0.0)
        default = _ORDINARY_SPECULAR if physical else 0.0
        color = self._tint(record, "ks", "map_ks", default, clip=False)
        strength = max(color)
        if strength <= 0.0:
            return replace(material, specular=0.0)
        # Phong has no metals; one is meant where nothing but a strong highlight is there.
        if not physical and max(material.base_color) <= 0.05 and strength >= 0.2 and not _is_glass(record, illum):
            return replace(
                material,
                metallic=1.0,
                base_color=_clip(color),
                base_color_texture=self._color_map(record, "map_ks"),
            )
        return replace(
            material,
            specular=min(strength / _ORDINARY_SPECULAR, 1.0),
            specular_color=_clip((color[0] / strength, color[1] / strength, color[2] / strength)),
            specular_color_texture=self._color_map(record, "map_ks"),
        )

    def _with_opacity(self, material: Material, record: MtlRecord, illum: int) -> Material:
        """Base colour texture, alpha, and glass."""
        opacity = _opacity(record)
        color_map, alpha_map = record.maps.get("map_kd"), record.maps.get("map_d") or record.maps.get("map_tr")
        texture = material.base_color_texture or (self._texture(color_map, srgb=True) if color_map else None)
        if alpha_map:
            alpha = texture_maps.scalar(self._texture(alpha_map, srgb=False).image, _channel(alpha_map, alpha=True))
            if "map_d" not in record.maps:
                alpha = 1.0 - alpha
            texture = self._with_alpha(texture, alpha, alpha_map)
        elif texture is not None and texture.image.pixels.shape[2] == 4:
            # Without map_d the format gives the picture's alpha no say.
            texture = replace(texture, image=texture_maps.without_alpha(texture.image))
        if _is_glass(record, illum):
            tint = record.color("tf", 1.0)
            dark = max(material.base_color) <= _BLACK
            return replace(
                material,
                base_color=_clip(tint) if dark else material.base_color,
                base_color_texture=texture,
                transmission=1.0 - opacity if opacity < 1.0 else min(max(tint), 1.0),
                thickness=1.0 if illum in _REFRACTING else 0.0,
            )
        return replace(
            material,
            base_color_texture=texture,
            alpha=opacity,
            alpha_mode="blend" if opacity < 1.0 or alpha_map else "opaque",
        )

    def _with_alpha(self, texture: Texture | None, alpha: NDArray[np.float32], alpha_map: MapReference) -> Texture:
        """``alpha`` as the fourth channel of ``texture``, or of white where there is none."""
        if texture is None:
            image = texture_maps.with_alpha(None, alpha, alpha_map.file)
            return replace(self._texture(alpha_map, srgb=True), image=image)
        return replace(texture, image=texture_maps.with_alpha(texture.image, alpha, alpha_map.file))

    def _with_relief(self, material: Material, record: MtlRecord) -> Material:
        reference = record.maps.get("norm") or record.maps.get("bump")
        if reference is None:
            return material
        strength = min(max(reference.numbers("-bm", (1.0,))[0], -_STEEPEST), _STEEPEST)
        texture = self._texture(reference, srgb=False)
        if "norm" in record.maps or texture_maps.looks_like_normals(texture.image):
            return replace(material, normal_texture=texture, normal_scale=strength)
        height = texture_maps.scalar(texture.image, _channel(reference))
        normals = texture_maps.normals_from_height(height, strength, texture.wrap_u == "repeat", reference.file)
        return replace(material, normal_texture=replace(texture, image=normals))

    def _with_coats(self, material: Material, record: MtlRecord) -> Material:
        maps = record.maps
        sheen = self._tint(record, "ps", "map_ps", 0.0)
        return replace(
            material,
            sheen_color=sheen,
            sheen_color_texture=self._color_map(record, "map_ps"),
            sheen_roughness=_SHEEN_ROUGHNESS if max(sheen) > 0.0 else 0.0,
            clearcoat=min(max(record.scalar("pc", 1.0 if "map_pc" in maps else 0.0), 0.0), 1.0),
            clearcoat_texture=self._scalar_map(record, "map_pc", channel=0),
            clearcoat_roughness=min(max(record.scalar("pcr", 1.0 if "map_pcr" in maps else 0.0), 0.0), 1.0),
            clearcoat_roughness_texture=self._scalar_map(record, "map_pcr", channel=1),
        )

    def _metallic_roughness(self, record: MtlRecord) -> Texture | None:
        """Roughness (G) and metal (B) in one picture, as glTF has it."""
        maps = record.maps
        rough, metal = maps.get("map_pr"), maps.get("map_pm")
        planes: list[NDArray[np.float32] | None] = [None, None]
        if rough:
            planes[0] = texture_maps.scalar(self._texture(rough, srgb=False).image, _channel(rough))
        elif "map_ns" in maps and "pr" not in record.numbers:
            rough = maps["map_ns"]
            exponent = texture_maps.scalar(self._texture(rough, srgb=False).image, _channel(rough))
            exponent = exponent * np.float32(record.scalar("ns", 1000.0))
            planes[0] = _roughness_of_exponent(exponent).astype(np.float32)
        if metal:
            planes[1] = texture_maps.scalar(self._texture(metal, srgb=False).image, _channel(metal))
        reference = rough or metal
        if reference is None:
            return None
        return replace(
            self._texture(reference, srgb=False), image=texture_maps.pack_channels(None, *planes, name=reference.file)
        )

    def _color_map(self, record: MtlRecord, key: str, *, brightest: float = 1.0) -> Texture | None:
        return self._texture(record.maps[key], srgb=True, brightest=brightest) if key in record.maps else None

    def _scalar_map(self, record: MtlRecord, key: str, *, channel: int) -> Texture | None:
        """A one-value texture, repeated so that the ``channel`` that glTF reads holds it."""
        if key not in record.maps:
            return None
        reference = record.maps[key]
        texture = self._texture(reference, srgb=False)
        plane = texture_maps.scalar(texture.image, _channel(reference))
        planes = [plane if index == channel else None for index in range(3)]
        return replace(texture, image=texture_maps.pack_channels(*planes, name=reference.file))

    def _tint(self, record: MtlRecord, key: str, map_key: str, default: float, *, clip: bool = True) -> Color:
        """A factor. One of zero beside its map would hide the map, which no exporter that writes it means."""
        color = record.color(key, 1.0 if map_key in record.maps else default)
        if map_key in record.maps and max(color) <= 0.0:
            color = (1.0, 1.0, 1.0)
        if clip and max(color) > 1.0:
            self._note(record, f"{key.capitalize()} above 1 is taken as 1")
        return _clip(color, 1.0 if clip else np.inf)

    def _image(self, reference: MapReference, brightest: float = 1.0) -> Image:
        name = reference.file
        path = Path(name) if is_tiled(name) else self._path(reference)  # no file has the name of tiles
        key = path, brightest if _is_linear(name) else 1.0
        if key not in self._images:
            if is_tiled(name):
                image: Image = read_tiles(
                    name, lambda tile: self._image(replace(reference, file=tile(name)), brightest)
                )
            elif _is_linear(name):
                pixels, notes = read_linear(path)
                self.notes += notes
                image = Image(path.name, np.minimum(possible_light(pixels), np.float32(brightest)))
            else:
                image = read_image(path, where=reference.where)
            self._images[key] = image
        return self._images[key]

    def _path(self, reference: MapReference) -> Path:
        name = reference.file
        if name not in self._paths:
            self._paths[name] = self._named.find_on_line(name, where=reference.where)
        return self._paths[name]

    def _texture(self, reference: MapReference, *, srgb: bool, brightest: float = 1.0) -> Texture:
        image, transform = self._image(reference, brightest), _uv_transform(reference)
        ignored = sorted(set(reference.options) & {"-mm", "-t", "-cc"})
        if ignored:
            self._note_once(f"{reference.where}: not honoured: {', '.join(ignored)}")
        is_clamped = reference.options.get("-clamp", ("off",))[0].lower() == "on"
        if isinstance(image, TiledImage):
            is_clamped, transform = True, image.inside @ transform
        wrap: Wrap = "clamp" if is_clamped else "repeat"
        is_coded = reference.options.get("-colorspace", ("sRGB",))[0].lower() != "linear"
        srgb = srgb and is_coded and not _is_linear(reference.file)
        return Texture(image, srgb, wrap, wrap, uv_transform=transform)

    def _note(self, record: MtlRecord, text: str) -> None:
        self._note_once(f"material '{record.name}': {text}")

    def _note_once(self, note: str) -> None:
        if note not in self.notes:
            self.notes.append(note)


def _is_linear(name: str) -> bool:
    """Whether a picture holds linear light, such as the textures that Meshroom makes."""
    return name.lower().endswith(LINEAR_SUFFIXES)


def _clip(color: Color, top: float = 1.0) -> Color:
    red, green, blue = (min(max(value, 0.0), top) for value in color)
    return (red, green, blue)


def _opacity(record: MtlRecord) -> float:
    """``d``, or 1 - ``Tr``; ``d`` holds where a file gives both."""
    return min(max(record.scalar("d", 1.0 - record.scalar("tr", 0.0)), 0.0), 1.0)


def _is_glass(record: MtlRecord, illum: int) -> bool:
    """Glass rather than a see-through film.

    Many exporters write illum 4 and a white Tf for everything, so an opaque material is glass only where its model
    refracts and nothing else is left of it: black Kd beside a bright Tf.
    """
    if not record.is_glass_model or "map_d" in record.maps:
        return False
    hollow = "map_kd" not in record.maps and max(record.color("kd", 0.8)) <= _BLACK and max(record.color("tf", 0.0)) > 0
    return _opacity(record) < 1.0 or (illum in _REFRACTING and hollow)


def _roughness(record: MtlRecord) -> float:
    if "map_pr" in record.maps:
        return min(max(record.scalar("pr", 1.0), 0.0), 1.0) or 1.0
    if "pr" in record.numbers:
        return min(max(record.scalar("pr", 1.0), 0.0), 1.0)
    if "map_ns" in record.maps or "ns" not in record.numbers:
        return 1.0
    return float(_roughness_of_exponent(np.float64(max(record.scalar("ns", 0.0), 0.0))))


def _roughness_of_exponent(exponent: NDArray[np.floating] | np.float64) -> NDArray[np.floating]:
    """glTF's roughness of a Phong exponent.

    Blinn-Phong with exponent n is as wide as a microfacet lobe of alpha = sqrt(2 / (n + 2)) (Walter et al. 2007), and
    roughness is the square root of alpha.
    """
    return np.asarray((2.0 / (np.maximum(exponent, 0.0) + 2.0)) ** 0.25)


def _channel(reference: MapReference, *, alpha: bool = False) -> str:
    """The channel that a scalar map reads: -imfchan, else alpha for opacity where there is one, else luminance."""
    return reference.options.get("-imfchan", ("m" if alpha else "l",))[0].lower()


def _uv_transform(reference: MapReference) -> NDArray[np.float64]:
    """-s and -o (uv' = s uv + o, v upwards), rewritten for v downwards."""
    scale, offset = reference.numbers("-s", (1.0, 1.0, 1.0)), reference.numbers("-o", (0.0, 0.0, 0.0))
    return np.array([[scale[0], 0.0, offset[0]], [0.0, scale[1], 1.0 - scale[1] - offset[1]], [0.0, 0.0, 1.0]])
