"""Stanford polygon files (``.ply``), text and binary.

Read from Greg Turk's description of the format (1994). The reader is Lippmann's own because trimesh's refuses binary
files that mix triangles and larger polygons, which is what modelling programs write.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import decode_srgb
from lippmann.errors import SceneError
from lippmann.scene.parsing.far_origin import near_origin
from lippmann.scene.parsing.files import MissingFileError, NamedFiles, is_file, read_bytes, read_image
from lippmann.scene.parsing.normals import unit_normals
from lippmann.scene.parsing.ply_body import Columns, Integers, Lists, Numbers, read_body
from lippmann.scene.parsing.ply_header import Element, Header, read_header
from lippmann.scene.parsing.triangulation import triangulate
from lippmann.scene.parsing.vertex_colors import full_brightness, without_doubled_colors
from lippmann.scene.point_clouds import describe_cloud
from lippmann.scene.readers.splats.ply import holds_splats, read_splat_ply
from lippmann.scene.values.description import (
    AlphaMode,
    FloatArray,
    IndexArray,
    Instance,
    Material,
    Mesh,
    SceneDescription,
    Texture,
)

_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
_COLOR_NAMES = (
    ("red", "green", "blue", "alpha"),
    ("diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"),
    ("r", "g", "b", "a"),
)
#: Properties of vertices that are shown.
_KNOWN = {"x", "y", "z", "nx", "ny", "nz"}.union(*_UV_NAMES, *_COLOR_NAMES)

#: Elements that are shown; those of Artec's programs have the texture coordinates of corners, and their textures.
_UV_VERTICES, _UV_FACES = "multi_texture_vertex", "multi_texture_face"
_ELEMENTS = ("vertex", "face", "tristrips", _UV_VERTICES, _UV_FACES)
#: Endings of the pictures that these programs write beside a file that names none.
_BESIDE = (".png", ".jpg", ".jpeg", ".bmp")

#: More vertices than any file has.
_MOST_VERTICES = 1 << 53


def read_ply(path: Path, *, files: NamedFiles | None = None) -> SceneDescription:
    """Read a PLY mesh with its vertex normals, colours and texture coordinates, a cloud of points, or Gaussian splats.

    Colours are taken as sRGB-coded. Without normals the facets are flat. Points become balls, unshaded where they
    have colours.

    Raises
    ------
    SceneError
        The file is missing, foreign, cut short, or holds no vertices; its texture is not found.
    """
    where = path.name
    data = read_bytes(path)
    header = read_header(data, where)
    if holds_splats(header):
        return read_splat_ply(data, header, path.stem, where)
    return describe_polygons(header, read_body(data, header, where), path, files)


def describe_polygons(
    header: Header, columns: Mapping[str, Columns], path: Path, files: NamedFiles | None = None
) -> SceneDescription:
    """The mesh or the cloud of points of elements ``vertex`` and ``face`` as :func:`read_body` returns them.

    Raises
    ------
    SceneError
        There are no vertices, or a face names one that is not there.
    """
    where = path.name
    if not all(isinstance(columns.get("vertex", {}).get(axis), np.ndarray) for axis in "xyz"):
        raise SceneError("holds no vertices with x, y and z", where=where)
    notes = [*header.notes]
    elements = {element.name: element for element in header.elements}
    unread = sorted({each.name for each in elements["vertex"].properties} - _KNOWN)
    if unread:
        notes.append(f"of vertices not shown: {', '.join(name[:40] for name in unread[:20])}")
    if _UV_FACES in columns:
        columns = _with_corner_uvs(columns)
    outline = _outline(columns, where)
    read = _ELEMENTS if len(outline.sizes) else (*_ELEMENTS, "edge")
    stepped_over = [each.name[:40] for each in header.elements if each.count and each.name not in read]
    if stepped_over:
        notes.append(f"elements not shown: {', '.join(stepped_over[:20])}")
    if not len(outline.sizes):
        return replace(_cloud(columns, elements, path.stem, notes, where), up=header.up)
    mesh, owners = _mesh(columns, elements, outline, path.stem, notes, where)
    if "face" in elements and all(_color_names(elements[name]) for name in ("vertex", "face")):
        notes.append("colours of faces are not shown: vertices have their own")
    textures: list[Texture | None] = []
    for name in header.textures or (_beside(path) if _UV_FACES in columns else []):
        try:
            image = read_image(NamedFiles.of(path, files).find(name, where=where, what="texture"), where=where)
        except MissingFileError as error:
            notes.append(error.note("shown without it"))
            textures.append(None)
        else:
            textures.append(Texture(image, srgb=True))
    if textures and not mesh.uvs:
        notes.append("the texture is not used: the file gives no texture coordinates")
        textures = []
    numbers = columns["face"].get("texnumber") if "face" in columns else None
    meshes = [mesh]
    if len(textures) > 1 and isinstance(numbers, np.ndarray):
        textures.append(None)  # of faces whose number is that of no texture
        chosen = np.where((numbers >= 0) & (numbers < len(textures)), numbers, -1).astype(int)[owners] % len(textures)
        meshes = [replace(mesh, faces=mesh.faces[chosen == number], material=number) for number in range(len(textures))]
    elif len(textures) > 1:
        notes.append(f"only the first of {len(textures)} textures is used: no face says its texnumber")
    materials = [_material(path.stem, texture, mesh) for texture in textures or [None]]
    meshes = [without_doubled_colors(each, materials[each.material], notes) for each in meshes]
    instances = [Instance(number, np.eye(4)) for number, mesh in enumerate(meshes) if len(mesh.faces)]
    return SceneDescription(path.stem, meshes, materials, instances, notes=notes, up=header.up)


def _with_corner_uvs(columns: Mapping[str, Columns]) -> Mapping[str, Columns]:
    """Artec's texture coordinates, and numbers of textures, as those of the faces, which ``tn`` names."""
    face, own, vertices = (columns.get(name, {}) for name in ("face", _UV_FACES, _UV_VERTICES))
    outline = next((face[name] for name in ("vertex_indices", "vertex_index") if name in face), None)
    indices, u, v = own.get("texture_vertex_indices"), vertices.get("u"), vertices.get("v")
    if not isinstance(indices, Lists) or not isinstance(outline, Lists) or len(indices.sizes) != len(outline.sizes):
        return columns
    if not isinstance(u, np.ndarray) or not isinstance(v, np.ndarray):
        return columns
    entry_of_face = np.argsort(np.asarray(own.get("tn", np.arange(len(indices.sizes)))), kind="stable")
    starts = (np.cumsum(indices.sizes) - indices.sizes)[entry_of_face]
    sizes = indices.sizes[entry_of_face]
    if not np.array_equal(sizes, outline.sizes):
        return columns
    within = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    places = indices.values[np.repeat(starts, sizes) + within].astype(np.int64)
    if not ((places >= 0) & (places < len(u))).all():
        return columns
    more: dict[str, Numbers | Lists] = {"texcoord": Lists(np.stack([u[places], v[places]], axis=1).ravel(), 2 * sizes)}
    if isinstance(numbers := own.get("tx"), np.ndarray):
        more["texnumber"] = numbers[entry_of_face]
    return {**columns, "face": {**more, **face}}


def _beside(path: Path) -> list[str]:
    """Pictures called as the file, and counted from 0: ``scan_0.jpg``."""
    names: list[str] = []
    while True:
        nearest = [f"{path.stem}_{len(names)}{ending}" for ending in _BESIDE]
        present = [name for name in nearest if is_file(path.parent / name)]
        if not present:
            return names
        names.append(present[0])


def _material(name: str, texture: Texture | None, mesh: Mesh) -> Material:
    plain = (1.0, 1.0, 1.0) if texture is not None or mesh.colors is not None else (0.7, 0.7, 0.7)
    mode: AlphaMode = "blend" if mesh.colors is not None and mesh.colors.shape[1] == 4 else "opaque"
    return Material(
        name, base_color=plain, base_color_texture=texture, roughness=0.6, alpha_mode=mode, double_sided=True
    )


def _cloud(
    columns: Mapping[str, Columns], elements: Mapping[str, Element], name: str, notes: list[str], where: str
) -> SceneDescription:
    """Edges as rods, without any points as balls."""
    vertex = columns["vertex"]
    positions = np.stack([np.asarray(vertex[axis]) for axis in "xyz"], axis=-1)
    if not len(positions):
        raise SceneError("holds no vertices", where=where)
    colors = _colors(vertex, elements["vertex"])
    ends = _ends(columns.get("edge", {}), len(positions), where)
    if ends is not None:
        of_edges = _colors(columns["edge"], elements["edge"]) if colors is None else None
        positions, colors = positions[ends.ravel()], None if colors is None else colors[ends.ravel()]
        colors = colors if of_edges is None else np.repeat(of_edges, 2, axis=0)
        whole = np.repeat(_is_finite(positions).reshape(-1, 2).all(axis=1), 2)
        positions, colors = positions[whole], None if colors is None else colors[whole]
    finite = _is_finite(positions)
    if finite.any() and not finite.all():  # places of depth cameras' pictures that nothing was measured at
        notes.append(f"{np.count_nonzero(~finite)} points without finite coordinates are left out")
        positions, colors = positions[finite], None if colors is None else colors[finite]
    _check_finite(positions, where)
    positions = near_origin(positions, notes)
    places = np.arange(len(positions), dtype=np.uint32).reshape(-1, 1 if ends is None else 2)
    thin = Mesh(name, positions.astype(np.float32), places, 0, None, (), colors)
    return describe_cloud(thin, _material(name, None, thin), notes)


def _ends(edge: Columns, count: int, where: str) -> NDArray[np.int64] | None:
    """The two vertices ``(m, 2)`` of each edge; None without edges."""
    pair = [edge.get(name) for name in ("vertex1", "vertex2")]
    if not all(isinstance(each, np.ndarray) and len(each) for each in pair):
        return None
    ends = np.stack([np.asarray(each) for each in pair], axis=1)
    if not ((ends >= 0) & (ends < count)).all():
        raise SceneError("an edge uses a vertex that is not there", where=where, rule=f"the file has 0 to {count - 1}")
    return ends.astype(np.int64)


def _is_finite(positions: Numbers) -> NDArray[np.bool_]:
    with np.errstate(over="ignore", invalid="ignore"):  # a number too large for a float is an infinite one
        return np.asarray(np.isfinite(positions.astype(np.float32)).all(axis=1))


def _check_finite(positions: Numbers, where: str) -> None:
    finite = _is_finite(positions)
    if not finite.all():
        bad = int(np.argmin(finite))
        raise SceneError(
            f"vertex {bad} is {positions[bad].tolist()}", where=where, rule="coordinates must be finite numbers"
        )


def _outline(columns: Mapping[str, Columns], where: str) -> Lists:
    for name in ("vertex_indices", "vertex_index"):
        outline = columns.get("face", {}).get(name)
        if isinstance(outline, Lists):
            return outline
        strips = columns.get("tristrips", {}).get(name)
        if isinstance(strips, Lists):
            return _triangles_of_strips(strips)
    return Lists(np.zeros(0), np.zeros(0, np.int64))


def _triangles_of_strips(strips: Lists) -> Lists:
    """Triangles of strips; -1 begins a strip anew, and every second triangle turns the other way round."""
    values = strips.values
    order = np.arange(len(values))
    ends = values == -1
    starts = np.ones(len(values), bool)
    starts[1:] = ends[:-1]
    first = np.cumsum(strips.sizes) - strips.sizes
    starts[first[strips.sizes > 0]] = True
    begin = np.maximum.accumulate(np.where(starts, order, 0))
    # A triangle for each vertex that has two before it in its strip.
    last = np.flatnonzero(~ends & (order - begin >= 2))
    odd = (last - begin[last]) % 2 == 1
    corners = np.stack([values[last - 2], values[last - 1], values[last]], axis=1)
    corners[odd] = corners[odd][:, [1, 0, 2]]
    proper = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    return Lists(corners[proper].ravel(), np.full(int(proper.sum()), 3, np.int64))


@np.errstate(over="ignore")  # of normals and coordinates of textures
def _mesh(
    columns: Mapping[str, Columns],
    elements: Mapping[str, Element],
    outline: Lists,
    name: str,
    notes: list[str],
    where: str,
) -> tuple[Mesh, Integers]:
    """The triangles, and of each the number of its face."""
    vertex = {key: column for key, column in columns["vertex"].items() if isinstance(column, np.ndarray)}
    positions = np.stack([vertex[axis] for axis in "xyz"], axis=-1)
    keep = outline.sizes >= 3
    numbers = outline.values[np.repeat(keep, outline.sizes)]
    if not (np.abs(numbers) < _MOST_VERTICES).all():
        raise SceneError("a face uses a vertex whose number is none", where=where, rule="vertices are counted from 0")
    corners = numbers.astype(np.int64)
    if len(corners) == 0:
        raise SceneError("holds no faces with three corners", where=where)
    if corners.min() < 0 or corners.max() >= len(positions):
        bad = corners.min() if corners.min() < 0 else corners.max()
        raise SceneError(f"a face uses vertex {bad}", where=where, rule=f"the file has 0 to {len(positions) - 1}")
    finite = _is_finite(positions)
    if not finite.all():  # places that a depth camera did not measure
        whole = np.ones(np.count_nonzero(keep), bool)
        whole[np.repeat(np.arange(len(whole)), outline.sizes[keep])[~finite[corners]]] = False
        if not whole.any():
            _check_finite(positions, where)
        if not whole.all():
            notes.append(f"{np.count_nonzero(~whole)} faces without finite coordinates are left out")
        corners = corners[np.repeat(whole, outline.sizes[keep])]
        keep[keep] = whole
        positions = np.where(finite[:, None], positions, positions[np.argmax(finite)])
    positions = near_origin(positions, notes)
    places, owners = triangulate(positions, corners, outline.sizes[keep])
    faces = corners[places]
    normals = _stack(vertex, ("nx", "ny", "nz"))
    uvs = next((pair for names in _UV_NAMES if (pair := _stack(vertex, names)) is not None), None)
    colors = _colors(columns["vertex"], elements["vertex"])
    face = columns.get("face", {})
    per_corner = _corner_uvs(face, outline, keep)
    face_colors = _colors(face, elements["face"]) if face else None
    if per_corner is not None or (face_colors is not None and colors is None):
        # Values of corners or faces need vertices that no other face shares.
        flat = faces.ravel()
        positions, normals = positions[flat], None if normals is None else normals[flat]
        colors = None if colors is None else colors[flat]
        uvs = per_corner[places.ravel()] if per_corner is not None else None if uvs is None else uvs[flat]
        if face_colors is not None and colors is None:
            colors = np.repeat(face_colors[keep][owners], 3, axis=0)
        faces = np.arange(len(flat)).reshape(-1, 3)
    points, triangles = positions.astype(np.float32), faces.astype(np.uint32)
    mesh = Mesh(
        name=name,
        positions=points,
        faces=triangles,
        material=0,
        normals=_unit(normals, points, triangles),
        uvs=() if uvs is None else ((uvs * (1.0, -1.0) + (0.0, 1.0)).astype(np.float32),),  # v runs upwards in PLY
        colors=colors,
    )
    return mesh, np.flatnonzero(keep)[owners]


def _stack(columns: Mapping[str, Numbers], names: tuple[str, ...]) -> Numbers | None:
    return np.stack([columns[name] for name in names], axis=-1) if columns.keys() >= set(names) else None


def _corner_uvs(face: Columns, outline: Lists, keep: NDArray[np.bool_]) -> Numbers | None:
    """uvs ``(corners, 2)`` of the faces in ``keep``, where the file gives one pair per corner."""
    texcoords = face.get("texcoord")
    if not isinstance(texcoords, Lists) or not (texcoords.sizes == 2 * outline.sizes).all():
        return None
    return texcoords.values.reshape(-1, 2)[np.repeat(keep, outline.sizes)]


def _colors(columns: Columns, element: Element) -> NDArray[np.float32] | None:
    """Linear RGB; RGBA where something is transparent. An alpha of 0 throughout says nothing.

    Whole numbers of more bits that are bytes all the same, as programs for laser scans write them, are read as bytes.
    """
    names = _color_names(element)
    if not names:
        return None
    brightest = {each.name: each.brightest for each in element.properties}
    codes = np.stack([np.asarray(columns[name]) for name in names], axis=-1)
    full = [brightest[name] for name in names]
    values = codes / (255.0 if min(full) > 255.0 and codes.max(initial=0) <= 255 else full)
    values = np.clip(np.nan_to_num(values) / full_brightness(values), 0.0, 1.0)
    alpha = values[:, 3:]
    if not (alpha.any() and (alpha < 1.0).any()):
        alpha = alpha[:, :0]
    return np.concatenate([decode_srgb(values[:, :3]), alpha], axis=1).astype(np.float32)


def _color_names(element: Element) -> list[str]:
    """The properties that are its colour, alpha last; none where it has no colour."""
    scalars = {each.name for each in element.properties if each.count_type is None}
    known = next((names for names in _COLOR_NAMES if scalars.issuperset(names[:3])), ())
    return [name for name in known if name in scalars]


def _unit(normals: Numbers | None, positions: FloatArray, faces: IndexArray) -> FloatArray | None:
    """Unit normals; None if none of them has a length, for then the facets are flat."""
    if normals is None or not (np.nan_to_num(normals) != 0.0).any():
        return None
    return unit_normals(normals.astype(np.float32), positions, faces)[0]
