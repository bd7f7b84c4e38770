"""Points and lines of a glTF file, drawn as thin solids where its nodes place them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from lippmann.scene.parsing.far_origin import box_of_copies
from lippmann.scene.parsing.points_lines import (
    MOST,
    Width,
    as_mesh,
    place_copies,
    thin_out,
    width_of_lines,
    width_of_points,
)
from lippmann.scene.readers.gltf.document import Document
from lippmann.scene.values.description import Matrix, Mesh

_POINTS, _LINES = 1, 2  # vertices each


@dataclass
class ThinWidth:
    """Widths of points (key 1) and lines (key 2), as the scene's box and their number tell when first drawn.

    All times of an animation share those of the scene at rest, for points that grow with a box would pulsate.
    """

    widths: dict[int, Width] = field(default_factory=dict)


def has_points_or_lines(document: Document) -> bool:
    """Whether any mesh of a file holds points or lines."""
    primitives = (primitive for mesh in document.all("meshes") for primitive in mesh.children("primitives"))
    return any(primitive.optional_integer("mode") in range(4) for primitive in primitives)


def draw_points_and_lines(
    meshes: Sequence[Mesh], placements: Sequence[tuple[int, Matrix]], thin_width: ThinWidth, document: Document
) -> dict[int, Mesh]:
    """The meshes of points and lines made solid: all copies of each in one mesh of triangles, in the world.

    Parameters
    ----------
    meshes:
        All meshes; ``faces`` is ``(m, 1)`` of points, ``(m, 2)`` of lines.
    placements:
        Indices of meshes with matrices ``(k, 4, 4)`` of copies; those of triangles add to the scene's extent.
    thin_width:
        Remembers the widths.

    Returns
    -------
    dict
        The solid meshes by index; nothing is left of lines without length.

    Raises
    ------
    SceneError
        The file shows more than :data:`~lippmann.scene.parsing.points_lines.MOST` copies of meshes of points or of
        lines. Of more points or lines than that, some are drawn, with a note.
    """
    stacks: dict[int, list[Matrix]] = {}
    for mesh, worlds in placements:
        if meshes[mesh].faces.shape[1] in (_POINTS, _LINES):
            stacks.setdefault(mesh, []).append(worlds)
    if not stacks:
        return {}
    copies = {mesh: sum(map(len, stack)) for mesh, stack in stacks.items()}
    drawn: dict[int, Mesh] = {}
    for size in (_POINTS, _LINES):
        chosen = {mesh: meshes[mesh] for mesh in stacks if meshes[mesh].faces.shape[1] == size}
        if not chosen:
            continue
        count = sum(len(thin.faces) * copies[mesh] for mesh, thin in chosen.items())
        if count > MOST:
            kind = "lines" if size == _LINES else "points"
            if sum(copies[mesh] for mesh in chosen) > MOST:
                raise document.error(f"the file shows {count} {kind}", rule=f"up to {MOST} copies are drawn")
            step = -(-count // MOST)
            document.notes.add(f"of {count} {kind} one in {step} is drawn")
            chosen = {mesh: thin_out(thin, step) for mesh, thin in chosen.items()}
        matrices = {mesh: np.concatenate(stacks[mesh]) for mesh in chosen}
        if size not in thin_width.widths:
            diagonal = _diagonal(meshes, placements)
            if size == _POINTS:
                points = [
                    place_copies(thin.positions[thin.faces[:, 0]], matrices[mesh]) for mesh, thin in chosen.items()
                ]
                thin_width.widths[size] = width_of_points(np.concatenate(points), diagonal)
            else:
                thin_width.widths[size] = width_of_lines(diagonal, min(count, MOST))
        width = thin_width.widths[size]
        document.notes.add(width.note)
        for mesh, thin in chosen.items():
            # One radius for all points, whose number may change with time.
            drawn[mesh] = as_mesh(thin, matrices[mesh], float(np.median(width.radius)), thin.material)
    return drawn


def _diagonal(meshes: Sequence[Mesh], placements: Sequence[tuple[int, Matrix]]) -> float:
    """Length of the diagonal of a box about all copies of all meshes."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for mesh, worlds in placements:
        least, most = box_of_copies(meshes[mesh].positions, worlds)
        low, high = np.minimum(low, least), np.maximum(high, most)
    return float(np.linalg.norm(high - low))
