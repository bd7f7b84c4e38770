"""Stereolithography files (``.stl``), text and binary.

Read from the format's description (3D Systems, "Stereolithography Interface Specification", 1988). The reader is
Lippmann's own because trimesh's takes comments and facets without normals for damage.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import decode_srgb
from lippmann.errors import SceneError
from lippmann.scene.parsing.far_origin import near_origin
from lippmann.scene.parsing.files import decode_text, read_bytes
from lippmann.scene.parsing.vertex_colors import GREY_CODES
from lippmann.scene.values.description import FloatArray, Instance, Material, Mesh, SceneDescription

_HEADER = 84  # bytes
#: A facet: its normal, which nobody needs, three vertices, and a number in which some programs write its colour.
_FACET = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])

#: In a header of Materialise's programs, before the bytes R, G, B, A of facets without a colour of their own.
_OWN_COLOR = b"COLOR="
#: The beginning of a header of MeshLab's, with its grey.
_MESHLAB = b"COLOR=\x7f\x7f\x7f MATERIAL="

# Lines that hold names or remarks: free text in which any word may stand.
_REMARK = re.compile(r"(?m)^[ \t]*(?:(?:end)?solid\b|#|//|;).*$|(?:[ \t]#|//|;).*$")
#: The first statement, after a byte order mark and remarks.
_SOLID = re.compile(rb"(?m)^(?:\xef\xbb\xbf)?\s*solid\b")
_LONGEST_REMARKS = 4096
_VERTEX = re.compile(r"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)")


def read_stl(path: Path) -> SceneDescription:
    """Read an STL file; its solids become one mesh of flat facets. It names no other file.

    Raises
    ------
    SceneError
        The file is missing, foreign, cut short, or holds no facets.
    """
    where = path.name
    data = read_bytes(path)
    notes: list[str] = []
    binary = _is_binary(data)
    colors = None
    if binary:
        facets = _binary_facets(data, where)
        positions = facets["vertices"].reshape(-1, 3).astype(np.float64)
        colors = _facet_colors(data[:80], facets["attribute"])
    else:
        positions = _text_positions(decode_text(data, where), where)
    if len(positions) == 0:
        raise SceneError("holds no facets", where=where)
    plain = (0.7, 0.7, 0.7) if colors is None else (1.0, 1.0, 1.0)
    material = Material(path.stem, base_color=plain, roughness=0.6, double_sided=True)
    faces = np.arange(len(positions), dtype=np.uint32).reshape(-1, 3)
    with np.errstate(over="ignore"):  # infinite places are refused with those of all formats
        places = np.ascontiguousarray(near_origin(positions, notes), np.float32)
    mesh = Mesh(path.stem, places, faces, material=0, colors=colors)
    return SceneDescription(path.stem, [mesh], [material], [Instance(0, np.eye(4))], notes=notes)


def _is_binary(data: bytes) -> bool:
    """Binary files may begin with "solid" too: the number of facets that follows has a byte of 0."""
    return b"\0" in data[:_HEADER] or _SOLID.search(data[:_LONGEST_REMARKS].lower()) is None


def _binary_facets(data: bytes, where: str) -> NDArray[np.void]:
    if len(data) < _HEADER:
        raise SceneError("is no STL file", where=where, rule=f"it begins with 'solid' or has {_HEADER} bytes of header")
    count = int.from_bytes(data[80:84], "little")
    expected = _HEADER + _FACET.itemsize * count
    if len(data) != expected:
        raise SceneError(
            f"has {len(data)} bytes, and its header speaks of {count} facets",
            where=where,
            rule=f"they take {expected} bytes",
            fix="is it cut short, or no STL file?",
        )
    return np.frombuffer(data, _FACET, count, _HEADER)


def _facet_colors(header: bytes, numbers: NDArray[np.uint16]) -> FloatArray | None:
    """Linear RGBA ``(3 facets, 4)`` of the corners; None of a file whose facets have no colours.

    A colour has five bits a channel. With ``COLOR=`` in the header (Materialise) red is in the lowest bits, and facets
    whose highest bit is set have the header's colour; so have those of 0 where all are, and in files of MeshLab, which
    sets that bit of each colour. Without (VisCAM, SolidView) red is in the highest bits; facets whose highest bit is
    set have a colour; all others are 0.
    """
    is_set = numbers >> 15 == 1
    parts = np.stack([numbers >> shift & 31 for shift in (0, 5, 10)], axis=1) / 31.0
    start = header.find(_OWN_COLOR) + len(_OWN_COLOR)
    own = header[start : start + 3]
    if start >= len(_OWN_COLOR) and len(own) == 3:
        inherits = numbers == 0 if header.startswith(_MESHLAB) or not numbers.any() else is_set
        codes = np.where(inherits[:, None], np.frombuffer(own, np.uint8) / 255.0, parts)
    elif is_set.any() and not numbers[~is_set].any():
        codes = np.where(is_set[:, None], parts[:, ::-1], GREY_CODES)
    else:
        return None
    colors = np.concatenate([decode_srgb(codes), np.ones((len(codes), 1))], axis=1)
    return np.repeat(colors.astype(np.float32), 3, axis=0)


def _text_positions(text: str, where: str) -> NDArray[np.float64]:
    """Vertices ``(3 facets, 3)``; words other than vertices, such as normals, are not looked at."""
    text = text.lower()
    opened, closed = (len(re.findall(rf"(?m)^[ \t]*{word}\b", text)) for word in ("solid", "endsolid"))
    if opened != closed:
        raise SceneError(f"has {opened} 'solid' and {closed} 'endsolid'", where=where, fix="is it cut short?")
    # A space for each remark keeps the lines, and with them their numbers.
    text = _REMARK.sub(" ", text)
    facets = text.split("endfacet")
    if "facet" in facets.pop():
        raise SceneError("ends within a facet", where=where, fix="is it cut short?")
    wrong = next((index for index, facet in enumerate(facets) if facet.count("vertex") != 3), None)
    if wrong is not None:
        before = "".join(facets[:wrong]) + facets[wrong][: -len(facets[wrong].lstrip()) or None]
        raise SceneError(
            f"facet with {facets[wrong].count('vertex')} vertices",
            where=f"{where}:{before.count(chr(10)) + 1}",
            rule="a facet has three",
        )
    words = [word for vertex in _VERTEX.findall(text) for word in vertex]
    if len(words) != 9 * len(facets):
        raise SceneError("a vertex has fewer than three numbers", where=where, fix="is it cut short?")
    try:
        return np.array(words, np.float64).reshape(-1, 3)
    except ValueError as error:
        raise SceneError(f"a vertex is no number ({error})", where=where) from None
