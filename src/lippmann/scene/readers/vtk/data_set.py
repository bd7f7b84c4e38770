"""Data sets of PyVista as plain values: surfaces with their colours, and images as volumes.

PyVista is not imported here: whoever has an object of it has loaded it.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.parsing.far_origin import near_origin
from lippmann.scene.parsing.vertex_colors import linear_colors, material_of
from lippmann.scene.point_clouds import describe_cloud
from lippmann.scene.values.description import Instance, Mesh, SceneDescription

if TYPE_CHECKING:
    import pyvista

#: The colour map of numbers, as PyVista has it.
COLOR_MAP = "viridis"
#: The array that tells which points and cells are hidden, and the bit that says so.
_GHOSTS, _HIDDEN_POINT, _HIDDEN_CELL = "vtkGhostType", 2, 32
#: Colour of what is no number, in sRGB codes.
_NO_NUMBER = (160, 160, 160, 255)


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles of a data set, or points or lines alone.

    ``positions`` ``(n, 3)``, ``faces`` ``(m, 3)``, of points ``(n, 1)``, of lines ``(m, 2)``, ``normals`` ``(n, 3)``
    and ``uvs`` ``(n, 2)`` (v up) or None; ``colors`` ``(n, 4)`` sRGB bytes or None. ``notes`` are remarks, a line each.
    """

    positions: NDArray[np.float64]
    faces: NDArray[np.int64]
    normals: NDArray[np.float32] | None = None
    uvs: NDArray[np.float32] | None = None
    colors: NDArray[np.uint8] | None = None
    notes: list[str] = field(default_factory=list)


def surface_of(source: pyvista.DataSet | pyvista.MultiBlock) -> Surface:
    """The outer surface of a data set, cut into triangles; of points or lines alone, these.

    Bytes with three or four channels are colours; other scalars are coloured over their range by a table of their own,
    as files of VTK's older kind may have it, or by :data:`COLOR_MAP`, vectors by their length.

    Raises
    ------
    SceneError
        The data set has no surface.
    """
    if hasattr(source, "combine"):  # a collection of blocks
        source = source.combine()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of defaults to come, whose new names older versions do not know
        surface = source if hasattr(source, "verts") else source.extract_surface()
        if is_thin(surface) and surface.n_verts:
            return _points(surface)
        surface, notes = _polygons(surface)
        surface, faces, owners = _segments(surface) if is_thin(surface) else _triangles(surface)
    positions = np.asarray(surface.points, np.float64)
    if len(faces) == 0:
        raise SceneError("the PyVista data set has no surface", rule="there must be at least one face, line or point")
    normals, uvs = surface.point_data.active_normals, surface.active_texture_coordinates
    colors = None
    scalars = surface.active_scalars
    if scalars is not None:
        colors = _colors(np.asarray(scalars), str(surface.active_scalars_name), _own_table(scalars), notes)
    if colors is not None and len(colors) != len(positions):  # one colour per face
        corners, sides = faces.ravel(), faces.shape[1]
        colors, positions = np.repeat(colors[owners], sides, axis=0), positions[corners]
        normals = None if normals is None else np.asarray(normals)[corners]
        uvs = None if uvs is None else np.asarray(uvs)[corners]
        faces = np.arange(len(corners)).reshape(-1, sides)
    return Surface(
        positions,
        faces,
        None if normals is None else np.asarray(normals, np.float32),
        None if uvs is None else np.asarray(uvs, np.float32),
        colors,
        notes,
    )


def is_thin(source: pyvista.DataSet) -> bool:
    """Whether a data set has cells of single points and no others, or of lines."""
    counts = getattr(source, "n_verts", 0), getattr(source, "n_lines", 0)
    return source.n_cells > 0 and source.n_cells in counts


def _points(source: pyvista.PolyData) -> Surface:
    notes: list[str] = []
    scalars, count = source.active_scalars, source.n_points
    colors = None
    if scalars is not None and len(scalars) == count:
        colors = _colors(np.asarray(scalars), str(source.active_scalars_name), _own_table(scalars), notes)
    uvs = source.active_texture_coordinates
    uvs = None if uvs is None else np.asarray(uvs, np.float32)
    return Surface(np.asarray(source.points, np.float64), np.arange(count)[:, None], None, uvs, colors, notes)


def _polygons(surface: pyvista.PolyData) -> tuple[pyvista.PolyData, list[str]]:
    """A surface without its points and lines, which VTK counts before polygons, and a note on them.

    VTK's own filter that makes triangles leaves the scalars of such cells undefined.
    """
    first = surface.n_verts + surface.n_lines
    if not 0 < first < surface.n_cells:
        return surface, []
    left_out = [
        f"{what} ({count})" for what, count in (("points", surface.n_verts), ("lines", surface.n_lines)) if count
    ]
    polygons = surface.extract_cells(np.arange(first, surface.n_cells)).extract_surface()
    return polygons, [f"beside the surface, {' and '.join(left_out)} are not shown"]


def _own_table(scalars: NDArray[np.generic]) -> NDArray[np.uint8] | None:
    """The colours ``(n, 4)`` that an array of VTK's brings with it; None without."""
    array: Any = getattr(scalars, "VTKObject", None)
    table = None if array is None else array.GetLookupTable()
    if table is None or not hasattr(table, "GetTableValue") or not table.GetNumberOfTableValues():
        return None
    values = [table.GetTableValue(number) for number in range(table.GetNumberOfTableValues())]
    return np.rint(255.0 * np.array(values)).astype(np.uint8)


def _triangles(surface: pyvista.PolyData) -> tuple[pyvista.PolyData, NDArray[np.int64], NDArray[np.int64]]:
    """A surface, its triangles ``(m, 3)``, and the cell ``(m,)`` that each belongs to.

    Quads are cut as VTK draws them, from their first corner to their third, which colours at points show.
    """
    listed = np.asarray(surface.faces, np.int64)
    if len(listed) == 5 * surface.n_cells and (listed[::5] == 4).all():
        faces = listed.reshape(-1, 5)[:, [1, 2, 3, 1, 3, 4]].reshape(-1, 3)
        return surface, faces, np.repeat(np.arange(surface.n_cells), 2)
    surface = surface.triangulate()
    faces = np.asarray(surface.faces, np.int64).reshape(-1, 4)[:, 1:]
    return surface, faces, np.arange(len(faces))


def _segments(surface: pyvista.PolyData) -> tuple[pyvista.PolyData, NDArray[np.int64], NDArray[np.int64]]:
    """Lines, their pieces ``(m, 2)`` from point to point, and the cell ``(m,)`` that each belongs to."""
    listed = np.asarray(surface.lines, np.int64)
    pieces, first = [np.empty((0, 2), np.int64)], 0
    while first < len(listed):
        line = listed[first + 1 : first + 1 + listed[first]]
        pieces.append(np.stack([line[:-1], line[1:]], axis=1))
        first += len(line) + 1
    owners = np.repeat(np.arange(surface.n_cells), [len(each) for each in pieces[1:]])
    return surface, np.concatenate(pieces), owners


def unshown_arrays(source: pyvista.DataSet | pyvista.MultiBlock) -> str:
    """Names of the arrays of a data set without active ones, or of the blocks of an uncoloured collection; or empty."""
    if hasattr(source, "combine"):
        blocks = list(source.recursive_iterator(skip_none=True))
    else:
        blocks = [source] if source.active_scalars_name is None else []
    names: dict[str, None] = {}
    for block in blocks:
        points = block.point_data
        other = (points.active_normals_name, points.active_texture_coordinates_name)
        names.update(dict.fromkeys(name for table in (points, block.cell_data) for name in table if name not in other))
    return ", ".join(f"'{name[:40]}'" for name in [*names][:20])


def mesh_of(surface: Surface, name: str, material: int) -> Mesh:
    """The triangles, lines or points as a scene's mesh, whose material has that index."""
    uvs = surface.uvs
    return Mesh(
        name=name,
        positions=surface.positions.astype(np.float32),
        faces=surface.faces.astype(np.uint32),
        material=material,
        normals=surface.normals,
        uvs=() if uvs is None else ((uvs * (1.0, -1.0) + (0.0, 1.0)).astype(np.float32),),
        colors=None if surface.colors is None else linear_colors(surface.colors),
    )


def describe_surface(surface: Surface, name: str, notes: list[str]) -> SceneDescription:
    """The scene of a surface alone, or of points or lines."""
    surface = replace(surface, positions=near_origin(surface.positions, notes))
    mesh, material = mesh_of(surface, name, 0), material_of(surface.colors)
    if surface.faces.shape[1] < 3:
        return describe_cloud(mesh, material, notes)
    return SceneDescription(name, [mesh], [material], [Instance(0, np.eye(4))], notes=notes)


def _colors(
    scalars: NDArray[np.generic], name: str, table: NDArray[np.uint8] | None, notes: list[str]
) -> NDArray[np.uint8] | None:
    """sRGB bytes ``(n, 3 or 4)`` of active scalars."""
    if scalars.dtype == np.uint8 and scalars.ndim == 2 and scalars.shape[1] in (3, 4):
        return np.asarray(scalars, np.uint8)
    if scalars.dtype.kind not in "iufb":
        notes.append(f"the scalars '{name[:60]}' are no numbers, and are not shown")
        return None
    values = np.asarray(scalars, np.float64)
    what = name[:60]
    if values.ndim > 1:
        values, what = np.linalg.norm(values.reshape(len(values), -1), axis=1), f"length of {what}"
    finite = values[np.isfinite(values)]
    if not len(finite):
        notes.append(f"the scalars '{what}' hold no finite number, and are not shown")
        return None
    low, high = float(finite.min()), float(finite.max())
    by = COLOR_MAP if table is None else f"their own {len(table)} colours"
    notes.append(f"the scalars '{what}' from {low:.5g} to {high:.5g} are coloured by {by}")
    return color_table(values, low, high, color_map(COLOR_MAP) if table is None else table)


def color_map(name: str) -> NDArray[np.uint8]:
    """256 sRGB colours ``(256, 4)`` of a colour map of Matplotlib's."""
    import matplotlib

    table: NDArray[np.uint8] = matplotlib.colormaps[name](np.arange(256), bytes=True)
    return table


def color_table(values: NDArray[np.float64], low: float, high: float, table: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Colours ``(n, 4)`` of values: those of a table laid over a range; grey where a value is no number."""
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        share = (values - low) / (high - low) if high > low else np.zeros(len(values))
    finite = np.isfinite(share)
    index = np.clip(np.where(finite, share, 0.0) * len(table), 0, len(table) - 1).astype(np.int64)
    colors = np.asarray(table, np.uint8)[index]
    colors[~finite] = _NO_NUMBER
    return np.asarray(colors, np.uint8)


def image_of(source: pyvista.ImageData) -> tuple[NDArray[np.generic], NDArray[np.float64]] | None:
    """Grid ``(nz, ny, nx)`` and ``world_from_voxel`` ``(4, 4)`` of an image's active scalars, if they are numbers.

    Scalars of cells lie in the middles of cells. Those of hidden points and cells are no numbers.
    """
    scalars = source.active_scalars
    if scalars is None or np.asarray(scalars).dtype.kind not in "iufb" or np.asarray(scalars).ndim != 1:
        return None
    counts = np.array(source.dimensions)
    matrix = np.eye(4)
    matrix[:3, :3] = np.asarray(source.direction_matrix, np.float64) * np.asarray(source.spacing, np.float64)
    matrix[:3, 3] = np.asarray(source.origin) + matrix[:3, :3] @ np.array(source.extent[::2], np.float64)
    is_of_points = len(scalars) == counts.prod()
    if not is_of_points:
        counts = np.maximum(counts - 1, 1)
        matrix[:3, 3] += matrix[:3, :3] @ np.full(3, 0.5)
    if len(scalars) != counts.prod():
        return None
    width, height, depth = counts.tolist()
    table, flag = (source.point_data, _HIDDEN_POINT) if is_of_points else (source.cell_data, _HIDDEN_CELL)
    values = np.asarray(scalars)
    if _GHOSTS in table:
        values = np.where(np.asarray(table[_GHOSTS]) & flag, np.float32(np.nan), values)
    return values.reshape(depth, height, width), matrix
