"""Points and lines as thin solids: balls and rods of triangles, as wide as the scene's extent makes them visible."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.parsing.round_meshes import join_rings, repeat_triangles, subdivide_sphere
from lippmann.scene.values.description import FloatArray, IndexArray, Material, Mesh

#: Radii of points and of lines over the diagonal of the scene's box: of 64 lenses, one shows the width of a line.
POINT_RADIUS, LINE_RADIUS = 0.01, 0.005

#: More points or lines than that are not drawn: each is six or eight triangles.
MOST = 1 << 18

# Neighbour whose distance tells the spacing about a point: the 16th lies 2.2 spacings away in a grid as in a random
# cloud. Balls of this share of it close both: octahedra leave 1 % of a random surface open.
_NEIGHBOR, _SHARE_OF_DISTANCE = 16, 0.7
# Radii of points over that of as many spread evenly, at most: more would fill clouds that have no surface.
_SPREAD = 3.0

# Up to so many, points are balls of 32 triangles, and lines have 6 sides; of more, which are thinner, 8 and 3. A few
# points, which may be wide, are balls of 512. Half or double the few moves only where these begin to cost: with 128 000
# or 512 000 triangles.
_MOST_ROUND, _FEW = 20_000, 500

Points = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Solids:
    """Triangles ``(m, 3)`` of vertices ``(n, 3)`` with unit normals; ``sources`` ``(n,)`` is each vertex's point."""

    positions: FloatArray
    normals: FloatArray
    faces: IndexArray
    sources: Integers


@dataclass(frozen=True)
class Width:
    """How wide points or lines are drawn: their radius, or that of each point ``(n,)``, and the note that says so."""

    radius: float | FloatArray
    note: str


#: How the note of a width of points begins.
POINTS_NOTE = "points are drawn as balls"


def width_of_lines(diagonal: float, count: int) -> Width:
    """Width of ``count`` lines in a box of a ``diagonal``: less where there are so many that they would touch."""
    share = _share(LINE_RADIUS, count)
    return Width(share * (diagonal or 1.0), f"lines are drawn as rods of a radius of {_percent(share)}")


def width_of_points(points: Points, diagonal: float) -> Width:
    """Width of each of points ``(n, 3)`` in a box of a ``diagonal``, with which a surface that they sample is closed.

    ``n`` points spread over a surface lie about ``diagonal / sqrt(n)`` from each other. The radius follows the distance
    of the 16th neighbour from half of that to three halves, up to :data:`POINT_RADIUS`. All of up to 2500 points have
    that.
    """
    least = _share(POINT_RADIUS, len(points))
    most = min(POINT_RADIUS, _SPREAD * least)
    diagonal = diagonal or 1.0
    radii = np.full(len(points), least * diagonal, np.float32)
    if most > least:
        from scipy.spatial import cKDTree  # here: most scenes have no points

        tree, distances = cKDTree(points), np.empty(len(points))
        # In the tree's own order, which is three times as fast; a point's first neighbour is itself.
        distances[tree.indices] = tree.query(points[tree.indices], [_NEIGHBOR + 1])[0][:, 0]
        radii = np.clip(_SHARE_OF_DISTANCE * distances, least * diagonal, most * diagonal).astype(np.float32)
    return Width(radii, f"{POINTS_NOTE} of a radius of up to {_percent(most)}")


def _share(most: float, count: int) -> float:
    """A radius over the diagonal, less than ``most`` from 2500 points or lines on."""
    return most * min(1.0, 50.0 / math.sqrt(max(count, 1)))


def _percent(share: float) -> str:
    return f"{100 * share:.2f} % of the scene's diagonal"


def as_material(material: Material) -> Material:
    """How points and lines without normals show a material: its base colour and emission, without shading.

    glTF 2.0, section 3.9.7 ("Point and Line Materials"), says so.
    """
    red, green, blue = (
        min(base + glow, 1.0) for base, glow in zip(material.base_color, material.emission, strict=True)
    )
    return Material(
        name=material.name,
        base_color=(red, green, blue),
        base_color_texture=material.base_color_texture,
        alpha=material.alpha,
        alpha_mode=material.alpha_mode,
        alpha_cutoff=material.alpha_cutoff,
        double_sided=True,
        unlit=True,
    )


def thin_out(thin: Mesh, step: int) -> Mesh:
    """One in ``step`` of the points or lines of a mesh whose ``faces`` are ``(m, 1)`` or ``(m, 2)``."""
    chosen = thin.faces[::step]
    used, faces = np.unique(chosen, return_inverse=True)
    return replace(
        thin,
        positions=thin.positions[used],
        faces=faces.reshape(chosen.shape).astype(np.uint32),
        uvs=tuple(uvs[used] for uvs in thin.uvs),
        colors=None if thin.colors is None else thin.colors[used],
    )


def thin_to_most(thin: Sequence[Mesh]) -> tuple[list[Mesh], list[str]]:
    """As many of the points, or of the lines, of all meshes as are drawn, and a note where that is not all."""
    count = sum(len(mesh.faces) for mesh in thin)
    what = "lines" if thin[0].faces.shape[1] == 2 else "points"
    step = max(1, -(-count // MOST))
    return [thin_out(mesh, step) for mesh in thin], [f"of {count} {what} one in {step} is drawn"] if step > 1 else []


def as_mesh(thin: Mesh, world_from_mesh: Points, width: float | FloatArray, material: int) -> Mesh:
    """The mesh of solids, in the world, of a mesh whose ``faces`` are points ``(m, 1)`` or lines ``(m, 2)``.

    Parameters
    ----------
    world_from_mesh:
        ``(k, 4, 4)``, one for each copy.
    width:
        Radius in the world, or that of each position of a single copy ``(n,)``.
    material:
        Index of the solids' material.
    """
    step = len(thin.positions)
    elements = (thin.faces.astype(np.int64) + step * np.arange(len(world_from_mesh))[:, None, None]).reshape(
        -1, thin.faces.shape[1]
    )
    points = place_copies(thin.positions, world_from_mesh)
    drawn = (balls if elements.shape[1] == 1 else rods)(points, elements, width)
    sources = drawn.sources % step
    return Mesh(
        thin.name,
        drawn.positions,
        drawn.faces,
        material,
        drawn.normals,
        tuple(uvs[sources] for uvs in thin.uvs),
        None if thin.colors is None else thin.colors[sources],
        points=len(drawn.positions) // max(1, len(elements)) if elements.shape[1] == 1 else 0,
    )


def place_copies(positions: FloatArray, world_from_mesh: Points) -> Points:
    """Points ``(k n, 3)`` in the world of ``k`` copies of positions ``(n, 3)``."""
    worlds = positions @ world_from_mesh[:, :3, :3].transpose(0, 2, 1) + world_from_mesh[:, None, :3, 3]
    return worlds.reshape(-1, 3)


def balls(points: Points, elements: Integers, width: float | FloatArray) -> Solids:
    """A ball of radius ``width`` about each of ``points`` ``(n, 3)`` that ``elements`` ``(m, 1)`` names."""
    corners, triangles = _ball(4 if len(elements) <= _FEW else 2 if len(elements) <= _MOST_ROUND else 1)
    sources = np.repeat(elements[:, 0], len(corners))
    normals: FloatArray = np.tile(corners.astype(np.float32), (len(elements), 1))
    return Solids(
        points.astype(np.float32)[sources] + _radii(width, sources) * normals,
        normals,
        _repeat(triangles, len(elements), len(corners)),
        sources,
    )


def rods(points: Points, elements: Integers, width: float | FloatArray) -> Solids:
    """An open prism of radius ``width`` about each line ``elements`` ``(m, 2)`` between two of ``points`` ``(n, 3)``.

    Lines of no length are left out.
    """
    ends = points[elements]
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1)
    elements, along = elements[length > 0.0], (along / np.where(length > 0.0, length, 1.0)[:, None])[length > 0.0]
    # Across each line, from the axis that is least along it.
    axis = np.eye(3)[np.abs(along).argmin(axis=1)]
    first = np.cross(along, axis)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(along, first)
    sides = 6 if len(elements) <= _MOST_ROUND else 3
    angles = 2.0 * np.pi * np.arange(sides) / sides
    around = np.cos(angles)[:, None] * first[:, None] + np.sin(angles)[:, None] * second[:, None]
    normals: FloatArray = np.concatenate([around, around], axis=1).reshape(-1, 3).astype(np.float32)
    sources = np.repeat(elements.ravel(), sides)
    return Solids(
        points.astype(np.float32)[sources] + _radii(width, sources) * normals,
        normals,
        _repeat(join_rings(sides), len(elements), 2 * sides),
        sources,
    )


def _radii(width: float | FloatArray, sources: Integers) -> FloatArray:
    radii = np.asarray(width, np.float32)
    return radii[sources, None] if radii.ndim else radii


def _repeat(triangles: Integers, count: int, step: int) -> IndexArray:
    return repeat_triangles(triangles, count, step).astype(np.uint32)


def _ball(detail: int) -> tuple[Points, Integers]:
    """Unit vectors and counter-clockwise triangles of an octahedron, cut into four ``detail`` - 1 times."""
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    triangles = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
    return subdivide_sphere(corners, triangles, detail - 1)
