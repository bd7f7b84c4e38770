"""Meshes and their placements as Mitsuba shapes: few and large ones, because each costs time at every frame.

Meshes of one finish are merged into one shape in world space. A mesh that is placed often is kept once and instanced,
where that saves memory worth the cost of its instances.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.device.pbr.emitters import glow
from lippmann.device.pbr.material_groups import Variant
from lippmann.device.pbr.materials import Finish
from lippmann.device.pbr.texture_lookup import ALPHA_ATTRIBUTE, COLOR_ATTRIBUTE, MEMBER_ATTRIBUTE, uv_attribute
from lippmann.scene.values.description import FloatArray, IndexArray, Matrix, Mesh

#: A mesh is instanced if its copies would add this many triangles, and each copy this many.
MIN_SAVED_TRIANGLES = 8192
MIN_INSTANCE_TRIANGLES = 256


@dataclass(frozen=True, eq=False)
class Dress:
    """A mesh with the finish that it wears."""

    mesh: Mesh
    variant: Variant
    finish: Finish


@dataclass(frozen=True, eq=False)
class Piece:
    """One dressed mesh at one place."""

    dress: Dress
    world_from_mesh: Matrix


def has_volume(matrix: Matrix) -> bool:
    """Whether a placement keeps volume: a flat or singular one shows nothing."""
    return bool(np.all(np.isfinite(matrix))) and abs(float(np.linalg.det(matrix[:3, :3]))) > 0


def make_shapes(placements: Sequence[tuple[Dress, Sequence[Matrix]]]) -> tuple[list[Any], list[Finish | None]]:
    """Mitsuba shapes of all meshes, groups among them; and of each its finish, None for instances and groups."""
    pieces: list[Piece] = []
    repeated: dict[tuple[bytes, ...], list[tuple[Dress, Sequence[Matrix]]]] = {}
    for dress, matrices in placements:
        if _is_instanced(dress, len(matrices)):
            key = tuple(np.ascontiguousarray(matrix, dtype=np.float64).tobytes() for matrix in matrices)
            repeated.setdefault(key, []).append((dress, matrices))
        else:
            pieces.extend(Piece(dress, matrix) for matrix in matrices)
    shapes: list[Any] = []
    finishes: list[Finish | None] = []
    for shape, finish in _merged(pieces):
        shapes.append(shape)
        finishes.append(finish)
    for group in repeated.values():
        instances = _instances([dress for dress, _ in group], group[0][1])
        shapes.extend(instances)
        finishes.extend([None] * len(instances))
    return shapes, finishes


def _is_instanced(dress: Dress, copies: int) -> bool:
    # Mitsuba's instances cannot glow, and absorption is looked up by shapes of the scene itself.
    if dress.finish.emission is not None or dress.finish.absorption is not None:
        return False
    triangles = len(dress.mesh.faces)
    return triangles >= MIN_INSTANCE_TRIANGLES and triangles * (copies - 1) >= MIN_SAVED_TRIANGLES


def _instances(dresses: Sequence[Dress], matrices: Sequence[Matrix]) -> list[Any]:
    import mitsuba as mi

    local = [Piece(dress, np.eye(4)) for dress in dresses]
    group = {f"shape{number}": shape for number, (shape, _) in enumerate(_merged(local))}
    shapegroup = mi.load_dict({"type": "shapegroup", **group})
    places = [mi.ScalarTransform4f(np.asarray(matrix).tolist()) for matrix in matrices]
    # The scene has to hold the group, too: it is what the acceleration structure is made of.
    return [
        shapegroup,
        *(mi.load_dict({"type": "instance", "shapegroup": shapegroup, "to_world": place}) for place in places),
    ]


def _merged(pieces: Iterable[Piece]) -> list[tuple[Any, Finish]]:
    """One shape per finish and kind of normals."""
    groups: dict[tuple[int, bool], list[Piece]] = {}
    for piece in pieces:
        key = (id(piece.dress.finish), piece.dress.mesh.normals is not None)
        groups.setdefault(key, []).append(piece)
    return [(_mesh_shape(group), group[0].dress.finish) for group in groups.values()]


def _mesh_shape(pieces: Sequence[Piece]) -> Any:
    """One Mitsuba mesh of pieces that share a finish."""
    import mitsuba as mi

    finish = pieces[0].dress.finish
    smooth = pieces[0].dress.mesh.normals is not None
    props = mi.Properties()
    props["bsdf"] = finish.bsdf
    if finish.emission is not None and any(_has_area(piece) for piece in pieces):  # Mitsuba draws points on it
        props["emitter"] = glow(finish.emission)
    starts = np.cumsum([0, *(len(piece.dress.mesh.positions) for piece in pieces)])
    faces = np.concatenate(
        [_placed_faces(piece) + np.uint32(start) for piece, start in zip(pieces, starts, strict=False)]
    )
    textured = bool(finish.uv_sets)
    name = pieces[0].dress.mesh.name
    mesh: Any = mi.Mesh(
        name, int(starts[-1]), len(faces), props, has_vertex_normals=smooth, has_vertex_texcoords=textured
    )
    params = mi.traverse(mesh)
    params["vertex_positions"] = _device([_placed_positions(piece) for piece in pieces])
    params["faces"] = mi.UInt32(faces.ravel())
    if smooth:
        params["vertex_normals"] = _device([_placed_normals(piece) for piece in pieces])
    if textured:
        params["vertex_texcoords"] = _device([_uv(piece, finish.uv_sets[0]) for piece in pieces])
    params.update()
    for name, columns in _attributes(pieces, finish).items():
        mesh.add_attribute(name, columns.shape[1], mi.Float(columns.astype(np.float32).ravel()))
    return mesh


def _device(parts: Sequence[NDArray[Any]]) -> Any:
    import mitsuba as mi

    return mi.Float(np.concatenate(parts).astype(np.float32, copy=False).ravel())


def _attributes(pieces: Sequence[Piece], finish: Finish) -> Mapping[str, NDArray[Any]]:
    """What finish and meshes say per vertex or face beyond position, normal and the first uv set."""
    meshes = [piece.dress.mesh for piece in pieces]
    attributes: dict[str, NDArray[Any]] = {}
    if finish.tinted:
        attributes[COLOR_ATTRIBUTE] = np.concatenate([_colors(mesh)[:, :3] for mesh in meshes])
    if finish.faded:
        attributes[ALPHA_ATTRIBUTE] = np.concatenate([_colors(mesh)[:, 3:] for mesh in meshes])
    for number in finish.uv_sets[1:]:
        uv = np.concatenate([_uv(piece, number) for piece in pieces])
        attributes[uv_attribute(number)] = np.column_stack([uv, np.zeros(len(uv))])
    if len(finish.members) > 1:
        members = [finish.members[piece.dress.variant] for piece in pieces]
        attributes[MEMBER_ATTRIBUTE] = np.repeat(members, [len(mesh.faces) for mesh in meshes])[:, None]
    return attributes


def _colors(mesh: Mesh) -> FloatArray:
    assert mesh.colors is not None
    return mesh.colors


def _uv(piece: Piece, number: int) -> FloatArray:
    """A uv set; zeros where the mesh lacks it."""
    mesh = piece.dress.mesh
    return mesh.uvs[number] if number < len(mesh.uvs) else np.zeros((len(mesh.positions), 2), dtype=np.float32)


def _placed_positions(piece: Piece) -> FloatArray:
    matrix = piece.world_from_mesh
    if np.array_equal(matrix, np.eye(4)):
        return piece.dress.mesh.positions
    return np.asarray(piece.dress.mesh.positions @ matrix[:3, :3].T + matrix[:3, 3], dtype=np.float32)


def _placed_faces(piece: Piece) -> IndexArray:
    """A mirroring placement would turn the mesh inside out: its triangles are wound the other way."""
    faces = piece.dress.mesh.faces.astype(np.uint32, copy=False)
    return faces[:, ::-1] if np.linalg.det(piece.world_from_mesh[:3, :3]) < 0 else faces


def _has_area(piece: Piece) -> bool:
    corners = _placed_positions(piece)[piece.dress.mesh.faces]
    return bool(np.any(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])))


def _placed_normals(piece: Piece) -> FloatArray:
    """Unit normals in world space; where a file has none of length, the mean of the faces around."""
    mesh = piece.dress.mesh
    assert mesh.normals is not None
    normals = np.asarray(mesh.normals, dtype=np.float64) @ np.linalg.inv(piece.world_from_mesh[:3, :3])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    lost = ~(np.isfinite(lengths) & (lengths > 0))[:, 0]
    if lost.any():
        normals[lost] = _face_normals(_placed_positions(piece), _placed_faces(piece))[lost]
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / lengths, dtype=np.float32)


def _face_normals(positions: FloatArray, faces: IndexArray) -> NDArray[np.float64]:
    """Area-weighted normal per vertex; +z where a vertex has no face of area."""
    corners = positions[faces].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.zeros((len(positions), 3))
    for corner in range(3):
        np.add.at(sums, faces[:, corner], cross)
    sums[np.linalg.norm(sums, axis=1) == 0] = (0, 0, 1)
    return sums
