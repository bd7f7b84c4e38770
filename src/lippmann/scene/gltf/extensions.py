"""Which glTF extensions are understood."""

from __future__ import annotations

from lippmann.scene.gltf.document import Document

UNDERSTOOD = frozenset(
    {
        "EXT_mesh_gpu_instancing",
        "EXT_texture_avif",
        "EXT_texture_webp",
        "KHR_lights_punctual",
        "KHR_materials_clearcoat",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_materials_sheen",
        "KHR_materials_specular",
        "KHR_materials_transmission",
        "KHR_materials_unlit",
        "KHR_materials_variants",
        "KHR_materials_volume",
        "KHR_mesh_quantization",
        "KHR_node_visibility",
        "KHR_texture_transform",
    }
)

# They say nothing about what is seen while the scene stands still.
_SILENT = frozenset({"KHR_xmp", "KHR_xmp_json_ld", "KHR_node_selectability", "KHR_node_hoverability"})

_PICTURE_FORMATS = {"EXT_texture_webp": "webp", "EXT_texture_avif": "avif"}


def texture_extension_is_readable(name: str) -> bool:
    """Whether the installed Pillow decodes what ``EXT_texture_webp`` or ``EXT_texture_avif`` points to."""
    from PIL import features

    return bool(features.check(_PICTURE_FORMATS[name]))


def check_extensions(document: Document) -> None:
    """Refuse what must be understood and is not; note what may be left out.

    Raises
    ------
    SceneError
        ``extensionsRequired`` names an extension that is not understood.
    """
    required = document.root.texts("extensionsRequired")
    for name in required:
        if not _is_understood(name) and name not in _SILENT:
            raise document.error(
                f"the file requires the glTF extension {name}",
                rule="it is not understood",
                fix="export the scene without it",
            )
    for name in document.root.texts("extensionsUsed"):
        if name == "KHR_materials_variants":
            document.notes.add("of the material variants the default one is shown")
        if not _is_understood(name) and name not in _SILENT:
            document.notes.add(f"the glTF extension {name} is not understood; what it adds is left out")


def _is_understood(name: str) -> bool:
    if name in _PICTURE_FORMATS:
        return texture_extension_is_readable(name)
    return name in UNDERSTOOD
