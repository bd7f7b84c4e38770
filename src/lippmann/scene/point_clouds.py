"""Clouds of plain points, drawn as balls: fitted to their bulk, and cropped; lines alone, drawn as rods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.matrices import transform_points
from lippmann.scene.parsing.points_lines import (
    POINTS_NOTE,
    Width,
    as_mesh,
    thin_to_most,
    width_of_lines,
    width_of_points,
)
from lippmann.scene.splat_clouds import bulk_of
from lippmann.scene.values.description import Instance, Material, Matrix, Mesh, SceneDescription


def draw_cloud(clouds: Sequence[Mesh], width: Width | None = None) -> tuple[list[Mesh], Width]:
    """Balls about the points of clouds, whose ``faces`` are points ``(m, 1)``, and how wide they are.

    Strays, far outside of where nearly all points are, have meshes of their own, which displays are not fitted to; see
    :func:`lippmann.scene.splat_clouds.bulk_of`. The bulk tells how wide points are drawn, unless ``width`` says so.
    """
    positions = np.concatenate([cloud.positions for cloud in clouds]).astype(np.float64)
    bulk = bulk_of(positions, np.ones(len(positions)), tails=True)
    if not bulk.any():
        bulk[:] = True
    width = width or width_of_points(positions, float(np.linalg.norm(np.ptp(positions[bulk], axis=0))))
    radii = np.broadcast_to(width.radius, len(positions))
    meshes, first = [], 0
    for cloud in clouds:
        part = slice(first, first + len(cloud.positions))
        first = part.stop
        inside, own = bulk[part], radii[part]
        for chosen, fitted in ((inside, cloud.fitted), (~inside, False)):
            if chosen.any():
                drawn = as_mesh(_select_vertices(cloud, chosen), np.eye(4)[None], own[chosen], cloud.material)
                meshes.append(replace(drawn, fitted=fitted))
    return meshes, width


def draw_thin(thin: Sequence[Mesh], width: Width | None = None) -> tuple[list[Mesh], Width]:
    """Points as by :func:`draw_cloud`, or rods along lines, whose ``faces`` are ``(m, 2)``; and how wide they are."""
    if thin[0].faces.shape[1] == 1:
        return draw_cloud(thin, width)
    positions = np.concatenate([mesh.positions for mesh in thin])
    diagonal = float(np.linalg.norm(np.ptp(positions, axis=0)))
    width = width or width_of_lines(diagonal, sum(len(mesh.faces) for mesh in thin))
    return [as_mesh(mesh, np.eye(4)[None], width.radius, mesh.material) for mesh in thin], width


def describe_cloud(cloud: Mesh, material: Material, notes: Sequence[str]) -> SceneDescription:
    """A scene of points ``(m, 1)`` or lines ``(m, 2)`` alone, which ``faces`` are; unshaded where they have colours.

    Nearly all such points come from scanners, which record the light with the colour.
    """
    thinned, left_out = thin_to_most([cloud])
    meshes, width = draw_thin(thinned)
    material = replace(material, unlit=cloud.colors is not None)
    instances = [Instance(number, np.eye(4)) for number in range(len(meshes))]
    return SceneDescription(cloud.name, meshes, [material], instances, notes=[*notes, *left_out, width.note])


def is_cloud(description: SceneDescription) -> bool:
    """Whether a scene is a cloud of points alone."""
    meshes = [description.meshes[mesh] for mesh in description.placements]
    return bool(meshes) and description.splats is None and all(mesh.points for mesh in meshes)


def crop_cloud(description: SceneDescription, box: NDArray[np.float64]) -> SceneDescription | None:
    """The points of a cloud that lie in a box ``(2, 3)`` of the world, drawn as wide as they need; None if none do."""
    kept = []
    for cloud in _points(description.meshes, description.placements):
        inside = ((cloud.positions >= box[0]) & (cloud.positions <= box[1])).all(axis=1)
        if inside.any():
            kept.append(_select_vertices(cloud, inside))
    if not kept:
        return None
    meshes, width = draw_cloud(kept)
    notes = [width.note if note.startswith(POINTS_NOTE) else note for note in description.notes]
    instances = [Instance(number, np.eye(4)) for number in range(len(meshes))]
    return replace(description, meshes=meshes, instances=instances, notes=notes)


def _points(meshes: Sequence[Mesh], placements: Mapping[int, Matrix]) -> list[Mesh]:
    """The points in the world that meshes of balls stand for: the middle of each ball's vertices."""
    clouds = []
    for number, places in placements.items():
        mesh = meshes[number]
        middles = mesh.positions.reshape(-1, mesh.points, 3).mean(axis=1, dtype=np.float64)
        for place in places:
            cloud = replace(
                mesh,
                positions=transform_points(place, middles).astype(np.float32),
                uvs=tuple(uvs[:: mesh.points] for uvs in mesh.uvs),
                colors=None if mesh.colors is None else mesh.colors[:: mesh.points],
                fitted=True,
            )
            clouds.append(cloud)
    return clouds


def _select_vertices(cloud: Mesh, chosen: NDArray[np.bool_]) -> Mesh:
    return replace(
        cloud,
        positions=cloud.positions[chosen],
        faces=np.arange(np.count_nonzero(chosen), dtype=np.uint32)[:, None],
        normals=None,
        uvs=tuple(uvs[chosen] for uvs in cloud.uvs),
        colors=None if cloud.colors is None else cloud.colors[chosen],
    )
