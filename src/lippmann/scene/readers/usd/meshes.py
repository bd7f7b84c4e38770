"""Triangles of a stage's polygons: subdivision, holes, values of every interpolation, one mesh for each material."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.runtime.machine import check_input
from lippmann.scene.parsing.normals import unit_normals
from lippmann.scene.parsing.points_lines import MOST, as_mesh
from lippmann.scene.parsing.triangulation import triangulate
from lippmann.scene.parsing.udim import TiledImage, missing_tiles
from lippmann.scene.point_clouds import draw_thin
from lippmann.scene.readers.gltf.nodes import normal_matrices
from lippmann.scene.readers.usd.curves import Curves, Points
from lippmann.scene.readers.usd.materials import Surface
from lippmann.scene.readers.usd.primitives import primitive_polygons, unit_ball
from lippmann.scene.readers.usd.records import Record
from lippmann.scene.readers.usd.subdivision import Cage, Refined, refine_each, smooth_groups
from lippmann.scene.values.description import FloatArray, Material, Mesh, Texture

Stored = Sequence[NDArray[np.generic]]
Integers = NDArray[np.int64]

#: How often a cage of Catmull-Clark is refined; less often where that makes more quadrilaterals than so many.
LEVELS, _MOST_QUADS = 2, 1 << 19
#: Small stages are refined more, up to so often and so many quadrilaterals in all, which takes 0.3 s (0.15 s at half,
#: 0.6 s at double): twice refined, the outline of a cube's ball has 16 sides, 2 % of its radius off.
_MOST_LEVELS, _FEW_QUADS = 4, 1 << 15
#: Bytes of the sparse matrices and arrays of a refined quadrilateral.
_BYTES_PER_QUAD = 1000
#: The same for a corner of a face that is not refined.
_BYTES_PER_CORNER = 200


#: Of meshes without a material: their display colours and opacities count.
_PLAIN = Surface(Material(), (), (1.0, 1.0, 1.0), 1.0)


@dataclass(frozen=True)
class Part:
    """Faces of one mesh that share a material: its number, -1 for none, the triangles, and their size in the prim."""

    material: int
    mesh: Mesh
    scale: float = 1.0


@dataclass(frozen=True, eq=False)
class _Polygons:
    """Polygons as they are shown: float64 points, corners of each face and their points, and its face in the stage.

    ``values`` take what stands at points, and at corners, of the stage's own polygons to those.
    """

    points: NDArray[np.float64]
    counts: Integers
    indices: Integers
    faces: Integers
    refined: Refined | None
    corner_groups: Integers | None


class MeshReader:
    """Makes triangles of a stage's mesh records.

    Attributes
    ----------
    notes:
        What is not honoured.
    """

    def __init__(self, arrays: Stored, surfaces: Sequence[Surface], where: str, records: Sequence[Record]) -> None:
        """``surfaces`` are the materials of the stage, which say what they read, and ``records`` all its meshes."""
        self._arrays, self._surfaces, self._where = arrays, surfaces, where
        self._records = [each for each in records if each.get("scheme") == "catmullClark"]
        corners = sum(len(arrays[each["indices"]]) for each in self._records)
        few = [levels for levels in range(LEVELS, _MOST_LEVELS + 1) if corners << (2 * levels - 2) <= _FEW_QUADS]
        self._levels = max(few, default=LEVELS)
        self._refined: dict[int, Refined] = {}
        self.notes: dict[str, None] = {}

    def parts(self, record: Record) -> list[Part]:
        """The triangles of a record, by material.

        Raises
        ------
        SceneError
            Corners name points that there are not, or values do not fit the mesh.
        """
        if "primitive" in record:
            return self._primitive(record)
        if "thin" in record:
            return self._thin(record)
        points, counts, indices = self._checked(record)
        owner = np.repeat(np.arange(len(counts)), counts)
        wide = counts >= 3
        kept = wide[owner]
        corner_of = np.flatnonzero(kept)
        polygons = self._polygons(record, points, counts[wide], indices[kept])
        corners = np.arange(len(polygons.indices))
        hole = np.isin(np.flatnonzero(wide), self._integers(record, "holes"))
        triangles, owners = triangulate(polygons.points, polygons.indices, polygons.counts)
        solid = ~hole[polygons.faces[owners]]
        triangles, owners = triangles[solid], owners[solid]
        if record["left_handed"]:
            triangles = triangles[:, ::-1]
        stage_faces = np.flatnonzero(wide)[polygons.faces]
        face_of_corner = np.repeat(stage_faces, polygons.counts)
        sampler = _Sampler(polygons, corners, face_of_corner, corner_of, len(points), len(counts), len(owner))
        return self._split(record, polygons, triangles, stage_faces[owners], sampler, len(counts))

    def _primitive(self, record: Record) -> list[Part]:
        if record["primitive"] == "Sphere":
            mesh, scale = unit_ball(), float(record["numbers"]["radius"])
        else:
            shape = primitive_polygons(record["primitive"], record["numbers"])
            triangles, _ = triangulate(shape.points, shape.indices, shape.counts)
            positions = shape.points[shape.indices].astype(np.float32)
            mesh = Mesh("", positions, triangles.astype(np.uint32), 0, shape.normals.astype(np.float32))
            scale = 1.0
        mesh = replace(mesh, name=record["name"])
        if record["left_handed"]:
            mesh = replace(mesh, faces=mesh.faces[:, ::-1], stands_for=None)
        for uv_name in self._surface(record["material"]).uv_names:
            self._note_no_uvs(record, uv_name)
            mesh = replace(mesh, uvs=(*mesh.uvs, np.zeros((len(mesh.positions), 2), np.float32)))
        colors = self._colors(record, record["material"], partial(self._first, record["name"]))
        if colors is not None:
            mesh = replace(mesh, colors=np.broadcast_to(colors, (len(mesh.positions), colors.shape[1])))
        return [Part(record["material"], mesh, scale)]

    def _first(self, name: str, primvar: Record, what: str) -> NDArray[np.generic]:
        """The first value of a primvar: shapes by numbers have no points that others could belong to."""
        values = self._array(primvar, "values")
        if len(values) > 1:
            self.notes[f"{name}: of its {len(values)} {what} the first is shown"] = None
        return values[:1]

    def _thin(self, record: Record) -> list[Part]:
        """Balls about points, rods along curves: of the widths that the stage gives, else as other formats have them.

        Texture coordinates of them are not read.
        """
        name, points = record["name"], self._array(record, "thin").astype(np.float64)
        if not np.isfinite(points).all():
            raise self._error(name, "has points that are not finite")
        thin: Points | Curves = Points(len(points))
        if "counts" in record:
            thin = Curves(self._integers(record, "counts"), record["basis"], record["wrap"])
            if thin.counts.min(initial=0) < 0 or thin.counts.sum() != len(points):
                raise self._error(name, f"has {len(points)} points where its curves say {int(thin.counts.sum())}")
        pieces = thin.pieces(MOST)
        elements = thin.elements(pieces)
        if not len(elements):
            return []

        def values(primvar: Record, what: str) -> FloatArray:
            given = np.asarray(self._array(primvar, "values"), np.float64)
            return self._fitting(thin.sample(given, primvar["interpolation"], pieces), primvar, name, what)

        positions = thin.sample(points, "vertex", pieces)
        assert positions is not None
        colors = self._colors(record, record["material"], values)
        if colors is not None:
            colors = np.broadcast_to(colors, (len(positions), colors.shape[1]))
        radii = None
        if record["widths"] is not None:
            radii = np.broadcast_to(np.maximum(values(record["widths"], "widths")[:, 0] / 2.0, 0.0), len(positions))
        step = -(-len(elements) // MOST)
        if step > 1:
            self.notes[f"{name}: of {len(elements)} points or pieces of curves one in {step} is drawn"] = None
        mesh = Mesh(name, positions.astype(np.float32), elements[::step].astype(np.uint32), 0, colors=colors)
        if radii is not None and radii.any():
            drawn = [as_mesh(mesh, np.eye(4)[None], radii, 0)]
        else:
            drawn, width = draw_thin([mesh])
            self.notes[width.note] = None
        for uv_name in self._surface(record["material"]).uv_names:
            self._note_no_uvs(record, uv_name)
            drawn = [replace(each, uvs=(*each.uvs, np.zeros((len(each.positions), 2), np.float32))) for each in drawn]
        return [Part(record["material"], each) for each in drawn]

    def _note_no_uvs(self, record: Record, uv_name: str) -> None:
        if uv_name:
            note = f"mesh {record['name']} has no texture coordinates '{uv_name}': its textures show one texel"
            self.notes[note] = None

    def _surface(self, material: int) -> Surface:
        return self._surfaces[material] if material >= 0 else _PLAIN

    def _colors(
        self, record: Record, material: int, values: Callable[[Record, str], NDArray[np.generic]]
    ) -> FloatArray | None:
        """Colours ``(n, 3 or 4)``, as far as the material reads them; ``values`` reads a primvar."""
        surface = self._surface(material)
        color = record["colors"].get(surface.color_name) if surface.color is not None else None
        opacity = record["opacity"] if surface.opacity is not None else None
        if material < 0 and color is None:
            return None
        if surface.color is None and surface.opacity is None:
            return None
        rgb = np.array([surface.color or (1.0, 1.0, 1.0)])
        if color is not None:
            what = "display colours" if surface.color_name == "displayColor" else f"colours '{surface.color_name}'"
            rgb = np.clip(values(color, what)[:, :3], 0.0, None)
        if surface.opacity is None or (material < 0 and opacity is None):
            return np.asarray(rgb, np.float32)
        alpha = np.array([[surface.opacity]])
        if opacity is not None:
            alpha = np.clip(values(opacity, "display opacities"), 0.0, 1.0)
        count = max(len(rgb), len(alpha))
        wide = [np.broadcast_to(each, (count, each.shape[1])) for each in (rgb, alpha)]
        return np.concatenate(wide, axis=1).astype(np.float32)

    def _array(self, record: Record, name: str) -> NDArray[np.generic]:
        return self._arrays[record[name]]

    def _integers(self, record: Record, name: str) -> Integers:
        return np.asarray(self._array(record, name), np.int64)

    def _checked(self, record: Record) -> tuple[NDArray[np.float64], Integers, Integers]:
        """Points, corners of each face, and their points, if they fit each other."""
        name = record["name"]
        counts, indices = self._integers(record, "counts"), self._integers(record, "indices")
        points = self._array(record, "points").astype(np.float64)
        if counts.min(initial=0) < 0 or counts.sum() != len(indices):
            raise self._error(name, f"has {len(indices)} corners where its faces say {int(counts.sum())}")
        if len(indices) and not 0 <= indices.min() <= indices.max() < len(points):
            raise self._error(name, f"uses point {int(indices.max())} of {len(points)}")
        if not np.isfinite(points).all():
            raise self._error(name, "has points that are not finite")
        return points, counts, indices

    def _error(self, name: str, what: str) -> SceneError:
        return SceneError(f"mesh {name} {what}", where=self._where)

    def _polygons(self, record: Record, points: NDArray[np.float64], counts: Integers, indices: Integers) -> _Polygons:
        faces = np.arange(len(counts))
        scheme = record["scheme"]
        if scheme == "loop":
            self.notes["meshes of Loop subdivision are shown as their cages, shaded smoothly"] = None
        check_input(_BYTES_PER_CORNER * len(indices), f"mesh {record['name']}", where=self._where)
        plain = _Polygons(points, counts, indices, faces, None, None)
        # Bilinear subdivision adds vertices inside a polygon, which leave its surface as it is.
        if not len(counts) or scheme in ("none", "bilinear"):
            return plain
        levels = self._levels_of(record) if scheme == "catmullClark" else 0
        if scheme == "catmullClark" and levels < LEVELS:
            self.notes[f"mesh {record['name']} is refined {levels} time(s) instead of {LEVELS}: it is large"] = None
        if not levels:
            return replace(plain, corner_groups=smooth_groups(self._cage(record)))
        quads = len(indices) << (2 * levels - 2)
        check_input(_BYTES_PER_QUAD * quads, f"mesh {record['name']}, refined,", where=self._where)
        refined = self._refine(record, levels)
        return _Polygons(
            refined.from_points @ points,
            refined.cage.counts,
            refined.cage.indices,
            refined.faces,
            refined,
            refined.corner_groups,
        )

    def _levels_of(self, record: Record) -> int:
        levels = self._levels
        while levels and len(self._array(record, "indices")) << (2 * levels - 2) > _MOST_QUADS:
            levels -= 1
        return levels

    def _refine(self, record: Record, levels: int) -> Refined:
        """A cage refined, with those that follow it: many small ones take nearly as long as one each by itself."""
        if id(record) not in self._refined:
            batch, quads = [record], 0
            after = next(place for place, each in enumerate(self._records) if each is record) + 1
            for each in self._records[after:]:
                if not (self._integers(each, "counts") >= 3).any():
                    continue
                quads += len(self._array(each, "indices")) << (2 * levels - 2)
                if quads > _FEW_QUADS or self._levels_of(each) != levels or each["boundary"] != record["boundary"]:
                    break
                batch.append(each)
            refined = refine_each(
                [self._cage(each) for each in batch], levels, sharp_corners=record["boundary"] != "edgeOnly"
            )
            self._refined = {id(each): one for each, one in zip(batch, refined, strict=True)}
        return self._refined[id(record)]

    def _cage(self, record: Record) -> Cage:
        positions, counts, indices = self._checked(record)
        wide = counts >= 3
        points, counts, indices = len(positions), counts[wide], indices[np.repeat(wide, counts)]
        lengths, along = self._integers(record, "crease_lengths"), self._integers(record, "crease_indices")
        sharpness = self._array(record, "crease_sharpnesses").astype(np.float64)
        corners = np.zeros(points)
        own, keen = self._integers(record, "corner_indices"), self._array(record, "corner_sharpnesses")
        edges = np.zeros((0, 2), np.int64)
        keenness = np.zeros(0)
        fits = lengths.sum() == len(along) and (lengths >= 2).all() and len(own) == len(keen)
        pairs = int(lengths.sum()) - len(lengths)
        fits = fits and len(sharpness) in (len(lengths), pairs)
        fits = fits and all(not len(each) or 0 <= each.min() <= each.max() < points for each in (along, own))
        if not fits:
            self.notes[f"mesh {record['name']}: creases that do not fit it are left out"] = None
        else:
            corners[own] = np.nan_to_num(keen)
            if len(lengths):
                last = np.zeros(len(along), bool)
                last[np.cumsum(lengths) - 1] = True
                first = np.flatnonzero(~last)
                edges = np.stack([along[first], along[first + 1]], axis=1)
                per_edge = len(sharpness) == pairs and pairs != len(lengths)
                keenness = np.nan_to_num(sharpness if per_edge else np.repeat(sharpness, lengths - 1))
        return Cage(points, counts, indices, edges, np.maximum(keenness, 0.0), np.maximum(corners, 0.0))

    def _split(
        self,
        record: Record,
        polygons: _Polygons,
        triangles: Integers,
        faces: Integers,
        sampler: _Sampler,
        face_count: int,
    ) -> list[Part]:
        """Triangles by material; ``faces`` is each one's face in the stage."""
        materials = np.full(face_count, record["material"])
        for subset in record["subsets"]:
            own = self._integers(subset, "faces")
            materials[own[(own >= 0) & (own < face_count)]] = subset["material"]
        of_triangle = materials[faces]
        parts = []
        for material in np.unique(of_triangle):
            chosen = triangles if len(record["subsets"]) == 0 else triangles[of_triangle == material]
            mesh = self._mesh(record, polygons, chosen, sampler, int(material))
            parts.append(Part(int(material), mesh))
        return parts

    def _mesh(self, record: Record, polygons: _Polygons, triangles: Integers, sampler: _Sampler, material: int) -> Mesh:
        name = record["name"]
        normals = None
        if polygons.corner_groups is not None:
            normals = _smooth_normals(polygons, record["left_handed"])
        elif record["normals"] is not None:
            normals = self._values(sampler, record["normals"], name, "normals")
            if "turns" in record["normals"]:
                turns = normal_matrices(np.asarray(self._array(record["normals"], "turns"), np.float64))
                normals = np.einsum("cij,cj->ci", turns[polygons.indices], normals).astype(np.float32)
        uvs = []
        for uv_name in self._surface(material).uv_names:
            entry = record["uvs"].get(uv_name)
            if entry is None and uv_name and len(record["uvs"]) == 1:  # exporters name it otherwise in materials
                ((only, entry),) = record["uvs"].items()
                self.notes[
                    f"mesh {name} has no texture coordinates '{uv_name}': its only ones, '{only}', are taken"
                ] = None
            if entry is None:
                self._note_no_uvs(record, uv_name)
                uvs.append(np.tile(np.array([0.0, 1.0], np.float32), (len(polygons.indices), 1)))  # a stage's (0, 0)
                continue
            values = self._values(sampler, entry, name, f"texture coordinates '{uv_name}'")
            # A stage's v points up the picture.
            uvs.append((values * (1.0, -1.0) + (0.0, 1.0)).astype(np.float32))
        colors = self._colors(record, material, lambda primvar, what: self._values(sampler, primvar, name, what))
        if colors is not None:
            colors = np.broadcast_to(colors, (len(polygons.indices), colors.shape[1]))
        if not self._varies_at_points(record, material):
            triangles = _first_corners(polygons)[triangles]
        shown = np.zeros(len(polygons.indices), bool)
        shown[triangles] = True
        corners = np.flatnonzero(shown)
        places = np.zeros(len(polygons.indices), np.uint32)
        places[corners] = np.arange(len(corners), dtype=np.uint32)
        positions = polygons.points[polygons.indices[corners]].astype(np.float32)
        faces = places[triangles]
        for texture in self._surface(material).tiled:
            self._note_missing_tiles(name, texture, uvs[texture.uv_set][triangles].mean(axis=1))
        mesh = Mesh(
            name,
            positions,
            faces,
            0,
            uvs=tuple(values[corners] for values in uvs),
            colors=None if colors is None else colors[corners],
        )
        if normals is None or not len(faces):
            return mesh
        return replace(mesh, normals=unit_normals(normals[corners].astype(np.float32), positions, faces)[0])

    def _note_missing_tiles(self, name: str, texture: Texture, middles: FloatArray) -> None:
        """Of the tiles that the middles of triangles need; their corners may lie on the edge of others."""
        image, to_tiles = texture.image, texture.uv_transform
        assert isinstance(image, TiledImage)
        missing = missing_tiles(image, middles @ to_tiles[:2, :2].T + to_tiles[:2, 2])
        if missing:
            listing = ", ".join(map(str, missing[:5])) + ", ..." * (len(missing) > 5)
            self.notes[f"texture '{image.name}' has no tile {listing}, which mesh {name} needs: black there"] = None

    def _varies_at_points(self, record: Record, material: int) -> bool:
        """Whether corners of faces that meet in a point may have values of their own, normals of edges apart."""
        surface = self._surface(material)
        used = [record["normals"], *(record["uvs"].get(name) for name in surface.uv_names)]
        used += [record["colors"].get(surface.color_name)] if surface.color is not None else []
        used += [record["opacity"]] if surface.opacity is not None else []
        return any(each is not None and each["interpolation"] in ("uniform", "faceVarying") for each in used)

    def _values(self, sampler: _Sampler, primvar: Record, name: str, what: str) -> FloatArray:
        values = np.asarray(self._arrays[primvar["values"]], np.float32)
        return self._fitting(sampler.at_corners(values, primvar["interpolation"]), primvar, name, what)

    def _fitting(self, taken: NDArray[np.floating] | None, primvar: Record, name: str, what: str) -> FloatArray:
        """Values that a sampler has taken of a primvar, if they fit their prim."""
        if taken is None:
            count = len(self._array(primvar, "values"))
            raise self._error(name, f"has {count} {what}, {primvar['interpolation']}, which do not fit it")
        return np.asarray(taken, np.float32)


@dataclass(frozen=True, eq=False)
class _Sampler:
    """Values of a mesh at the corners of the polygons that are shown.

    ``corner_of`` are the stage's corners that polygons of three and more have; the counts are those of the stage.
    """

    polygons: _Polygons
    corners: Integers
    face_of_corner: Integers
    corner_of: Integers
    points: int
    faces: int
    stage_corners: int

    def at_corners(self, values: FloatArray, interpolation: str) -> FloatArray | None:
        """A primvar's values at the corners of faces, ``(c, k)``; None where their number does not fit the mesh."""
        refined = self.polygons.refined
        if interpolation == "constant":
            return np.broadcast_to(values[:1], (len(self.corners), values.shape[1])) if len(values) else None
        if interpolation == "uniform":
            return values[self.face_of_corner] if len(values) == self.faces else None
        if interpolation in ("vertex", "varying"):
            if len(values) != self.points:
                return None
            if refined is not None:
                matrix = refined.from_points if interpolation == "vertex" else refined.from_points_linear
                values = np.asarray(matrix @ values, np.float32)
            return values[self.polygons.indices]
        if interpolation != "faceVarying" or len(values) != self.stage_corners:
            return None
        own = values[self.corner_of]
        return own if refined is None else np.asarray(refined.from_corners @ own, np.float32)


def _first_corners(polygons: _Polygons) -> Integers:
    """The first corner ``(c,)`` with the same point and normal, for each corner."""
    groups = polygons.indices if polygons.corner_groups is None else polygons.corner_groups
    first = np.zeros(int(groups.max(initial=0)) + 1, np.int64)
    first[groups[::-1]] = np.arange(len(groups))[::-1]
    return first[groups]


def _smooth_normals(polygons: _Polygons, left_handed: bool) -> FloatArray:
    """Normals ``(c, 3)`` at corners, not of unit length: sums of faces by area, where no sharp edge parts them."""
    assert polygons.corner_groups is not None
    corners = polygons.points[polygons.indices]
    ends = np.cumsum(polygons.counts)
    starts = ends - polygons.counts
    following = np.arange(len(corners)) + 1
    following[ends - 1] = starts
    first = np.repeat(starts, polygons.counts)
    areas = np.add.reduceat(np.cross(corners - corners[first], corners[following] - corners[first]), starts, axis=0)
    owner = np.repeat(np.arange(len(polygons.counts)), polygons.counts)
    groups = polygons.corner_groups
    sums = np.stack([np.bincount(groups, areas[owner, axis]) for axis in range(3)], axis=1)
    return (sums[groups] * (-1.0 if left_handed else 1.0)).astype(np.float32)
