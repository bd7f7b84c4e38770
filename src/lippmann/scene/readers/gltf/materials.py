"""Materials: metallic-roughness, the extensions that add to it, and the archived specular-glossiness model."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from lippmann.scene.readers.gltf.document import Document
from lippmann.scene.readers.gltf.json_fields import LARGEST_NUMBER, Fields
from lippmann.scene.readers.gltf.textures import Textures
from lippmann.scene.values.description import AlphaMode, Color, Image, Material, Texture

_ALPHA_MODES: dict[str, AlphaMode] = {"OPAQUE": "opaque", "MASK": "mask", "BLEND": "blend"}
_WHITE: Color = (1.0, 1.0, 1.0)
_BLACK: Color = (0.0, 0.0, 0.0)

# KHR_materials_ior writes 0 for what reflects all light at normal incidence, the limit of an endless index of
# refraction; this one reflects 99.6 %.
_ENDLESS_IOR = 1000.0


@dataclass(frozen=True, eq=False)
class Materials:
    """The materials of a document; only those that are used are read, in the order of their first use."""

    document: Document
    textures: Textures
    read: list[Material] = field(default_factory=list)
    _places: dict[int | None, int] = field(default_factory=dict)

    def place(self, index: int | None) -> int:
        """The place in :attr:`read` of ``materials[index]``; None stands for glTF's default material.

        Raises
        ------
        SceneError
            The material holds a value of a wrong kind or an image that cannot be read.
        """
        if index not in self._places:
            self._places[index] = len(self.read)
            self.read.append(self._material(index))
        return self._places[index]

    def _material(self, index: int | None) -> Material:
        if index is None:
            return Material(name="default", metallic=1.0)
        fields = self.document.all("materials")[index]
        archived = fields.extension("KHR_materials_pbrSpecularGlossiness")
        material = Material(name=fields.text("name") or fields.place)
        if archived is None:
            material = self._with_base(material, fields)
        for add in (self._with_surface, self._with_interior, self._with_layers, self._with_gloss):
            material = add(material, fields)
        return material if archived is None else self._as_specular_glossiness(material, archived)

    def _with_base(self, material: Material, fields: Fields) -> Material:
        base = fields.child("pbrMetallicRoughness") or Fields({}, fields.place, fields.file)
        red, green, blue, alpha = self._fractions(base, "baseColorFactor", (1.0, 1.0, 1.0, 1.0))
        texture = self.textures.read(base, "metallicRoughnessTexture")
        # The factor alone would make all of it metal.
        is_lost = texture is None and base.has("metallicRoughnessTexture")
        return replace(
            material,
            base_color=(red, green, blue),
            base_color_texture=self.textures.read(base, "baseColorTexture", srgb=True),
            alpha=alpha,
            metallic=0.0 if is_lost else self._fraction(base, "metallicFactor", 1.0),
            roughness=self._fraction(base, "roughnessFactor", 1.0),
            metallic_roughness_texture=texture,
        )

    def _as_specular_glossiness(self, material: Material, fields: Fields) -> Material:
        red, green, blue, alpha = self._fractions(fields, "diffuseFactor", (1.0, 1.0, 1.0, 1.0))
        return _with_specular_glossiness(
            material,
            diffuse=(red, green, blue, alpha),
            diffuse_texture=self.textures.read(fields, "diffuseTexture", srgb=True),
            specular=self._color(fields, "specularFactor", _WHITE),
            glossiness=self._fraction(fields, "glossinessFactor", 1.0),
            specular_glossiness_texture=self.textures.read(fields, "specularGlossinessTexture", srgb=True),
        )

    def _with_surface(self, material: Material, fields: Fields) -> Material:
        mode = fields.text("alphaMode") or "OPAQUE"
        if mode not in _ALPHA_MODES:
            raise fields.error("alphaMode", f"one of {', '.join(_ALPHA_MODES)} belongs here")
        normal = fields.child("normalTexture")
        strength = 1.0
        extension = fields.extension("KHR_materials_emissive_strength")
        if extension is not None:
            strength = extension.number("emissiveStrength", 1.0, minimum=0.0)
        emission_texture = self.textures.read(fields, "emissiveTexture", srgb=True)
        is_lost = emission_texture is None and fields.has("emissiveTexture")  # the factor alone would light all of it
        emission = _BLACK if is_lost else self._fractions(fields, "emissiveFactor", _BLACK)
        if fields.has("occlusionTexture"):
            self.document.notes.add("occlusion textures are left out: light is traced into corners", fields.place)
        return replace(
            material,
            normal_texture=self.textures.read(fields, "normalTexture"),
            normal_scale=1.0 if normal is None else normal.number("scale", 1.0),
            emission=(emission[0] * strength, emission[1] * strength, emission[2] * strength),
            emission_texture=emission_texture,
            alpha_mode=_ALPHA_MODES[mode],
            alpha_cutoff=fields.number("alphaCutoff", 0.5, minimum=0.0),
            double_sided=fields.flag("doubleSided"),
            unlit=fields.extension("KHR_materials_unlit") is not None,
        )

    def _with_interior(self, material: Material, fields: Fields) -> Material:
        ior = fields.extension("KHR_materials_ior")
        if ior is not None:
            value = ior.number("ior", 1.5)
            if value != 0.0 and value < 1.0:
                raise ior.error("ior", "it must be 1 or more, or 0")
            material = replace(material, ior=min(value, _ENDLESS_IOR) or _ENDLESS_IOR)
        transmission = fields.extension("KHR_materials_transmission")
        if transmission is not None:
            material = replace(
                material,
                transmission=self._fraction(transmission, "transmissionFactor", 0.0),
                transmission_texture=self.textures.read(transmission, "transmissionTexture"),
            )
        volume = fields.extension("KHR_materials_volume")
        if volume is not None:
            material = replace(
                material,
                thickness=volume.number("thicknessFactor", 0.0, minimum=0.0),
                thickness_texture=self.textures.read(volume, "thicknessTexture"),
                attenuation_color=self._color(volume, "attenuationColor", _WHITE),
            )
            distance = volume.optional_number("attenuationDistance")
            if distance is not None:
                if distance <= 0.0:
                    raise volume.error("attenuationDistance", "it must be above 0")
                material = replace(material, attenuation_distance=distance)
        return material

    def _with_layers(self, material: Material, fields: Fields) -> Material:
        specular = fields.extension("KHR_materials_specular")
        if specular is not None:
            material = replace(
                material,
                specular=self._fraction(specular, "specularFactor", 1.0),
                specular_texture=self.textures.read(specular, "specularTexture"),
                specular_color=self._color(specular, "specularColorFactor", _WHITE, most=LARGEST_NUMBER),
                specular_color_texture=self.textures.read(specular, "specularColorTexture", srgb=True),
            )
        coat = fields.extension("KHR_materials_clearcoat")
        if coat is not None:
            normal = coat.child("clearcoatNormalTexture")
            material = replace(
                material,
                clearcoat=self._fraction(coat, "clearcoatFactor", 0.0),
                clearcoat_texture=self.textures.read(coat, "clearcoatTexture"),
                clearcoat_roughness=self._fraction(coat, "clearcoatRoughnessFactor", 0.0),
                clearcoat_roughness_texture=self.textures.read(coat, "clearcoatRoughnessTexture"),
                clearcoat_normal_texture=self.textures.read(coat, "clearcoatNormalTexture"),
                clearcoat_normal_scale=1.0 if normal is None else normal.number("scale", 1.0),
            )
        sheen = fields.extension("KHR_materials_sheen")
        if sheen is not None:
            material = replace(
                material,
                sheen_color=self._color(sheen, "sheenColorFactor", _BLACK),
                sheen_color_texture=self.textures.read(sheen, "sheenColorTexture", srgb=True),
                sheen_roughness=self._fraction(sheen, "sheenRoughnessFactor", 0.0),
                sheen_roughness_texture=self.textures.read(sheen, "sheenRoughnessTexture"),
            )
        return material

    def _with_gloss(self, material: Material, fields: Fields) -> Material:
        anisotropy = fields.extension("KHR_materials_anisotropy")
        if anisotropy is not None:
            material = replace(
                material,
                anisotropy=self._fraction(anisotropy, "anisotropyStrength", 0.0),
                anisotropy_rotation=anisotropy.number("anisotropyRotation", 0.0),
                anisotropy_texture=self.textures.read(anisotropy, "anisotropyTexture"),
            )
        film = fields.extension("KHR_materials_iridescence")
        if film is not None:
            material = replace(
                material,
                iridescence=self._fraction(film, "iridescenceFactor", 0.0),
                iridescence_texture=self.textures.read(film, "iridescenceTexture"),
                iridescence_ior=film.number("iridescenceIor", 1.3, minimum=1.0),
                iridescence_thickness_minimum=film.number("iridescenceThicknessMinimum", 100.0, minimum=0.0),
                iridescence_thickness_maximum=film.number("iridescenceThicknessMaximum", 400.0, minimum=0.0),
                iridescence_thickness_texture=self.textures.read(film, "iridescenceThicknessTexture"),
            )
        return material

    def _color(self, fields: Fields, key: str, default: Color, *, most: float = 1.0) -> Color:
        red, green, blue = self._fractions(fields, key, default, most=most)
        return red, green, blue

    def _fractions(
        self, fields: Fields, key: str, default: tuple[float, ...], *, most: float = 1.0
    ) -> tuple[float, ...]:
        values = fields.numbers(key, len(default))
        return default if values is None else tuple(self._clamp(fields, value, most) for value in values)

    def _fraction(self, fields: Fields, key: str, default: float) -> float:
        return self._clamp(fields, fields.number(key, default), 1.0)

    def _clamp(self, fields: Fields, value: float, most: float) -> float:
        clamped = min(max(value, 0.0), most)
        if clamped != value:
            self.document.notes.add("material factors outside [0, 1] were cut to it", fields.place)
        return clamped


def _with_specular_glossiness(
    material: Material,
    *,
    diffuse: tuple[float, float, float, float],
    diffuse_texture: Texture | None,
    specular: Color,
    glossiness: float,
    specular_glossiness_texture: Texture | None,
) -> Material:
    """``material`` with its reflection replaced by that of KHR_materials_pbrSpecularGlossiness.

    KHR_materials_specular, which took the extension's place, names the equivalent: no metal, the diffuse colour as
    base colour, the specular one as specular colour, and an index of refraction without end, so that the specular
    colour alone is the reflectance at normal incidence.

    Parameters
    ----------
    diffuse:
        Linear RGB and alpha.
    specular_glossiness_texture:
        sRGB-coded specular colour in RGB, glossiness in alpha.
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
        ior=_ENDLESS_IOR,
    )


def _roughness(image: Image, glossiness: float) -> Image:
    """Roughness in G (and no metal in B) where ``image`` holds glossiness in alpha."""
    most = 255.0 if image.pixels.dtype == np.uint8 else 1.0
    alpha = image.pixels[..., 3].astype(np.float32) / np.float32(most)
    texels = np.zeros((*alpha.shape, 3), np.uint8)
    texels[..., 1] = np.rint(255.0 * (1.0 - np.float32(glossiness) * alpha))
    return Image(image.name, texels)
