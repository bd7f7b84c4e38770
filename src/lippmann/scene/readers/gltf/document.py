"""A glTF file opened: its JSON, its binary chunk, its remarks, and the extensions that it may ask for."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from lippmann.errors import SceneError, UsageError
from lippmann.scene.parsing.files import NamedFiles, read_bytes
from lippmann.scene.readers.gltf.json_fields import Fields

Kind = Literal[
    "accessors",
    "bufferViews",
    "buffers",
    "cameras",
    "images",
    "materials",
    "meshes",
    "nodes",
    "samplers",
    "scenes",
    "skins",
    "textures",
]

_MAGIC = b"glTF"
_CHUNK_JSON = 0x4E4F534A
_CHUNK_BIN = 0x004E4942
_HEADER = struct.Struct("<4sII")
_CHUNK_HEADER = struct.Struct("<II")

DRACO = "KHR_draco_mesh_compression"
BASISU = "KHR_texture_basisu"
SPLATS = "KHR_gaussian_splatting"
#: Extensions of that one, which hold the splats as an SPZ file.
SPLATS_IN_SPZ = ("KHR_gaussian_splatting_compression_spz_2", "KHR_gaussian_splatting_compression_spz")
#: A draft of both in one, as Cesium wrote it in 2025.
SPLATS_DRAFT = "KHR_spz_gaussian_splats_compression"

# Extensions whose members are read.
_UNDERSTOOD = frozenset(
    {
        "EXT_mesh_gpu_instancing",
        "EXT_meshopt_compression",
        "EXT_texture_avif",
        "EXT_texture_webp",
        DRACO,
        SPLATS,
        *SPLATS_IN_SPZ,
        SPLATS_DRAFT,
        "KHR_lights_punctual",
        "KHR_materials_anisotropy",
        "KHR_materials_clearcoat",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_iridescence",
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_materials_sheen",
        "KHR_materials_specular",
        "KHR_materials_transmission",
        "KHR_materials_unlit",
        "KHR_materials_variants",
        "KHR_materials_volume",
        "KHR_mesh_quantization",
        "KHR_meshopt_compression",
        "KHR_node_visibility",
        BASISU,
        "KHR_texture_transform",
    }
)

# They say nothing about what is seen while the scene stands still.
_SILENT = frozenset({"KHR_xmp", "KHR_xmp_json_ld", "KHR_node_selectability", "KHR_node_hoverability"})
# It moves what stands still in a scene at rest; channels that are not followed are noted one by one.
_SILENT |= {"KHR_animation_pointer"}
# They say where on the globe a tile lies, and what its parts stand for.
_SILENT |= {"CESIUM_RTC", "EXT_instance_features", "EXT_mesh_features"}
_SILENT |= {"EXT_feature_metadata", "EXT_structural_metadata"}

# They say which triangles were one face, that a mesh is closed, and how an editor shows the root.
_SILENT |= {"EXT_mesh_manifold", "FB_ngon_encoding", "GODOT_single_root"}

# Surfaces as programs of shaders, and others that glTF 2.0 has no terms for: the meshes are read without them.
_FORMER_MATERIALS = frozenset({"KHR_blend", "KHR_materials_common", "KHR_technique_webgl", "KHR_techniques_webgl"})

# Tools that write the same scene without an extension.
_UPGRADE = "convert it with 'gltf-pipeline -i in.gltf -o out.glb'"
DECOMPRESS = "decompress it with 'gltfpack -noq -i in.glb -o out.glb'"
#: The extension of material variants, how many of them a line names, and the name by which they are chosen.
VARIANTS, _NAMED, MATERIALS = "KHR_materials_variants", 20, "materials"

#: Extensions of compressed buffer views; the file may hold the same bytes uncompressed, too.
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")

_PICTURE_FORMATS = {"EXT_texture_webp": "webp", "EXT_texture_avif": "avif"}


@dataclass
class Notes:
    """Remarks of the reader; equal ones about several things become one line."""

    _places: dict[str, list[str]] = field(default_factory=dict)

    def add(self, remark: str, place: str = "") -> None:
        """Remark on ``place``, once."""
        places = self._places.setdefault(remark, [])
        if place and place not in places:
            places.append(place)

    def lines(self) -> tuple[str, ...]:
        """One line per remark, in the order in which they came."""
        return tuple(_line(remark, places) for remark, places in self._places.items())


def _line(remark: str, places: list[str]) -> str:
    if not places:
        return remark
    others = f" and {len(places) - 1} more" if len(places) > 1 else ""
    return f"{remark} ({places[0]}{others})"


@dataclass(frozen=True, eq=False)
class Document:
    """The JSON of a glTF file, its top-level lists by kind, and its binary chunk (glb only).

    ``named`` are the files that the document may name. ``variant`` is the number of the material variant that is
    shown; None for the materials of no variant.
    """

    file: str
    named: NamedFiles
    root: Fields
    binary_chunk: memoryview | None
    variant: int | None = None
    notes: Notes = field(default_factory=Notes)
    _lists: dict[str, list[Fields]] = field(default_factory=dict)

    def all(self, kind: Kind) -> list[Fields]:
        """All objects of a top-level list."""
        if kind not in self._lists:
            self._lists[kind] = self.root.children(kind)
        return self._lists[kind]

    def with_nodes(self, nodes: list[Fields]) -> Document:
        """The same file with other nodes, as an animation moves them; notes are shared."""
        return replace(self, _lists={**self._lists, "nodes": nodes})

    def reference(self, source: Fields, key: str, kind: Kind) -> int | None:
        """The index that member ``key`` holds, within the list ``kind``; None where absent.

        Raises
        ------
        SceneError
            The list has no such entry.
        """
        index = source.optional_integer(key)
        if index is not None and index >= len(self.all(kind)):
            raise source.error(key, f"there are {len(self.all(kind))} {kind}, counted from 0")
        return index

    def required_reference(self, source: Fields, key: str, kind: Kind) -> int:
        """As :meth:`reference`, for a member that must be there."""
        index = self.reference(source, key, kind)
        if index is None:
            raise source.error(key, "it is required")
        return index

    def node_references(self, source: Fields, key: str) -> list[int]:
        """As :meth:`reference`, for a list of nodes."""
        indices = source.integers(key)
        if any(index >= len(self.all("nodes")) for index in indices):
            raise source.error(key, f"there are {len(self.all('nodes'))} nodes, counted from 0")
        return indices

    def error(self, what: str, rule: str = "", fix: str = "") -> SceneError:
        """An error about this file."""
        return SceneError(what, where=self.file, rule=rule, fix=fix)


def open_document(path: Path, *, files: NamedFiles | None, variants: Mapping[str, str] | None = None) -> Document:
    """Open a ``.glb`` or ``.gltf`` file; which of the two it is, its first bytes tell.

    Parameters
    ----------
    files:
        Those that it may name; by default those of its folder and below.
    variants:
        ``{"materials": NAME}`` chooses a material variant.

    Raises
    ------
    SceneError
        The file is missing, empty, cut short, of another format or of another glTF version.
    UsageError
        There is no such variant.
    """
    data = read_bytes(path)
    if data[:4] == _MAGIC:
        text, binary_chunk = _chunks(data, path.name)
    else:
        text, binary_chunk = memoryview(data), None
    root = _parse(text, path.name)
    named = NamedFiles.of(path, files)
    document = Document(path.name, named, root, binary_chunk, _variant(root, variants or {}))
    _check_version(root)
    return document


def variant_names(root: Fields) -> list[str]:
    """Names of the material variants, by their numbers."""
    listed = root.extension(VARIANTS)
    return [] if listed is None else [each.text("name") or "" for each in listed.children("variants")]


def _variant(root: Fields, variants: Mapping[str, str]) -> int | None:
    """The number of the variant that is chosen."""
    if not variants:
        return None
    names = variant_names(root)
    (key, choice), *more = variants.items()
    if key != MATERIALS or more or choice not in names:
        listing = f"the material variants are {', '.join(names)}" if names else "there are no material variants"
        what = (
            choice if key == MATERIALS and not more else ", ".join(f"{key}={value}" for key, value in variants.items())
        )
        raise UsageError(f"'{what}'", where=root.file, parameter="variants", rule=listing)
    return names.index(choice)


def _chunks(data: bytes, file: str) -> tuple[memoryview, memoryview | None]:
    """The JSON and binary chunks of a glb container (glTF 2.0, section 4)."""
    if len(data) < _HEADER.size:
        raise SceneError(f"the file ends after {len(data)} bytes", where=file, rule="a glb header has 12")
    _, version, length = _HEADER.unpack_from(data)
    if version == 1:
        raise _version_1(file)
    if version != 2:
        raise SceneError(f"binary glTF of version {version}", where=file, rule="version 2 is understood")
    if length > len(data):
        raise SceneError(
            f"the file is cut short: it holds {len(data)} of {length} bytes", where=file, fix="copy it anew"
        )
    chunks: dict[int, memoryview] = {}
    position = _HEADER.size
    while position + _CHUNK_HEADER.size <= length:
        size, kind = _CHUNK_HEADER.unpack_from(data, position)
        position += _CHUNK_HEADER.size
        if size > length - position:
            raise SceneError(
                f"a chunk of {size} bytes begins {length - position} bytes before the end",
                where=file,
                fix="copy it anew",
            )
        chunks.setdefault(kind, memoryview(data)[position : position + size])
        position += size
    if _CHUNK_JSON not in chunks:
        raise SceneError("the file has no JSON chunk", where=file, rule="a glb file begins with one")
    return chunks[_CHUNK_JSON], chunks.get(_CHUNK_BIN)


def _parse(text: memoryview, file: str) -> Fields:
    try:
        value = json.loads(str(text, "utf-8-sig"))
    except UnicodeDecodeError as error:
        raise SceneError(
            f"not a glTF file: byte {error.start} is no UTF-8 text",
            where=file,
            rule="glTF is JSON or begins with 'glTF'",
        ) from None
    except json.JSONDecodeError as error:
        raise SceneError(
            f"line {error.lineno}, column {error.colno}: {error.msg}", where=file, rule="a glTF file holds JSON"
        ) from None
    except (RecursionError, ValueError):  # lists nested thousands deep; whole numbers of thousands of digits
        raise SceneError("the JSON is nested or its numbers are too long to be read", where=file) from None
    if not isinstance(value, dict):
        raise SceneError("the JSON is not an object", where=file, rule="a glTF file holds one JSON object")
    return Fields(value, "", file)


def _check_version(root: Fields) -> None:
    asset = root.child("asset")
    # Version 1 names its objects where version 2 counts them; many of its writers left the version out.
    if asset is None or asset.values.get("version") in (None, 1):
        if isinstance(root.values.get("meshes"), dict):
            raise _version_1(root.file)
        if asset is None:
            raise root.error("asset", "every glTF file says its version there")
    # minVersion, where given, is what a reader must understand; version is what the file was written for.
    key = "minVersion" if asset.has("minVersion") else "version"
    version = asset.values.get(key)
    if str(version).startswith(("0.", "1.")):
        raise _version_1(root.file)
    version = asset.text(key)
    if version is None or version.split(".")[0] != "2" or (key == "minVersion" and version != "2.0"):
        raise asset.error(key, "glTF 2.0 is understood")


def _version_1(file: str) -> SceneError:
    return SceneError("the file is glTF 1.0", where=file, rule="glTF 2.0 is understood", fix=_UPGRADE)


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
    for name in document.root.texts("extensionsRequired"):
        if not _is_understood(name) and name not in _SILENT | _FORMER_MATERIALS:
            raise document.error(
                f"the file requires the glTF extension {name}",
                rule="it is not understood",
                fix="export the scene without it",
            )
    for name in document.root.texts("extensionsUsed"):
        if name == VARIANTS and document.variant is None:
            names = [name for name in variant_names(document.root) if name]
            listing = f"; there are {', '.join(names[:_NAMED])}" if names else ""
            document.notes.add(f"of the material variants the default one is shown{listing}")
        if not _is_understood(name) and name not in _SILENT:
            document.notes.add(_remark(name))


def _remark(extension: str) -> str:
    """Consequence, in words, of an extension that the file uses, does not require, and that is not understood."""
    if extension in _FORMER_MATERIALS:
        return f"materials of the glTF extension {extension} are shown as plain ones; {_UPGRADE}"
    return f"the glTF extension {extension} is not understood; what it adds is left out"


def _is_understood(name: str) -> bool:
    if name in _PICTURE_FORMATS:
        return texture_extension_is_readable(name)
    return name in _UNDERSTOOD
