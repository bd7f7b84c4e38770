"""Stereolithography files (``.stl``), text and binary, read with trimesh."""

from __future__ import annotations

import io
import re
import warnings
from pathlib import Path

import numpy as np

from lippmann.errors import SceneError
from lippmann.scene.parsing.files import decode_text, read_bytes
from lippmann.scene.readers.ply import UP_NOTE
from lippmann.scene.values.description import Instance, Material, Mesh, SceneDescription

_HEADER, _FACET = 84, 50  # bytes


def read_stl(path: Path, *, allow_outside: bool = False) -> SceneDescription:
    """Read an STL file; its solids become one mesh of flat facets. It names no other file.

    Raises
    ------
    SceneError
        The file is missing, foreign, cut short, or holds no facets.
    """
    del allow_outside
    where = path.name
    data = read_bytes(path)
    notes = [UP_NOTE]
    if _is_binary(data):
        _check_binary(data, where)
        positions = _positions(data, "stl", where)
    else:
        _check_text(data, where)
        # In one encoding: trimesh guesses with libraries that need not be there.
        positions = _positions(decode_text(data, where).encode("utf-8"), "stl_ascii", where)
    if len(positions) == 0:
        raise SceneError("holds no facets", where=where)
    material = Material(path.stem, base_color=(0.7, 0.7, 0.7), roughness=0.6, double_sided=True)
    faces = np.arange(len(positions), dtype=np.uint32).reshape(-1, 3)
    mesh = Mesh(path.stem, positions, faces, material=0)
    return SceneDescription(path.stem, [mesh], [material], [Instance(0, np.eye(4))], notes=notes)


def _is_binary(data: bytes) -> bool:
    """Binary files may begin with "solid" too: what follows tells."""
    return not (data.lstrip()[:5].lower() == b"solid" and b"\0" not in data[:_HEADER])


def _check_binary(data: bytes, where: str) -> None:
    if len(data) < _HEADER:
        raise SceneError("is no STL file", where=where, rule=f"it begins with 'solid' or has {_HEADER} bytes of header")
    count = int.from_bytes(data[80:84], "little")
    expected = _HEADER + _FACET * count
    if len(data) != expected:
        raise SceneError(
            f"has {len(data)} bytes, and its header speaks of {count} facets",
            where=where,
            rule=f"they take {expected} bytes",
            fix="is it cut short, or no STL file?",
        )


def _check_text(data: bytes, where: str) -> None:
    text = data.lower()
    opened, closed = len(re.findall(rb"(?m)^\s*solid\b", text)), len(re.findall(rb"(?m)^\s*endsolid\b", text))
    if opened != closed:
        raise SceneError(f"has {opened} 'solid' and {closed} 'endsolid'", where=where, fix="is it cut short?")
    facets, vertices = len(re.findall(rb"\bfacet\s+normal\b", text)), len(re.findall(rb"(?m)^\s*vertex\b", text))
    if vertices != 3 * facets:
        raise SceneError(f"has {vertices} vertices in {facets} facets", where=where, rule="a facet has three")


def _positions(data: bytes, kind: str, where: str) -> np.ndarray:
    import trimesh

    log = trimesh.util.log
    before, log.disabled = log.disabled, True  # it logs what it makes of damaged normals, which nobody uses
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # NumPy only warns of a word that is no number
            loaded = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False)
    except (ValueError, TypeError, KeyError, IndexError, Warning, trimesh.exchange.stl.HeaderError) as error:
        raise SceneError(f"cannot be read ({error})", where=where) from None
    finally:
        log.disabled = before
    pieces = [np.asarray(mesh.triangles).reshape(-1, 3) for mesh in loaded.geometry.values()]
    with np.errstate(over="ignore"):  # infinite places are refused with those of all formats
        return np.concatenate([np.zeros((0, 3)), *pieces]).astype(np.float32)
