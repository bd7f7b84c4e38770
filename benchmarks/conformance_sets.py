"""The public sets of scene files that ``conformance.py`` was run on; which files are valid and show triangles."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_SUFFIXES = frozenset({".gltf", ".glb", ".obj", ".ply", ".stl", ".nff", ".dat", ".xml"})


@dataclass(frozen=True)
class Set:
    """A public set of files.

    Attributes
    ----------
    title, address, license:
        What it is, where it is published, and under which licence.
    broken:
        Pattern of the names of files that are no valid files, on purpose.
    allow_outside:
        Whether its files name files of other folders of the set.
    """

    title: str
    address: str
    license: str
    broken: str = r"(^|/)invalid/"
    allow_outside: bool = False


_MAGNUM_BROKEN = (
    r"-invalid|/invalid-|/(format-(missing|too-late|unsupported)|extra-token-.*|integer-literal-(at-file-end|invalid|too-large)"
    r"|incomplete-face-specification|positions-(missing|not-all|unsupported-type)|unsupported-face-size"
    r"|unexpected-property|unknown-(element|line)|custom-components-duplicate)\.ply$"
)

SETS = {
    "assimp": Set(
        "Assimp, test models", "https://github.com/assimp/assimp", "BSD-3-Clause; some models have their own"
    ),
    "debian": Set(
        "Debian, package assimp-testmodels 5.2.5",
        "https://packages.debian.org/bookworm/assimp-testmodels",
        "BSD-3-Clause; some models have their own",
    ),
    "magnum": Set(
        "Magnum Plugins, inputs of their tests", "https://github.com/mosra/magnum-plugins", "MIT", _MAGNUM_BROKEN
    ),
    "blenderio": Set("Khronos glTF-Blender-IO, tests", "https://github.com/KhronosGroup/glTF-Blender-IO", "Apache-2.0"),
    "validator": Set("Khronos glTF-Validator, tests", "https://github.com/KhronosGroup/glTF-Validator", "Apache-2.0"),
    "transform": Set("glTF-Transform, tests", "https://github.com/donmccurdy/glTF-Transform", "MIT"),
    "gltfrs": Set("gltf of Rust, tests and examples", "https://github.com/gltf-rs/gltf", "MIT or Apache-2.0"),
    "pipeline": Set("glTF Pipeline, tests", "https://github.com/CesiumGS/gltf-pipeline", "Apache-2.0"),
    "sbtron": Set(
        "glTF sample models, a copy with glTF 1.0", "https://github.com/sbtron/glTF-Sample-Models", "each model its own"
    ),
    "webgltf": Set("WebGLTF sample models", "https://github.com/webgltf/webgltf-sample-models", "each model its own"),
    "mitsuba": Set(
        "Mitsuba, data of its tests",
        "https://github.com/mitsuba-renderer/mitsuba-data",
        "each scene its own",
        allow_outside=True,
    ),
}


#: Why a file is not valid that names one that its set lacks.
INCOMPLETE = "a file that it names is missing"


@dataclass(frozen=True)
class Validity:
    """Whether a file is valid and shows triangles; if not, ``why``."""

    valid: bool
    why: str = ""


def scene_files(folder: Path) -> list[Path]:
    """The scene files below a folder, by their endings; of XML and DAT files those of Mitsuba and Tachyon."""
    paths = (path for path in sorted(folder.rglob("*")) if path.suffix.lower() in _SUFFIXES and path.is_file())
    return [path for path in paths if path.suffix.lower() not in (".xml", ".dat") or _is_scene(path)]


def _is_scene(path: Path) -> bool:
    head = path.read_bytes()[:8192]
    return b"<scene" in head if path.suffix.lower() == ".xml" else b"BEGIN_SCENE" in head.upper()


def validities(folder: Path, files: Sequence[Path], name: str, validator: Path | None) -> dict[str, Validity]:
    """Which files are valid and show triangles, by their names within ``folder``."""
    broken = re.compile(SETS[name].broken if name in SETS else Set.broken)
    verdicts = _load_with_mitsuba([path for path in files if path.suffix.lower() == ".xml"])
    if validator is not None:
        verdicts |= _validate([path for path in files if path.suffix.lower() in (".gltf", ".glb")], validator)
    judged = {}
    included = _included(files)
    for path in files:
        shown = path.relative_to(folder).as_posix()
        verdict = verdicts.get(str(path))
        why = _without_triangles(path) or verdict
        if why is None and broken.search("/" + shown):
            why = "damaged on purpose, by its name"
        if path.name in included:
            why = "a part that other files include"
        judged[shown] = Validity(not why, why or "")
    return judged


def _included(files: Sequence[Path]) -> set[str]:
    """The names of files that Mitsuba's XML files include."""
    texts = (path.read_text("utf-8", "replace") for path in files if path.suffix.lower() == ".xml")
    return {Path(name).name for text in texts for name in re.findall(r'<include\s+filename="([^"]+)"', text)}


def _without_triangles(path: Path) -> str | None:
    """Why a file has nothing to show, None if it has or cannot be taken apart."""
    data = path.read_bytes()
    match path.suffix.lower():
        case ".obj":
            shows = re.search(rb"(?m)^\s*f\s", data) is not None or b"\0" in data
        case ".ply":
            count = re.search(rb"element\s+(?:face|tristrips)\s+(\d+)", data[:65536])
            shows = count is not None and int(count[1]) > 0
        case ".stl":
            shows = len(data) > 84 and (data[:5] != b"solid" or b"\0" in data[:84] or b"vertex" in data)
        case ".nff":
            # Formats of the same ending: that of WorldToolKit by Sense8, and Assimp's own words.
            foreign = rb"(?m)\A\s*nff\b|^(tess|tet|oct|hex|dod) |^f .*\.(png|jpg)"
            return "another format of this ending" if re.search(foreign, data) else None
        case ".gltf" | ".glb":
            return _without_shown_triangles(data)
        case _:
            return None
    return None if shows else "without triangles"


def _without_shown_triangles(data: bytes) -> str | None:
    try:
        binary = data[:4] == b"glTF"
        text = data[20 : 20 + int.from_bytes(data[12:16], "little")] if binary else data
        root: dict[str, Any] = json.loads(text.decode("utf-8-sig"))
        version = str(root["asset"].get("version", "1.0"))
        if version.startswith(("0.", "1.")):
            return "glTF 1.0"
        nodes, meshes, scenes = (root.get(key, []) for key in ("nodes", "meshes", "scenes"))
        children = {child for node in nodes for child in node.get("children", [])}
        roots = [index for index in range(len(nodes)) if index not in children]
        stack = list(scenes[root.get("scene", 0)].get("nodes", []) if scenes else roots)
        for _ in range(10 * len(nodes) + 10):
            if not stack:
                return "without triangles in its scene"
            node = nodes[int(stack.pop())]
            stack += node.get("children", [])
            primitives = meshes[node["mesh"]]["primitives"] if "mesh" in node else []
            if any(each.get("mode", 4) >= 4 and _has_positions(each, root, binary) for each in primitives):
                return None
    except (ValueError, KeyError, IndexError, TypeError, AttributeError):
        pass
    return None


def _has_positions(primitive: dict[str, Any], root: dict[str, Any], binary: bool) -> bool:
    """Whether there are bytes behind the positions: else all of them are zero."""
    if "KHR_draco_mesh_compression" in primitive.get("extensions", {}):
        return True
    accessor = root["accessors"][int(primitive["attributes"]["POSITION"])]
    if accessor["count"] < 3 or "bufferView" not in accessor:
        return accessor["count"] > 2 and "sparse" in accessor
    view = root["bufferViews"][int(accessor["bufferView"])]
    buffer = int(view["buffer"])
    return "extensions" in view or "uri" in root["buffers"][buffer] or (binary and buffer == 0)


#: Errors of Khronos' validator that leave the geometry whole: wrong bounds, weights whose sum is not quite 1.
_BLEMISHES = (
    "ACCESSOR_ANIMATION_INPUT_NEGATIVE",
    "ACCESSOR_ANIMATION_INPUT_NON_INCREASING",
    "ACCESSOR_ELEMENT_OUT_OF_MAX_BOUND",
    "ACCESSOR_ELEMENT_OUT_OF_MIN_BOUND",
    "ACCESSOR_MAX_MISMATCH",
    "ACCESSOR_MIN_MISMATCH",
    "ACCESSOR_NON_CLAMPED",
    "ACCESSOR_VECTOR3_NON_UNIT",
    "ACCESSOR_WEIGHTS_NON_NORMALIZED",
    "MESH_PRIMITIVE_ACCESSOR_UNALIGNED",
    "MESH_PRIMITIVE_NO_TANGENT_SPACE",
    "MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS",
    "TEXTURE_INVALID_IMAGE_MIME_TYPE",
)

_PROGRAM = """
const fs = require('fs'), path = require('path'), validator = require('gltf-validator');
const read = file => fs.promises.readFile(file).then(bytes => new Uint8Array(bytes));
(async () => {
  for (const file of fs.readFileSync(0, 'utf8').split('\\n').filter(line => line)) {
    let errors = ['NOT_READ'];
    try {
      const report = await validator.validateBytes(await read(file), {
        ignoredIssues: IGNORED,
        externalResourceFunction: uri => read(path.join(path.dirname(file), decodeURIComponent(uri))),
      });
      errors = report.issues.messages.filter(issue => issue.severity == 0).map(issue => issue.code);
    } catch (error) { }
    console.log(JSON.stringify([file, [...new Set(errors)]]));
  }
})();
"""


def _validate(files: Sequence[Path], folder: Path) -> dict[str, str]:
    """Why glTF files are not valid, by Khronos' validator; empty for those that are."""
    done = subprocess.run(
        ["node", "-e", _PROGRAM.replace("IGNORED", json.dumps(_BLEMISHES))],
        input="\n".join(map(str, files)),
        env={**os.environ, "NODE_PATH": str(folder.resolve() / "node_modules")},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return {file: _why(errors) for file, errors in map(json.loads, done.stdout.splitlines())}


def _why(errors: list[str]) -> str:
    if not errors:
        return ""
    return INCOMPLETE if errors == ["IO_ERROR"] else "errors by Khronos' validator"


_LOADER = """
import json, sys
import mitsuba

mitsuba.set_variant("scalar_rgb")
mitsuba.set_log_level(mitsuba.LogLevel.Error)
for line in sys.stdin:
    why = ""
    try:
        mitsuba.load_file(line.strip())
    except Exception:
        why = "Mitsuba itself refuses it"
    print(json.dumps([line.strip(), why]), flush=True)
"""


def _load_with_mitsuba(files: Sequence[Path]) -> dict[str, str]:
    """Why XML files are not valid, by Mitsuba; empty for those that it loads."""
    if not files:
        return {}
    done = subprocess.run(
        [sys.executable, "-c", _LOADER],
        input="\n".join(map(str, files)),
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        check=True,
    )
    return dict(map(json.loads, done.stdout.splitlines()))
