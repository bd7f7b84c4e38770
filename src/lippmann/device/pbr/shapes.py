"""Meshes and their placements as Mitsuba shapes: few and large ones, because each costs time at every frame.

Meshes of one finish are merged into one shape in world space. A merged copy takes memory for its triangles; building
the acceleration structure over a million of them takes 0.7 s. An instance takes almost no memory but is a shape of its
own for Mitsuba: every kernel launch pays for all shapes, and more than proportionally. On two cores 20 instances cost
0.02 s a launch, 200 cost 1.4 s and 800 cost 18 s, and compiling the first kernel takes twice as long. Copies are
therefore merged, unless they are few and large or their merged triangles would not fit the memory.
"""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from lippmann.device.pbr.emitters import glow
from lippmann.device.pbr.materials import Finish, Variant
from lippmann.device.pbr.round_shapes import BYTES, can_wear, curves, ellipsoids, keeps_round
from lippmann.device.pbr.tangents import tangents_in_uv, with_own_corners
from lippmann.device.pbr.textures import (
    ALPHA_ATTRIBUTE,
    COLOR_ATTRIBUTE,
    MEMBER_ATTRIBUTE,
    TANGENT_ATTRIBUTE,
    uv_attribute,
)
from lippmann.device.types import Float, Shape
from lippmann.errors import SceneError
from lippmann.runtime.machine import amount_in_words
from lippmann.scene.parsing.normals import sum_face_normals
from lippmann.scene.values.description import FloatArray, IndexArray, Matrix, Mesh, Round

Number = TypeVar("Number", bound=np.generic)

#: Vertices that are transformed at a time, which bounds the memory of double-precision intermediates.
_VERTICES_AT_A_TIME = 1 << 20


@dataclass(frozen=True, eq=False)
class Dress:
    """A mesh with the finish that it wears."""

    mesh: Mesh
    variant: Variant
    finish: Finish


@dataclass(frozen=True, eq=False)
class Piece:
    """One dressed mesh at ``k`` places, ``world_from_mesh`` ``(k, 4, 4)``."""

    dress: Dress
    world_from_mesh: Matrix

    @property
    def vertices(self) -> int:
        """Vertices of all copies."""
        return len(self.world_from_mesh) * len(self.dress.mesh.positions)

    def per_copy(self, values: NDArray[Number]) -> NDArray[Number]:
        """Values of one mesh, once per copy."""
        return np.tile(values, (len(self.world_from_mesh), *[1] * (values.ndim - 1)))


#: Pieces that stand for round bodies, by body and finish.
RoundPieces = dict[tuple[Round, int], list[Piece]]


def has_volume(matrices: Matrix) -> NDArray[np.bool_]:
    """Whether placements ``(k, 4, 4)`` keep volume: a flat or singular one shows nothing."""
    finite = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    linear = np.where(finite[:, None, None], matrices[:, :3, :3], 0.0)
    return np.asarray(finite & (np.abs(np.linalg.det(linear)) > 0))


def make_shapes(
    placements: Sequence[tuple[Dress, Matrix]], memory: int, *, name: str = ""
) -> tuple[list[Shape], list[Finish | None]]:
    """Mitsuba shapes of all meshes, groups among them; and of each its finish, None for instances and groups.

    Parameters
    ----------
    placements:
        Each mesh with its places ``(k, 4, 4)``.
    memory:
        Bytes that the shapes may take.
    name:
        Name of the scene, for errors.

    Raises
    ------
    SceneError
        The shapes do not fit the memory.
    """
    round_pieces, placements = _choose_round(placements)
    memory -= _bytes_of_round(round_pieces, memory, name)
    round_shapes = _make_round(round_pieces)
    # Meshes that are always placed together, as the primitives of one glTF mesh are, share their instances.
    together: dict[tuple[bool, bytes], list[Piece]] = {}
    for dress, matrices in placements:
        if dress.finish.tangents:
            dress = replace(dress, mesh=with_own_corners(dress.mesh))
        key = _is_instantiable(dress), hashlib.sha256(np.ascontiguousarray(matrices).data).digest()
        together.setdefault(key, []).append(Piece(dress, matrices))
    groups = {number: _count_copies(pieces) for number, pieces in enumerate(together.values())}
    instanced = choose_instances(groups, memory, name=name)
    merged = [piece for number, pieces in enumerate(together.values()) if number not in instanced for piece in pieces]
    shapes: list[Shape] = [shape for shape, _ in round_shapes]
    finishes: list[Finish | None] = [finish for _, finish in round_shapes]
    for shape, finish in _merge(merged):
        shapes.append(shape)
        finishes.append(finish)
    for number, pieces in enumerate(together.values()):
        if number in instanced:
            instances = _instances([piece.dress for piece in pieces], pieces[0].world_from_mesh)
            shapes.extend(instances)
            finishes.extend([None] * len(instances))
    return shapes, finishes


def _choose_round(
    placements: Sequence[tuple[Dress, Matrix]],
) -> tuple[RoundPieces, list[tuple[Dress, Matrix]]]:
    """Pieces of round bodies that can be traced as such, by body and finish; and the placements that are left."""
    round_pieces: RoundPieces = {}
    left: list[tuple[Dress, Matrix]] = []
    for dress, matrices in placements:
        body = dress.mesh.stands_for
        fits = np.zeros(len(matrices), bool)
        if body is not None and can_wear(dress.mesh, dress.finish):
            fits = keeps_round(body, matrices)
        if body is not None and fits.any():
            # Of attributes a body has as many as a mesh of one vertex and one face.
            one = replace(dress.mesh, faces=dress.mesh.faces[:1], positions=dress.mesh.positions[:1])
            if one.colors is not None:
                one = replace(one, colors=one.colors[:1])
            piece = Piece(replace(dress, mesh=one), matrices[fits])
            round_pieces.setdefault((body, id(dress.finish)), []).append(piece)
        if not fits.all():
            left.append((dress, matrices[~fits]))
    return round_pieces, left


def _bytes_of_round(round_pieces: RoundPieces, memory: int, name: str) -> int:
    """Bytes that round bodies take; a :class:`SceneError` where that is more than ``memory``."""
    counts = {key: sum(len(piece.world_from_mesh) for piece in pieces) for key, pieces in round_pieces.items()}
    need, count = sum(BYTES[body] * each for (body, _), each in counts.items()), sum(counts.values())
    if need > memory:
        raise too_many(f"{count:,} balls and rods", count, need, memory, name)
    return need


def _make_round(round_pieces: RoundPieces) -> list[tuple[Shape, Finish]]:
    """A shape for each body and finish."""
    made: list[tuple[Shape, Finish]] = []
    for (body, _), pieces in round_pieces.items():
        finish = pieces[0].dress.finish
        bsdf, places = finish.bsdf, np.concatenate([piece.world_from_mesh for piece in pieces])
        shape = ellipsoids(places, bsdf, _attributes(pieces, finish)) if body == "ball" else curves(places, bsdf)
        made.append((shape, finish))
    return made


def _is_instantiable(dress: Dress) -> bool:
    # Mitsuba's instances cannot glow, and absorption is looked up by shapes of the scene itself.
    return dress.finish.emission is None and dress.finish.absorption is None


def _count_copies(pieces: Sequence[Piece]) -> CopiedMesh:
    meshes = [piece.dress.mesh for piece in pieces]
    return CopiedMesh(
        triangles=sum(len(mesh.faces) for mesh in meshes),
        vertices=sum(len(mesh.positions) for mesh in meshes),
        copies=len(pieces[0].world_from_mesh),
        instantiable=_is_instantiable(pieces[0].dress),
    )


def _instances(dresses: Sequence[Dress], matrices: Matrix) -> list[Shape]:
    import mitsuba as mi

    local = [Piece(dress, np.eye(4)[None]) for dress in dresses]
    group = {f"shape{number}": shape for number, (shape, _) in enumerate(_merge(local))}
    shapegroup = mi.load_dict({"type": "shapegroup", **group})
    places = [mi.ScalarTransform4f(np.asarray(matrix).tolist()) for matrix in matrices]
    # The scene has to hold the group, too: it is what the acceleration structure is made of.
    return [
        shapegroup,
        *(mi.load_dict({"type": "instance", "shapegroup": shapegroup, "to_world": place}) for place in places),
    ]


def _merge(pieces: Iterable[Piece]) -> list[tuple[Shape, Finish]]:
    """One shape per finish and kind of normals."""
    groups: dict[tuple[int, bool], list[Piece]] = {}
    for piece in pieces:
        key = (id(piece.dress.finish), piece.dress.mesh.normals is not None)
        groups.setdefault(key, []).append(piece)
    return [(_mesh_shape(group), group[0].dress.finish) for group in groups.values()]


def _mesh_shape(pieces: Sequence[Piece]) -> Shape:
    """One Mitsuba mesh of pieces that share a finish."""
    import mitsuba as mi

    finish = pieces[0].dress.finish
    smooth = pieces[0].dress.mesh.normals is not None
    props = mi.Properties()
    props["bsdf"] = finish.bsdf
    if finish.emission is not None and any(_has_area(piece) for piece in pieces):  # Mitsuba samples points on it
        props["emitter"] = glow(finish.emission)
    starts = np.cumsum([0, *(piece.vertices for piece in pieces)])
    faces = np.concatenate(
        [_placed_faces(piece) + np.uint32(start) for piece, start in zip(pieces, starts, strict=False)]
    )
    textured = bool(finish.uv_sets)
    name = pieces[0].dress.mesh.name
    # Made empty: a mesh of full size takes attributes as Python lists only, its parameters take arrays.
    mesh: Shape = mi.Mesh(name, 0, 0, props, has_vertex_normals=smooth, has_vertex_texcoords=textured)
    attributes = _attributes(pieces, finish)
    for attribute, columns in attributes.items():
        mesh.add_attribute(attribute, columns.shape[1], [])
    params = mi.traverse(mesh)
    params["vertex_positions"] = _device([_placed_positions(piece) for piece in pieces])
    params["faces"] = mi.UInt32(faces.ravel())
    if smooth:
        params["vertex_normals"] = _device([_placed_normals(piece) for piece in pieces])
    if textured:
        params["vertex_texcoords"] = _device([_uv(piece, finish.uv_sets[0]) for piece in pieces])
    for attribute, columns in attributes.items():
        params[attribute] = _device([columns])
    params.update()
    return mesh


def _device(parts: Sequence[FloatArray]) -> Float:
    from lippmann.device.kernel_ops import upload

    whole = parts[0] if len(parts) == 1 else np.concatenate(parts)
    return upload(whole.astype(np.float32, copy=False))


def _attributes(pieces: Sequence[Piece], finish: Finish) -> Mapping[str, FloatArray]:
    """Attributes per vertex or face beyond position, normal and the first uv set."""
    attributes: dict[str, FloatArray] = {}
    if finish.tinted:
        attributes[COLOR_ATTRIBUTE] = np.concatenate([_colors(piece)[:, :3] for piece in pieces])
    if finish.faded:
        attributes[ALPHA_ATTRIBUTE] = np.concatenate([_colors(piece)[:, 3:] for piece in pieces])
    if finish.tangents:
        own = [piece.per_copy(tangents_in_uv(piece.dress.mesh, finish.uv_sets[0])) for piece in pieces]
        attributes[TANGENT_ATTRIBUTE] = np.concatenate(own)
    for number in finish.uv_sets[1:]:
        uv = np.concatenate([_uv(piece, number) for piece in pieces])
        attributes[uv_attribute(number)] = np.column_stack([uv, np.zeros(len(uv), np.float32)])
    if len(finish.members) > 1:
        members = np.array([finish.members[piece.dress.variant] for piece in pieces], np.float32)
        attributes[MEMBER_ATTRIBUTE] = np.repeat(members, [_face_count(piece) for piece in pieces])[:, None]
    return attributes


def _face_count(piece: Piece) -> int:
    return len(piece.world_from_mesh) * len(piece.dress.mesh.faces)


def _colors(piece: Piece) -> FloatArray:
    assert piece.dress.mesh.colors is not None
    return piece.per_copy(piece.dress.mesh.colors)


def _uv(piece: Piece, number: int) -> FloatArray:
    """A uv set; zeros where the mesh lacks it."""
    mesh = piece.dress.mesh
    if number < len(mesh.uvs):
        return piece.per_copy(mesh.uvs[number])
    return np.zeros((piece.vertices, 2), dtype=np.float32)


def _placed_positions(piece: Piece) -> FloatArray:
    """Positions of all copies in the world, ``(k * n, 3)``."""
    matrices, positions = piece.world_from_mesh, piece.dress.mesh.positions
    if np.array_equal(matrices, np.eye(4)[None]):
        return positions
    placed = np.empty((len(matrices), len(positions), 3), np.float32)
    for part in _parts(len(matrices), len(positions)):
        linear, offset = matrices[part, :3, :3], matrices[part, :3, 3]
        placed[part] = positions @ linear.transpose(0, 2, 1) + offset[:, None, :]
    return placed.reshape(-1, 3)


def _parts(copies: int, vertices: int) -> Iterator[slice]:
    """Runs of copies of few enough vertices."""
    step = max(1, _VERTICES_AT_A_TIME // max(vertices, 1))
    return (slice(start, start + step) for start in range(0, copies, step))


def _placed_faces(piece: Piece) -> IndexArray:
    """Triangles of all copies, ``(k * m, 3)``. A mirroring placement would turn its copy inside out: it is reversed."""
    mesh, matrices = piece.dress.mesh, piece.world_from_mesh
    faces = mesh.faces.astype(np.uint32, copy=False)
    mirrored = np.linalg.det(matrices[:, :3, :3]) < 0
    starts = np.arange(len(matrices), dtype=np.uint32) * np.uint32(len(mesh.positions))
    placed = faces + starts[:, None, None]
    placed[mirrored] = placed[mirrored][:, :, ::-1]
    return placed.reshape(-1, 3)


def _has_area(piece: Piece) -> bool:
    corners = _placed_positions(piece)[_placed_faces(piece)]
    corners = corners.astype(np.float64)  # products of large coordinates go beyond single precision
    return bool(np.any(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])))


def _placed_normals(piece: Piece) -> FloatArray:
    """Unit normals of all copies in the world; where a file has none of length, the mean of the faces around."""
    mesh, matrices = piece.dress.mesh, piece.world_from_mesh
    assert mesh.normals is not None
    placed = np.empty((len(matrices), len(mesh.positions), 3), np.float32)
    for part in _parts(len(matrices), len(mesh.positions)):
        placed[part] = _unit_normals(Piece(piece.dress, matrices[part])).reshape(-1, len(mesh.positions), 3)
    return placed.reshape(-1, 3)


def _unit_normals(piece: Piece) -> NDArray[np.float64]:
    assert piece.dress.mesh.normals is not None
    own = np.asarray(piece.dress.mesh.normals, dtype=np.float64)
    normals = (own @ np.linalg.inv(piece.world_from_mesh[:, :3, :3])).reshape(-1, 3)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    lost = ~(np.isfinite(lengths) & (lengths > 0))[:, 0]
    if lost.any():
        normals[lost] = _face_normals(_placed_positions(piece), _placed_faces(piece))[lost]
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / lengths)


def _face_normals(positions: FloatArray, faces: IndexArray) -> NDArray[np.float64]:
    """Area-weighted normal per vertex; +z where a vertex has no face of area."""
    sums = sum_face_normals(positions, faces)
    sums[np.linalg.norm(sums, axis=1) == 0] = (0, 0, 1)
    return sums


#: Bytes of a triangle in a merged shape: its indices and its part of the acceleration structure while that is built.
BYTES_PER_TRIANGLE = 120
#: Bytes of a vertex: position, normal and texture coordinates, on the device and in the arrays they are copied from.
BYTES_PER_VERTEX = 2 * 32
#: Instances of a mesh of this many triangles cost less than merging it, as long as the scene has few instances.
LARGE_MESH = 50_000
FEW_INSTANCES = 32
#: More instances than this take minutes a picture, so that a scene that needs them is refused.
MOST_INSTANCES = 2048

K = TypeVar("K", bound=Hashable)


@dataclass(frozen=True)
class CopiedMesh:
    """A mesh, or meshes that are always placed together, and the number of its copies."""

    triangles: int
    vertices: int
    copies: int
    instantiable: bool = True

    @property
    def bytes_once(self) -> int:
        """Memory of one copy."""
        return self.triangles * BYTES_PER_TRIANGLE + self.vertices * BYTES_PER_VERTEX

    @property
    def bytes_saved(self) -> int:
        """Memory that instancing saves over merging."""
        return self.bytes_once * (self.copies - 1) if self.instantiable else 0


def choose_instances(meshes: Mapping[K, CopiedMesh], memory: int, *, name: str = "") -> set[K]:
    """Keys of the meshes to instance; all others are merged.

    Parameters
    ----------
    meshes:
        The meshes of a scene.
    memory:
        Bytes that copies may fill; the meshes themselves are there already and are taken as they are.
    name:
        Name of the scene, for the error.

    Raises
    ------
    SceneError
        The copies do not fit the memory, whatever is instanced.
    """
    chosen: set[K] = set()
    count = 0
    for key in sorted(meshes, key=lambda key: -meshes[key].triangles):
        mesh = meshes[key]
        is_cheap = mesh.triangles >= LARGE_MESH and count + mesh.copies <= FEW_INSTANCES
        if mesh.bytes_saved > 0 and is_cheap:
            chosen.add(key)
            count += mesh.copies
    need = _bytes_of(meshes, chosen)
    # Most memory saved per instance first.
    for key in sorted(meshes.keys() - chosen, key=lambda key: -meshes[key].bytes_saved / meshes[key].copies):
        mesh = meshes[key]
        if need <= memory:
            break
        if mesh.bytes_saved > 0 and count + mesh.copies <= MOST_INSTANCES:
            chosen.add(key)
            count += mesh.copies
            need -= mesh.bytes_saved
    if need > max(memory, sum(mesh.bytes_once for mesh in meshes.values())):
        triangles = sum(mesh.triangles * mesh.copies for mesh in meshes.values())
        copies = sum(mesh.copies for mesh in meshes.values())
        raise too_many(f"{copies:,} placed meshes of {triangles:,} triangles", copies, need, memory, name)
    return chosen


def too_many(what: str, copies: int, need: int, memory: int, name: str) -> SceneError:
    """The error of copies that need more bytes than there are."""
    return SceneError(
        f"{what} need {amount_in_words(need)}",
        where=name,
        parameter="memory",
        rule=f"the scene may take {amount_in_words(memory)}, about {int(copies * memory / need):,} such copies",
        fix="allow more memory, or place fewer copies",
    )


def _bytes_of(meshes: Mapping[K, CopiedMesh], instanced: set[K]) -> int:
    return sum(mesh.bytes_once * (1 if key in instanced else mesh.copies) for key, mesh in meshes.items())
