"""Points and lines of an OBJ file, drawn as thin solids."""

from __future__ import annotations

import numpy as np

from lippmann.errors import SceneError
from lippmann.scene.parsing.points_lines import MOST, as_mesh, width_of_lines, width_of_points
from lippmann.scene.readers.obj_tables import Integers, Lines, Points
from lippmann.scene.values.description import Mesh


def draw_points_and_lines(
    statements: tuple[tuple[Lines, Integers], tuple[Lines, Integers]],
    positions: Points,
    colors: Points | None,
    where: str,
) -> tuple[list[Mesh], list[str]]:
    """Solid meshes of ``p`` and ``l`` statements, and notes on their size.

    Parameters
    ----------
    statements:
        Of points, and of lines: their bodies, and the index of the material of each.
    positions, colors:
        ``(n, 3)``, all vertices of the file; linear colours or None.

    Returns
    -------
    list
        A mesh for each material of points, and of lines, that something is left of.

    Raises
    ------
    SceneError
        An index that is none or out of range, or too many of them.
    """
    diagonal = float(np.linalg.norm(np.ptp(positions, axis=0))) if len(positions) else 0.0
    meshes: list[Mesh] = []
    notes: list[str] = []
    for size, (lines, materials), what in zip((1, 2), statements, ("points", "lines"), strict=True):
        elements, owners = _elements(lines, size, len(positions), where)
        if not len(elements):
            continue
        if len(elements) > MOST:
            raise SceneError(f"holds {len(elements)} {what}", where=where, rule=f"up to {MOST} are drawn")
        one_each = positions[elements[:, 0]]
        width = width_of_points(one_each, diagonal) if size == 1 else width_of_lines(diagonal, len(elements))
        radii = np.zeros(len(positions), np.float32)
        radii[elements] = np.reshape(width.radius, (-1, 1))
        notes.append(width.note)
        for material in np.unique(materials[owners]):
            mine = elements[materials[owners] == material]
            used, places = np.unique(mine, return_inverse=True)
            thin = Mesh(
                what,
                positions[used].astype(np.float32),
                places.reshape(-1, size).astype(np.uint32),
                int(material),
                colors=None if colors is None else colors[used].astype(np.float32),
            )
            meshes.append(as_mesh(thin, np.eye(4)[None], radii[used], int(material)))
    return [mesh for mesh in meshes if len(mesh.faces)], notes


def _elements(lines: Lines, size: int, count: int, where: str) -> tuple[Integers, Integers]:
    """Points ``(m, 1)`` or lines between neighbours ``(m, 2)`` as 0-based vertices, and the statement of each."""
    rows: list[tuple[int, ...]] = []
    owners: list[int] = []
    for owner, (body, number) in enumerate(zip(lines.bodies, lines.numbers, strict=True)):
        places = []
        for word in body.split():
            vertex = word.partition("/")[0]
            if not vertex.isdecimal() or not 1 <= int(vertex[:20]) <= count:
                raise SceneError(
                    f"'{word[:40]}' is no vertex",
                    where=f"{where}:{number}",
                    rule=f"the file has 1 to {count}" if count else "the file has no vertex",
                )
            places.append(int(vertex) - 1)
        ends = [tuple(places[start : start + size]) for start in range(len(places) - size + 1)]
        rows += [end for end in ends if len(set(end)) == size]
        owners += [owner] * (len(rows) - len(owners))
    return np.array(rows, np.int64).reshape(-1, size), np.array(owners, np.int64)
