"""Scenes of every kind for ``defaults.py`` that no setting of the program was tuned on: downloaded and made ones."""

from __future__ import annotations

import hashlib
import io
import json
import struct
import urllib.request
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image
from trimesh.creation import box, cylinder, icosphere, revolve, torus

_MODELS = "https://raw.githubusercontent.com/alecjacobson/common-3d-test-models/8a4f8642acaf43f9cd7b67858a1502e1055ef202/data/"
#: Public files: address and SHA-256.
DOWNLOADS = {
    "scan of a bunny": (
        _MODELS + "stanford-bunny.obj",
        "1eb35d1e21ce99e5ce911353b6be278990713448dd9e8f5c9387f9de39b32205",
    ),
    "scan of a bust": (_MODELS + "nefertiti.obj", "19e39748b145092878cc4faafd050505eb5991c5d3e497be2b4575673fa87968"),
}

Part = tuple[trimesh.Trimesh, int]


def scenes(folder: Path) -> tuple[dict[str, Path], dict[str, str]]:
    """Files by the names of their scenes, kept in ``folder``; and why others cannot be had."""
    folder.mkdir(parents=True, exist_ok=True)
    files, missing = {}, {}
    for name, (address, digest) in DOWNLOADS.items():
        path = folder / address.rsplit("/", 1)[1]
        try:
            if not path.exists():
                with urllib.request.urlopen(address, timeout=30) as answer:
                    path.write_bytes(answer.read())
        except OSError as error:
            missing[name] = f"cannot be downloaded: {error}"
            continue
        if hashlib.sha256(path.read_bytes()).hexdigest() != digest:
            missing[name] = f"'{path}' is another file than was pinned"
        else:
            files[name] = path
    for name, (ending, make) in MADE.items():
        path = folder / (name.replace(" ", "_") + ending)
        if not path.exists():
            path.write_bytes(make())
        files[name] = path
    return files, missing


def _glb(
    parts: Sequence[Part],
    materials: Sequence[Mapping[str, Any]],
    lights: Sequence[tuple[Mapping[str, Any], tuple[float, float, float]]] = (),
    texture: Image.Image | None = None,
) -> bytes:
    """A binary glTF file of parts, each with the number of its material; ``lights`` with their places."""
    chunks: list[bytes] = []
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []

    def view(data: bytes) -> int:
        views.append({"buffer": 0, "byteOffset": sum(map(len, chunks)), "byteLength": len(data)})
        chunks.append(data + b"\0" * (-len(data) % 4))
        return len(views) - 1

    def accessor(values: NDArray[Any], kind: str, component: int, **more: Any) -> int:
        accessors.append(
            {"bufferView": view(values.tobytes()), "componentType": component, "count": len(values), "type": kind}
            | more
        )
        return len(accessors) - 1

    meshes = []
    for mesh, material in parts:
        points = np.asarray(mesh.vertices, np.float32)
        limits = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
        attributes = {
            "POSITION": accessor(points, "VEC3", 5126, **limits),
            "NORMAL": accessor(np.asarray(mesh.vertex_normals, np.float32), "VEC3", 5126),
        }
        if mesh.visual.kind == "texture" and mesh.visual.uv is not None:
            attributes["TEXCOORD_0"] = accessor(np.asarray(mesh.visual.uv, np.float32), "VEC2", 5126)
        indices = accessor(np.asarray(mesh.faces, np.uint32).ravel(), "SCALAR", 5125)
        meshes.append({"primitives": [{"attributes": attributes, "indices": indices, "material": material}]})
    nodes: list[dict[str, Any]] = [{"mesh": number} for number in range(len(meshes))]
    nodes += [
        {"translation": place, "extensions": {"KHR_lights_punctual": {"light": number}}}
        for number, (_, place) in enumerate(lights)
    ]
    content: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": list(materials),
        "accessors": accessors,
    }
    used = {name for material in materials for name in material.get("extensions", {})}
    if lights:
        used.add("KHR_lights_punctual")
        content["extensions"] = {"KHR_lights_punctual": {"lights": [light for light, _ in lights]}}
    if used:
        content["extensionsUsed"] = sorted(used)
    if texture is not None:
        buffer = io.BytesIO()
        texture.save(buffer, "PNG")
        content |= {
            "images": [{"bufferView": view(buffer.getvalue()), "mimeType": "image/png"}],
            "textures": [{"source": 0}],
        }
    binary = b"".join(chunks)
    content |= {"bufferViews": views, "buffers": [{"byteLength": len(binary)}]}
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    length = 12 + 8 + len(text) + 8 + len(binary)
    head = struct.pack("<4sII", b"glTF", 2, length)
    return head + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary


def _paint(*color: float, metal: float = 0.0, rough: float = 0.8, **more: Any) -> dict[str, Any]:
    factors = {"baseColorFactor": [*color, 1.0], "metallicFactor": metal, "roughnessFactor": rough}
    return {"pbrMetallicRoughness": factors, **more}


def _at(mesh: trimesh.Trimesh, x: float, y: float, z: float) -> trimesh.Trimesh:
    return mesh.apply_translation((x, y, z))


def _flat(size: tuple[float, float, float], x: float, y: float, z: float) -> trimesh.Trimesh:
    """A box with a normal for every side."""
    mesh = box(size)
    mesh.unmerge_vertices()
    return _at(mesh, x, y, z)


_MATT, _RED, _BLUE = _paint(0.6, 0.58, 0.55), _paint(0.7, 0.12, 0.1), _paint(0.15, 0.3, 0.7)


def _foliage() -> bytes:
    leaf = np.zeros((64, 64, 4), np.uint8)
    y, x = np.mgrid[0:64, 0:64] / 31.5 - 1
    leaf[..., :3] = (60, 120, 30)
    leaf[..., 1] += (40 * np.abs(np.sin(9 * (x + np.abs(y))))).astype(np.uint8)
    leaf[..., 3] = 255 * (np.abs(y) < 0.55 * (1 - x**2))
    random = np.random.default_rng(11)
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    points, normals = [], []
    for _ in range(400):
        turn = trimesh.transformations.random_rotation_matrix(random.random(3))[:3, :3]
        direction = random.normal(size=3)
        place = direction / np.linalg.norm(direction) * (0.6 + 0.4 * random.random()) * (1.6, 1.2, 1.2) + (0, 3, 0)
        points.append(corners * 0.3 @ turn.T + place)
        normals.append(np.repeat(turn[:, 2][None], 4, axis=0))
    faces = np.concatenate([np.array([[0, 1, 2], [0, 2, 3]]) + 4 * k for k in range(400)])
    leaves = trimesh.Trimesh(
        np.concatenate(points), faces, vertex_normals=np.concatenate(normals), process=False, validate=False
    )
    leaves.visual = trimesh.visual.TextureVisuals(uv=np.tile([[0, 0], [1, 0], [1, 1], [0, 1]], (400, 1)).astype(float))
    trunk = cylinder(0.18, 2.4)
    trunk.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)))
    green = {
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0.0, "roughnessFactor": 0.7},
        "alphaMode": "MASK",
        "doubleSided": True,
    }
    parts = [(leaves, 0), (_at(trunk, 0, 1.2, 0), 1), (_flat((5, 0.1, 4), 0, -0.05, 0), 2)]
    return _glb(parts, [green, _paint(0.3, 0.2, 0.12), _MATT], texture=Image.fromarray(leaf, "RGBA"))


def _interior() -> bytes:
    walls = [
        _flat((4, 0.1, 3), 0, -0.05, 0),
        _flat((4, 0.1, 3), 0, 2.55, 0),
        _flat((4, 2.6, 0.1), 0, 1.25, -1.5),
        _flat((0.1, 2.6, 3), -2, 1.25, 0),
        _flat((0.1, 2.6, 3), 2, 1.25, 0),
    ]
    table = [_flat((1.4, 0.08, 0.8), 0.2, 0.8, 0), _flat((0.1, 0.8, 0.1), 0.2, 0.4, 0)]
    bulb = _paint(
        1.0,
        0.9,
        0.7,
        emissiveFactor=[1.0, 0.85, 0.6],
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 60.0}},
    )
    parts = [(wall, 2 if number == 3 else 0) for number, wall in enumerate(walls)] + [(part, 3) for part in table]
    parts += [(_at(icosphere(3, 0.06), -1.8, 1.7, -0.6), 1), (_at(icosphere(4, 0.25), 0.3, 1.09, 0), 4)]
    return _glb(parts, [_MATT, bulb, _RED, _paint(0.4, 0.25, 0.12, rough=0.4), _BLUE])


def _balls(*paints: Mapping[str, Any]) -> bytes:
    """Balls and a ring of each paint on a chequered floor."""
    parts: list[Part] = []
    for number in range(len(paints)):
        parts.append((_at(icosphere(5, 0.9), 2.2 * number, 0.9, 0), number))
        parts.append((_at(torus(0.5, 0.18, 64, 32), 2.2 * number, 0.5, 1.5), number))
    tiles = [(column, row) for column in range(-2, 8) for row in range(-3, 4)]
    for column, row in tiles:
        tile = _flat((0.8, 0.1, 0.8), 0.8 * column, -0.05, 0.8 * row)
        parts.append((tile, len(paints) + (column + row) % 2))
    return _glb(parts, [*paints, _MATT, _paint(0.08, 0.08, 0.1)])


def _clear_coat() -> bytes:
    coat = {"KHR_materials_clearcoat": {"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.03}}
    return _balls(
        _paint(0.6, 0.02, 0.02, metal=0.7, rough=0.5, extensions=coat),
        _paint(0.02, 0.1, 0.4, rough=0.7, extensions=coat),
        _paint(0.9, 0.6, 0.2, metal=1.0, rough=0.4, extensions=coat),
    )


def _chrome() -> bytes:
    return _balls(
        _paint(0.95, 0.95, 0.95, metal=1.0, rough=0.0),
        _paint(0.95, 0.7, 0.3, metal=1.0, rough=0.1),
        _paint(0.9, 0.9, 0.9, metal=1.0, rough=0.3),
    )


def _glass() -> bytes:
    clear = {"KHR_materials_transmission": {"transmissionFactor": 1.0}, "KHR_materials_ior": {"ior": 1.5}}
    tinted = {
        "KHR_materials_volume": {
            "thicknessFactor": 1.0,
            "attenuationDistance": 1.0,
            "attenuationColor": [0.3, 0.8, 0.5],
        },
        **clear,
    }
    profile = [[0, 0], [0.7, 0], [0.7, 0.1], [0.12, 0.2], [0.12, 1.0], [0.7, 1.4], [0.8, 2.2], [0.72, 2.2], [0, 1.25]]
    goblet = revolve(np.array(profile), sections=96)
    goblet.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0)))
    parts = [(goblet, 0), (_at(icosphere(5, 0.7), 1.7, 0.7, 0.3), 1), (_flat((6, 0.1, 4), 0, -0.06, 0), 2)]
    parts += [(_flat((0.5, 1.2, 0.5), -1.8, 0.6, -0.8), 3), (_flat((0.5, 0.8, 0.5), 0.9, 0.4, -1.2), 4)]
    clean = _paint(1, 1, 1, rough=0.0, extensions=clear)
    return _glb(parts, [clean, _paint(1, 1, 1, rough=0.0, extensions=tinted), _MATT, _RED, _BLUE])


def _city() -> bytes:
    random = np.random.default_rng(4)
    paints = [_MATT, _paint(0.3, 0.32, 0.36, rough=0.3), _paint(0.55, 0.4, 0.3), _paint(0.75, 0.75, 0.72)]
    parts: list[Part] = [(_flat((15, 0.2, 15), 5.5, -0.1, 5.5), 0)]
    for x in range(12):
        for z in range(12):
            height = 0.4 + 3 * random.random() ** 3
            parts.append((_flat((0.7, height, 0.7), x, height / 2, z), int(random.integers(1, 4))))
    return _glb(parts, paints)


def _unlit() -> bytes:
    random = np.random.default_rng(8)
    paints = [_paint(*random.random(3).tolist(), extensions={"KHR_materials_unlit": {}}) for _ in range(12)]
    parts = [
        (_at(icosphere(3, 0.5) if k % 2 else box((0.8, 0.8, 0.8)), *(3 * random.random(3)).tolist()), k)
        for k in range(12)
    ]
    return _glb(parts, paints)


def _physical_lights() -> bytes:
    parts = [(_flat((6, 0.1, 4), 0, -0.05, 0), 0), (_flat((6, 3, 0.1), 0, 1.5, -2), 0)]
    parts += [(_at(icosphere(4, 0.6), -1, 0.6, 0), 1), (_flat((0.9, 1.4, 0.9), 1.2, 0.7, 0.2), 2)]
    spot = {
        "type": "spot",
        "intensity": 900.0,
        "color": [1, 0.9, 0.75],
        "spot": {"innerConeAngle": 0.6, "outerConeAngle": 0.9},
    }
    lights = [(spot, (0.0, 2.5, 2.5)), ({"type": "point", "intensity": 120.0, "color": [0.6, 0.8, 1]}, (-2.4, 1.8, 1))]
    return _glb(parts, [_MATT, _paint(0.8, 0.7, 0.5, metal=1.0, rough=0.35), _RED], lights)


def _splats() -> bytes:
    random = np.random.default_rng(21)
    count = 30_000
    angle = random.uniform(0, 2 * np.pi, count)
    ring = 2 + np.cos(3 * angle)
    points = np.stack([ring * np.cos(2 * angle), ring * np.sin(2 * angle), np.sin(3 * angle)], axis=1)
    points += random.normal(scale=0.15, size=(count, 3))
    color = 1.6 * np.stack([np.cos(angle), np.sin(2 * angle), np.cos(3 * angle)], axis=1)
    names = ["x", "y", "z", *(f"f_dc_{k}" for k in range(3)), "opacity"]
    names += [*(f"scale_{k}" for k in range(3)), *(f"rot_{k}" for k in range(4))]
    columns = [points, color, random.uniform(-1, 3, (count, 1)), random.uniform(-4.5, -3, (count, 3))]
    columns.append(random.normal(size=(count, 4)))
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n"
    head += "".join(f"property float {name}\n" for name in names) + "end_header\n"
    return head.encode() + np.concatenate(columns, axis=1).astype("<f4").tobytes()


def _ct() -> bytes:
    z, y, x = np.mgrid[0:96, 0:96, 0:96] / 47.5 - 1
    body = np.full((96, 96, 96), -1000.0)
    body[(x / 0.9) ** 2 + (y / 0.7) ** 2 + (z / 0.95) ** 2 < 1] = 40
    for side in (-1, 1):
        body[((x - 0.45 * side) / 0.3) ** 2 + (y / 0.4) ** 2 + (z / 0.7) ** 2 < 1] = -750
        ribs = np.abs(np.hypot(x / 0.85, y / 0.65) - 0.92) < 0.06
        body[ribs & (np.sin(18 * z + 3 * y) > 0.3) & (np.sign(x) == side)] = 700
    body[np.hypot(x, y - 0.5) < 0.1 + 0.03 * np.sin(30 * z)] = 900
    body += np.random.default_rng(2).normal(scale=15, size=body.shape)
    buffer = io.BytesIO()
    np.save(buffer, body.astype(np.int16))
    return buffer.getvalue()


def _molecule() -> bytes:
    """A helix of 40 residues' backbones."""
    lines = []
    atoms = (("N", 1.55, -28.0, -0.9), ("CA", 2.29, 0.0, 0.0), ("C", 1.66, 26.0, 1.1), ("O", 2.0, 22.0, 2.3))
    for residue in range(40):
        for name, radius, offset, rise in atoms:
            angle = np.radians(100.0 * residue + offset)
            x, y, z = radius * np.cos(angle), radius * np.sin(angle), 1.5 * residue + rise
            number = len(lines) + 1
            lines.append(
                f"ATOM  {number:5d}  {name:<3s} ALA A{residue + 1:4d}    {x:8.3f}{y:8.3f}{z:8.3f}  1.00  0.00"
                f"          {name[0]:>2s}"
            )
    return ("\n".join([*lines, "END"]) + "\n").encode()


MADE: Mapping[str, tuple[str, Callable[[], bytes]]] = {
    "foliage": (".glb", _foliage),
    "bulb by a wall": (".glb", _interior),
    "clear coat": (".glb", _clear_coat),
    "chrome": (".glb", _chrome),
    "glass": (".glb", _glass),
    "city of boxes": (".glb", _city),
    "unlit": (".glb", _unlit),
    "physical lights": (".glb", _physical_lights),
    "splats": (".ply", _splats),
    "CT": (".npy", _ct),
    "molecule": (".pdb", _molecule),
}
