"""Wavefront OBJ (``.obj``) with its material libraries.

Read from the format's description (Wavefront, "Object Files", Advanced Visualizer manual, appendix B1). The reader is
Lippmann's own because the ones on offer either drop most of MTL (trimesh, Mitsuba) or have no release for current
Python (tinyobjloader). Materials are mapped in ``mtl_to_pbr.py``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import decode_srgb
from lippmann.errors import SceneError
from lippmann.scene.parsing.far_origin import near_origin
from lippmann.scene.parsing.files import (
    MissingFileError,
    NamedFiles,
    decode_text,
    is_file,
    names_on_line,
    read_bytes,
    strip_comment,
)
from lippmann.scene.parsing.points_lines import as_material
from lippmann.scene.parsing.triangulation import triangulate
from lippmann.scene.parsing.vertex_colors import without_doubled_colors
from lippmann.scene.point_clouds import describe_cloud
from lippmann.scene.readers.mtl import MtlRecord, parse_mtl
from lippmann.scene.readers.mtl_to_pbr import MaterialMapper
from lippmann.scene.readers.obj_points_lines import draw_points_and_lines
from lippmann.scene.readers.obj_tables import (
    Integers,
    Lines,
    Points,
    check_vertices,
    drop_absent,
    read_corners,
    read_table,
)
from lippmann.scene.values.description import Instance, Material, Mesh, SceneDescription

# Curves, surfaces and display hints: drawn by no renderer of triangles.
_UNSUPPORTED = {
    "curv": "curves",
    "curv2": "curves",
    "surf": "free-form surfaces",
    "call": "calls of other files",
}
#: Digits of a smoothing group that fits into 64 bits; longer ones count as odd values.
_LONGEST_NUMBER = 18
_SILENT = {"g", "o", "vp", "cstype", "deg", "parm", "trim", "hole", "scrv", "sp", "end", "con", "bmat", "step", "mg"}
_SILENT |= {"bevel", "c_interp", "d_interp", "lod", "maplib", "shadow_obj", "trace_obj", "ctech", "stech"}


@dataclass
class _Statements:
    """The statements of an OBJ file by keyword, before any number is read."""

    positions: Lines = field(default_factory=Lines)
    uvs: Lines = field(default_factory=Lines)
    normals: Lines = field(default_factory=Lines)
    faces: Lines = field(default_factory=Lines)
    points: Lines = field(default_factory=Lines)
    lines: Lines = field(default_factory=Lines)
    libraries: Lines = field(default_factory=Lines)
    materials: list[str] = field(default_factory=lambda: [""])
    # (first face, point or line; value), which holds up to the next run
    material_runs: list[tuple[int, int]] = field(default_factory=lambda: [(0, 0)])
    point_material_runs: list[tuple[int, int]] = field(default_factory=lambda: [(0, 0)])
    line_material_runs: list[tuple[int, int]] = field(default_factory=lambda: [(0, 0)])
    smoothing_runs: list[tuple[int, int]] = field(default_factory=lambda: [(0, 0)])
    painted: list[str] = field(default_factory=list)
    ignored: dict[str, int] = field(default_factory=dict)


@dataclass
class _Geometry:
    """The file's tables, and its triangles as indices into them; -1 where a corner has no uv or normal."""

    positions: Points
    colors: Points | None
    uvs: Points
    normals: Points
    position_of: Integers
    uv_of: Integers
    normal_of: Integers
    material_of: Integers


#: Material libraries that a file may name: each is looked for in its folder.
_MOST_LIBRARIES = 1000


def read_obj(path: Path, *, files: NamedFiles | None = None) -> SceneDescription:
    """Read an OBJ file; faces of one material become one mesh.

    Parameters
    ----------
    files:
        Those that it may name; by default those of its folder and below.

    Raises
    ------
    SceneError
        The file is missing, cut short or malformed; an index is not found.
    """
    where = path.name
    statements = _split_statements(decode_text(read_bytes(path), where), where)
    if not (statements.faces.bodies or statements.points.bodies or statements.lines.bodies):
        foreign = [what for what in statements.ignored if what in _UNSUPPORTED.values()]
        if foreign:
            fix = "turn them into meshes, in Blender for instance"
            what = f"holds {' and '.join(foreign)} alone"
            raise SceneError(what, where=where, rule="faces, lines and points are shown", fix=fix)
        if not statements.positions.bodies or statements.uvs.bodies:  # clouds have no texture coordinates
            fix = "is it cut short?" if statements.uvs.bodies else "is it an OBJ file?"
            raise SceneError("holds no faces, lines or points", where=where, fix=fix)
        return _cloud(path.stem, *_assemble(statements, where))
    geometry, notes = _assemble(statements, where)
    named = NamedFiles.of(path, files)
    records, missing = _read_libraries(statements.libraries, where, named)
    mapper = MaterialMapper(named)
    meshes: list[Mesh] = []
    materials: list[Material] = []
    notes += [f"{count} {what} are not rendered" for what, count in statements.ignored.items()]
    thin, sizes = _draw_points_and_lines(statements, geometry, where)
    for index, name in enumerate(statements.materials):
        rows = np.flatnonzero(geometry.material_of == index)
        solids = [mesh for mesh in thin if mesh.material == index]
        if len(rows) == 0 and not solids:
            continue
        record = records.get(name) or records.get(strip_comment(name))
        if record is None and name and not missing:
            notes.append(f"material '{name}' is in no material library: taken as plain grey")
        material = mapper.material(record) if record else mapper.default(name)
        if len(rows):
            materials.append(material)
            mesh = _mesh(geometry, rows, name or path.stem, len(materials) - 1)
            meshes.append(without_doubled_colors(mesh, material, notes))
        if solids:
            materials.append(as_material(material))
            meshes += [replace(mesh, material=len(materials) - 1) for mesh in solids]
    if not meshes:
        raise SceneError("holds nothing but lines without length", where=where)
    return SceneDescription(
        name=path.stem,
        meshes=meshes,
        materials=materials,
        instances=[Instance(index, np.eye(4)) for index in range(len(meshes))],
        notes=[*missing, *notes, *sizes, *mapper.notes],
    )


def _cloud(name: str, geometry: _Geometry, notes: list[str]) -> SceneDescription:
    """Vertices alone, as scanners' programs write clouds of points."""
    points = np.arange(len(geometry.positions), dtype=np.uint32)[:, None]
    colors = _linear_colors(geometry)
    thin = Mesh(
        name,
        geometry.positions.astype(np.float32),
        points,
        0,
        colors=None if colors is None else colors.astype(np.float32),
    )
    plain = (0.7, 0.7, 0.7) if colors is None else (1.0, 1.0, 1.0)
    return describe_cloud(thin, Material(name, base_color=plain, roughness=0.6, double_sided=True), notes)


def _split_statements(text: str, where: str) -> _Statements:
    """Sort the lines by keyword. The only pass over the file in Python, so it does as little as it can."""
    statements = _Statements()
    numeric = {
        keyword: (lines.bodies.append, lines.numbers.append)
        for keyword, lines in (
            ("v", statements.positions),
            ("vt", statements.uvs),
            ("vn", statements.normals),
            ("f", statements.faces),
            ("p", statements.points),
            ("l", statements.lines),
        )
    }
    material_index = {"": 0}
    for number, line in _logical_lines(text, where) if "\\" in text else enumerate(text.split("\n"), 1):
        parts = line.split(None, 1)
        if not parts:
            continue
        key, body = parts[0], parts[1] if len(parts) > 1 else ""
        if key in numeric:
            if "#" in body:
                body = body.split("#", 1)[0]
            if "-" in body and key in "fpl":
                counts = (len(statements.positions.bodies), len(statements.uvs.bodies), len(statements.normals.bodies))
                body = _absolute(body, counts, f"{where}:{number}")
            add_body, add_number = numeric[key]
            add_body(body)
            add_number(number)
        elif key == "usemtl":
            name = body.strip()
            index = material_index.setdefault(name, len(material_index))
            if index == len(statements.materials):
                statements.materials.append(name)
            statements.material_runs.append((len(statements.faces.bodies), index))
            statements.point_material_runs.append((len(statements.points.bodies), index))
            statements.line_material_runs.append((len(statements.lines.bodies), index))
        elif key == "s":
            statements.smoothing_runs.append((len(statements.faces.bodies), _smoothing_group(body)))
        elif key == "mtllib":
            statements.libraries.add(body.strip(), number)
        elif key == "#MRGB":
            statements.painted.append(body)
        elif key[0] != "#" and key not in _SILENT:
            what = _UNSUPPORTED.get(key, f"statements '{key[:40]}'")
            statements.ignored[what] = statements.ignored.get(what, 0) + 1
    return statements


def _logical_lines(text: str, where: str) -> Iterator[tuple[int, str]]:
    """Lines with the number they begin on; one that ends in a backslash goes on with the next."""
    continued, start = "", 0
    number = 0
    for number, line in enumerate(text.split("\n"), 1):
        start = start or number
        if line.endswith(("\\", "\\\r")):
            continued += line.rstrip("\r")[:-1] + " "
            continue
        yield start, continued + line
        continued, start = "", 0
    if continued:
        raise SceneError("the file ends in a continued line", where=f"{where}:{number}", fix="is it cut short?")


def _smoothing_group(body: str) -> int:
    """0 (off) or the group's number; odd values such as "on" count as a group."""
    word = body.strip().lower()
    if word in ("off", "", "0"):
        return 0
    return int(word) if word.isdecimal() and len(word) <= _LONGEST_NUMBER else 1


def _absolute(body: str, counts: tuple[int, int, int], where: str) -> str:
    """A face's corners with its negative (counted from here backwards) indices made positive."""
    corners = []
    for corner in body.split():
        words = corner.split("/")
        try:
            places = [int(word) if word else 0 for word in words]
        except ValueError:
            return body  # told apart, with the line, where all corners are read
        for slot, place in enumerate(places[:3]):
            if place < 0:
                places[slot] = counts[slot] + 1 + place
                if places[slot] < 1:
                    raise SceneError(
                        f"index {place} counts back beyond the first of {counts[slot]} entries",
                        where=where,
                        rule="a negative index counts back from the last entry before it",
                    )
        corners.append("/".join(str(place) if word else "" for place, word in zip(places, words, strict=True)))
    return " ".join(corners)


def _per_face(runs: Sequence[tuple[int, int]], count: int) -> Integers:
    """Value of each face, from runs ``(first face, value)``."""
    first = np.array([start for start, _ in runs] + [count])
    return np.repeat(np.array([value for _, value in runs], np.int64), np.diff(first))


def _assemble(statements: _Statements, where: str) -> tuple[_Geometry, list[str]]:
    positions = read_table(statements.positions, "vertex", 3, where, colored=True)
    # "v x y z r g b" is a vertex colour, "v x y z w" a rational weight, which faces do not use.
    colors = positions[:, 3:6] if positions.shape[1] in (6, 7) else None
    uvs = read_table(statements.uvs, "texture coordinate", 1, where)[:, :2]
    if uvs.shape[1] == 1:
        uvs = np.concatenate([uvs, np.zeros_like(uvs)], axis=1)
    normals = read_table(statements.normals, "normal", 3, where)[:, :3]
    corners, sizes = read_corners(statements.faces, where)
    numbers = np.repeat(np.array(statements.faces.numbers, np.int64), sizes)
    counts = (len(positions), len(uvs), len(normals))
    notes = drop_absent(corners, counts)
    check_vertices(corners, counts[0], numbers, where)
    positions = near_origin(positions[:, :3], notes)
    if statements.painted:
        colors = _painted_colors("".join(statements.painted), len(positions), notes)
    triangles, owners = triangulate(positions, corners[:, 0] - 1, sizes)
    cut = corners[triangles] - 1
    geometry = _Geometry(
        positions,
        colors,
        uvs,
        normals,
        cut[..., 0],
        cut[..., 1],
        cut[..., 2],
        _per_face(statements.material_runs, len(sizes))[owners],
    )
    _complete_normals(geometry, _per_face(statements.smoothing_runs, len(sizes))[owners])
    return geometry, notes


def _painted_colors(text: str, count: int, notes: list[str]) -> Points | None:
    """Codes ``(count, 3)`` of ZBrush's comments, eight hexadecimal digits a vertex: mask, red, green, blue."""
    try:
        codes = np.frombuffer(bytes.fromhex(text), np.uint8).reshape(-1, 4)
    except ValueError:
        codes = np.empty((0, 4), np.uint8)
    if len(codes) != count:
        notes.append(f"colours of #MRGB are not shown: {len(codes)} of 8 digits for {count} vertices")
        return None
    return codes[:, 1:] / 255.0


def _draw_points_and_lines(statements: _Statements, geometry: _Geometry, where: str) -> tuple[list[Mesh], list[str]]:
    points = _per_face(statements.point_material_runs, len(statements.points.bodies))
    lines = _per_face(statements.line_material_runs, len(statements.lines.bodies))
    pairs = ((statements.points, points), (statements.lines, lines))
    return draw_points_and_lines(pairs, geometry.positions, _linear_colors(geometry), where)


def _linear_colors(geometry: _Geometry) -> Points | None:
    """Colours of all vertices, from sRGB codes."""
    return None if geometry.colors is None else decode_srgb(np.clip(geometry.colors, 0.0, 1.0))


def _complete_normals(geometry: _Geometry, smoothing: Integers) -> None:
    """Unit normals, and those that smoothing groups ask for: the mean around each vertex, weighted by angle.

    Weights by angle (Thuermer and Wuethrich 1998) do not depend on how polygons were cut into triangles. A corner
    without a normal and outside any group stays flat (-1).
    """
    lengths = np.linalg.norm(geometry.normals, axis=1)
    usable = lengths > 1e-12
    normals = geometry.normals / np.where(usable, lengths, 1.0)[:, None]
    given = geometry.normal_of
    normal_of = np.where((given >= 0) & np.append(usable, False)[given], given, -1)
    smooth = (normal_of < 0) & (smoothing > 0)[:, None]
    if smooth.any():
        rows, corners = np.nonzero(smooth)
        weighted = _weighted_normals(geometry.positions, geometry.position_of[rows], corners)
        key = geometry.position_of[smooth] * (int(smoothing.max()) + 1) + smoothing[rows]
        _, group = np.unique(key, return_inverse=True)
        sums = np.stack([np.bincount(group, weighted[:, axis]) for axis in range(3)], axis=-1)
        length = np.linalg.norm(sums, axis=1)
        normal_of[smooth] = np.where(length > 0.0, len(normals) + np.arange(len(sums)), -1)[group]
        normals = np.concatenate([normals, sums / np.where(length > 0.0, length, 1.0)[:, None]])
    geometry.normals, geometry.normal_of = normals, normal_of


def _weighted_normals(positions: Points, triangles: Integers, corners: Integers) -> Points:
    """Unit normals ``(n, 3)`` of triangles times their angle at one corner, 0 to 2, each."""
    rows = np.arange(len(triangles))
    here, ahead, behind = (positions[triangles[rows, (corners + step) % 3]] for step in range(3))
    a, b = ahead - here, behind - here
    cross = np.cross(a, b)
    length = np.linalg.norm(cross, axis=1)
    angle = np.arctan2(length, np.einsum("ni,ni->n", a, b))
    return np.asarray(cross * np.divide(angle, length, out=np.zeros_like(length), where=length > 0.0)[:, None])


def _face_normals(positions: Points, triangles: Integers) -> Points:
    """Unit normals ``(m, 3)`` of triangles; +z for those without area."""
    a, b, c = (positions[triangles[:, corner]] for corner in range(3))
    cross = np.cross(b - a, c - a)
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    return np.asarray(np.where(length > 0.0, cross / np.where(length > 0.0, length, 1.0), (0.0, 0.0, 1.0)))


def _mesh(geometry: _Geometry, rows: Integers, name: str, material: int) -> Mesh:
    """The triangles ``rows`` with one vertex for each different (position, uv, normal)."""
    position, uv, normal = (table[rows].ravel() for table in (geometry.position_of, geometry.uv_of, geometry.normal_of))
    normals = geometry.normals
    if (normal >= 0).any() and (normal < 0).any():
        flat = _face_normals(geometry.positions, geometry.position_of[rows])
        normal = np.where(normal < 0, len(normals) + np.repeat(np.arange(len(rows)), 3), normal)
        normals = np.concatenate([normals, flat])
    # Two steps keep the key within 64 bits however large the tables are.
    _, pair = np.unique(position * (len(geometry.uvs) + 1) + uv + 1, return_inverse=True)
    _, first, vertex = np.unique(pair * (len(normals) + 1) + normal + 1, return_index=True, return_inverse=True)
    position, uv, normal = position[first], uv[first], normal[first]
    uvs: tuple[NDArray[np.float32], ...] = ()
    if (uv >= 0).any():
        known = np.append(geometry.uvs, [[0.0, 0.0]], axis=0)[uv]
        known[:, 1] = 1.0 - known[:, 1]  # OBJ counts v upwards from the bottom row
        uvs = (known.astype(np.float32),)
    colors = None
    if geometry.colors is not None:
        colors = decode_srgb(np.clip(geometry.colors[position], 0.0, 1.0)).astype(np.float32)
    return Mesh(
        name=name,
        positions=geometry.positions[position].astype(np.float32),
        faces=vertex.reshape(-1, 3).astype(np.uint32),
        material=material,
        normals=normals[normal].astype(np.float32) if (normal >= 0).all() else None,
        uvs=uvs,
        colors=colors,
    )


def _read_libraries(libraries: Lines, file: str, named: NamedFiles) -> tuple[dict[str, MtlRecord], list[str]]:
    """All materials of all libraries, the first of each name, and notes on the libraries that are not there."""
    records: dict[str, MtlRecord] = {}
    notes: list[str] = []
    looked_for = 0
    bodies: set[str] = set()
    for body, number in zip(libraries.bodies, libraries.numbers, strict=True):
        if not body or body in bodies:
            continue
        bodies.add(body)
        where = f"{file}:{number}"
        # One name with spaces, or several names: only the folder can tell.
        names = names_on_line(body)
        whole = next((name for name in names if is_file(named.folder / name)), None)
        for word in [whole] if whole else re.split(r"(?<!\\)\s+", names[1]):
            name = word if whole else word.replace("\\ ", " ")
            looked_for += 1
            if looked_for > _MOST_LIBRARIES:
                rule = f"at most {_MOST_LIBRARIES} are looked for"
                raise SceneError("names too many material libraries", where=where, rule=rule, fix="join them")
            try:
                library = named.find(name, where=where, what="material library")
            except MissingFileError as error:
                notes.append(error.note("its materials are plain grey"))
                continue
            for key, record in parse_mtl(library).items():
                records.setdefault(key, record)
    return records, notes
