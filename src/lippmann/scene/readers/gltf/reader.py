"""Reader of glTF files: a document becomes a scene description."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.parsing.files import NamedFiles
from lippmann.scene.readers.gltf.accessors import Accessors
from lippmann.scene.readers.gltf.buffers import Buffers
from lippmann.scene.readers.gltf.cameras_lights import read_camera, read_light
from lippmann.scene.readers.gltf.document import Document, check_extensions, open_document
from lippmann.scene.readers.gltf.json_fields import Fields
from lippmann.scene.readers.gltf.materials import Materials
from lippmann.scene.readers.gltf.meshes import Meshes
from lippmann.scene.readers.gltf.nodes import Nodes, instance_matrices, ranks
from lippmann.scene.readers.gltf.points_lines import ThinWidth, draw_points_and_lines
from lippmann.scene.readers.gltf.primitives import Primitives
from lippmann.scene.readers.gltf.skinning import read_skin
from lippmann.scene.readers.gltf.splats import SplatClouds
from lippmann.scene.readers.gltf.textures import Textures
from lippmann.scene.values.description import Camera, Instance, Light, Matrix, Mesh, SceneDescription

# A few nodes that repeat one list of copies could otherwise ask for all the memory there is.
_MOST_INSTANCES = 1 << 21


def read_gltf(
    path: Path, *, files: NamedFiles | None = None, variants: Mapping[str, str] | None = None
) -> SceneDescription:
    """Read the default scene of a ``.gltf`` or ``.glb`` file as it stands at rest.

    Parameters
    ----------
    files:
        Those that it may name; by default those of its folder and below.
    variants:
        ``{"materials": NAME}`` chooses a material variant (KHR_materials_variants).

    Raises
    ------
    UsageError
        There is no such variant.
    SceneError
        The file, or one that it names, is missing, damaged or beyond its bounds; it requires an extension that is not
        understood; it holds nothing to see.
    """
    document = open_document(path, files=files, variants=variants)
    check_extensions(document)
    if document.root.children("animations"):
        document.notes.add("animations are not played without frames=...; the scene is shown at rest")
    return Contents.of(document).description(path.stem)


@dataclass(frozen=True, eq=False)
class _Placements:
    """Copies of one mesh (a place in the list of meshes) at ``worlds`` ``(k, 4, 4)``, shown by ``node``."""

    mesh: int
    worlds: Matrix
    node: Fields


@dataclass(frozen=True, eq=False)
class Contents:
    """The content of a file: data that is read once (bytes, materials), and the objects that its nodes place."""

    document: Document
    accessors: Accessors
    nodes: Nodes
    meshes: Meshes
    splats: SplatClouds
    placements: list[_Placements] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    cameras: list[Camera] = field(default_factory=list)
    thin_width: ThinWidth = field(default_factory=ThinWidth)

    @classmethod
    def of(cls, document: Document) -> Contents:
        """Contents of a file at rest."""
        buffers = Buffers(document)
        accessors = Accessors(document, buffers)
        materials = Materials(document, Textures(document, buffers))
        meshes = Meshes(document, Primitives(document, accessors), materials)
        return cls(document, accessors, Nodes(document), meshes, SplatClouds(document, accessors))

    def pose(self, nodes: list[Fields]) -> Contents:
        """Contents of the same file with other ``nodes``; bytes, materials and meshes without skin are shared."""
        document = self.document.with_nodes(nodes)
        meshes = self.meshes.pose(document, Primitives(document, self.accessors))
        splats = SplatClouds(document, self.accessors)
        return Contents(document, self.accessors, Nodes(document), meshes, splats, thin_width=self.thin_width)

    def description(self, name: str) -> SceneDescription:
        """The scene that the nodes make; to be asked for once.

        Raises
        ------
        SceneError
            See :func:`read_gltf`.
        """
        for index, visible in self.nodes.traverse():
            self._add(index, visible=visible)
        meshes, instances = _instantiate(self.meshes.read, self.placements, self.thin_width, self.document)
        splats = self.splats.join()
        if not instances and splats is None:
            raise self.document.error(
                "the file shows no triangles, lines, points or splats",
                rule="a scene needs a mesh on a node of its default scene",
            )
        return SceneDescription(
            name=name,
            meshes=meshes,
            materials=tuple(self.meshes.materials.read),
            instances=instances,
            lights=tuple(self.lights),
            physical_lights=bool(self.lights),
            cameras=tuple(self.cameras),
            notes=self.document.notes.lines(),
            splats=splats,
        )

    def _add(self, index: int, *, visible: bool) -> None:
        """Take over what ``nodes[index]`` carries; of an invisible node, its camera alone."""
        node = self.document.all("nodes")[index]
        world = self.nodes.world(index)
        camera = self.document.reference(node, "camera", "cameras")
        if camera is not None:
            self.cameras.append(read_camera(self.document.all("cameras")[camera], node, world))
        if not visible:
            return
        light = read_light(node, world, self.document)
        if light is not None:
            self.lights.append(light)
        mesh = self.document.reference(node, "mesh", "meshes")
        if mesh is not None:
            self._add_mesh(mesh, node, world)

    def _add_mesh(self, mesh: int, node: Fields, world: Matrix) -> None:
        skin_index = self.document.reference(node, "skin", "skins")
        if skin_index is None:
            copies = instance_matrices(node, self.document, self.accessors)
            worlds = world[None] if len(copies) == 1 and (copies[0] == _IDENTITY).all() else world @ copies
            places = self.meshes.places(mesh, node, None)
            self.splats.add(self.document.all("meshes")[mesh], worlds)
        else:
            # A skin places its mesh in the world by itself, whatever the node's own transformation (section 3.7.3.3).
            worlds = np.eye(4)[None]
            skin = read_skin(skin_index, self.document, self.accessors, self.nodes)
            places = self.meshes.places(mesh, node, skin)
        self.placements.extend(_Placements(place, worlds, node) for place in places)


_IDENTITY = np.eye(4)


def _instantiate(
    meshes: list[Mesh], placements: list[_Placements], thin_width: ThinWidth, document: Document
) -> tuple[tuple[Mesh, ...], tuple[Instance, ...]]:
    """Meshes and their instances.

    A matrix that flattens its mesh cannot be inverted, which renderers do; that mesh gets a flattened copy instead.
    Points and lines become solids in the world.
    """
    _check_count(placements, document)
    _check_reach(meshes, placements, document)
    copies: list[Mesh] = []
    instances: list[Instance] = []
    triangles = [placement for placement in placements if meshes[placement.mesh].faces.shape[1] == 3]
    for placement, copy_ranks in zip(triangles, _ranks(triangles), strict=True):
        if len(copy_ranks) == 1 and copy_ranks[0] == 3:  # as nearly all are
            instances.append(Instance(placement.mesh, placement.worlds[0]))
            continue
        solid = copy_ranks == 3
        if solid.any():
            worlds = placement.worlds if solid.all() else placement.worlds[solid]
            instances.append(Instance(placement.mesh, worlds[0] if len(worlds) == 1 else worlds))
        for world, rank in zip(placement.worlds[~solid], copy_ranks[~solid], strict=True):
            if rank == 2:
                instances.append(Instance(len(meshes) + len(copies), np.eye(4)))
                copies.append(_flatten(meshes[placement.mesh], world))
            else:
                document.notes.add("a mesh that is scaled to nothing is left out", placement.node.place)
    worlds = [(placement.mesh, placement.worlds) for placement in placements]
    drawn = draw_points_and_lines(meshes, worlds, thin_width, document)
    instances += [Instance(mesh, np.eye(4)) for mesh, solids in drawn.items() if len(solids.faces)]
    return (*(drawn.get(index, mesh) for index, mesh in enumerate(meshes)), *copies), tuple(instances)


def _check_reach(meshes: list[Mesh], placements: list[_Placements], document: Document) -> None:
    if not placements:
        return
    reaches = np.array([np.abs(mesh.positions).max(axis=0).astype(np.float64) for mesh in meshes])
    worlds = np.abs(np.concatenate([placement.worlds for placement in placements]))
    counts = [len(placement.worlds) for placement in placements]
    reach = np.repeat(reaches[[placement.mesh for placement in placements]], counts, axis=0)
    farthest = np.einsum("kij,kj->ki", worlds[:, :3, :3], reach) + worlds[:, :3, 3]
    beyond = (farthest > np.finfo(np.float32).max).any(axis=1)
    if beyond.any():
        first = placements[int(np.searchsorted(np.cumsum(counts), np.argmax(beyond), side="right"))]
        raise document.error(f"{first.node.place} puts its mesh beyond all bounds", rule="positions must be finite")


def _check_count(placements: list[_Placements], document: Document) -> None:
    counts = np.array([len(placement.worlds) for placement in placements], np.int64)
    if counts.sum() > _MOST_INSTANCES:
        first = placements[int(np.argmax(np.cumsum(counts) > _MOST_INSTANCES))]
        raise document.error(
            f"{first.node.place} brings the copies of meshes to more than {_MOST_INSTANCES}",
            rule="so many may be placed",
        )


def _ranks(placements: list[_Placements]) -> list[NDArray[np.int64]]:
    """Ranks of all matrices, in one call because many single ones are slow."""
    if not placements:
        return []
    ends = np.cumsum([len(placement.worlds) for placement in placements])
    return np.split(ranks(np.concatenate([placement.worlds for placement in placements])), ends[:-1])


def _flatten(mesh: Mesh, world: Matrix) -> Mesh:
    """The mesh in world coordinates."""
    positions = (mesh.positions @ world[:3, :3].T + world[:3, 3]).astype(np.float32)
    return replace(mesh, positions=positions, normals=None, tangents=None)
