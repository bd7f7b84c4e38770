"""A glTF file into a scene description."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.description import Camera, Instance, Light, Matrix, Mesh, SceneDescription
from lippmann.scene.gltf.accessors import Accessors
from lippmann.scene.gltf.buffers import Buffers
from lippmann.scene.gltf.document import Document, open_document
from lippmann.scene.gltf.extensions import check_extensions
from lippmann.scene.gltf.fields import Fields
from lippmann.scene.gltf.materials import Materials
from lippmann.scene.gltf.meshes import Meshes
from lippmann.scene.gltf.nodes import Nodes, instance_matrices
from lippmann.scene.gltf.primitives import Primitives
from lippmann.scene.gltf.skins import read_skin
from lippmann.scene.gltf.textures import Textures
from lippmann.scene.gltf.transforms import ranks
from lippmann.scene.gltf.viewpoints import read_camera, read_light

# A few nodes that repeat one list of copies could otherwise ask for all the memory there is.
_MOST_INSTANCES = 1 << 21


def read_gltf(path: Path, *, allow_outside: bool = False) -> SceneDescription:
    """Read the default scene of a ``.gltf`` or ``.glb`` file as it stands at rest.

    Parameters
    ----------
    allow_outside:
        Let the file name buffers and images outside its own folder.

    Raises
    ------
    SceneError
        The file, or one that it names, is missing, damaged or beyond its bounds; it requires an extension that is not
        understood; it holds no triangles.
    """
    document = open_document(path, allow_outside=allow_outside)
    check_extensions(document)
    if document.root.children("animations"):
        document.notes.add("animations are not played; the scene is shown at rest")
    contents = _Contents.of(document)
    for index, visible in contents.nodes.shown():
        contents.add(index, visible=visible)
    if not contents.instances:
        raise document.error("the file shows no triangles", rule="a scene needs a mesh on a node of its default scene")
    return SceneDescription(
        name=path.stem,
        meshes=tuple(contents.meshes.read),
        materials=tuple(contents.meshes.materials.read),
        instances=tuple(contents.instances),
        lights=tuple(contents.lights),
        cameras=tuple(contents.cameras),
        notes=document.notes.lines(),
    )


@dataclass(frozen=True, eq=False)
class _Contents:
    """What the nodes walked so far hold."""

    document: Document
    accessors: Accessors
    nodes: Nodes
    meshes: Meshes
    instances: list[Instance] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    cameras: list[Camera] = field(default_factory=list)
    _bounds: dict[int, NDArray[np.float64]] = field(default_factory=dict)

    @classmethod
    def of(cls, document: Document) -> _Contents:
        buffers = Buffers(document)
        accessors = Accessors(document, buffers)
        materials = Materials(document, Textures(document, buffers))
        meshes = Meshes(document, Primitives(document, accessors), materials)
        return cls(document, accessors, Nodes(document), meshes)

    def add(self, index: int, *, visible: bool) -> None:
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
            with np.errstate(over="ignore", invalid="ignore"):
                worlds = world @ instance_matrices(node, self.document, self.accessors)
            places = self.meshes.places(mesh, node, None)
        else:
            # A skin places its mesh in the world by itself, whatever the node's own transformation (section 3.7.3.3).
            worlds = np.eye(4)[None]
            skin = read_skin(skin_index, self.document, self.accessors, self.nodes)
            places = self.meshes.places(mesh, node, skin)
        if len(self.instances) + len(places) * len(worlds) > _MOST_INSTANCES:
            raise self.document.error(
                f"{node.place} brings the copies of meshes to more than {_MOST_INSTANCES}", rule="so many may be placed"
            )
        for place in places:
            self._check_reach(place, worlds, node)
            self._place(place, worlds, node)

    def _check_reach(self, place: int, worlds: Matrix, node: Fields) -> None:
        """Refuse placements that lead out of single precision."""
        if place not in self._bounds:
            positions = self.meshes.read[place].positions
            low, high = positions.min(axis=0), positions.max(axis=0)
            corners = np.stack(np.meshgrid(*np.stack([low, high], axis=1), indexing="ij"), axis=-1).reshape(8, 3)
            self._bounds[place] = np.column_stack([corners, np.ones(8)]).astype(np.float64)
        with np.errstate(over="ignore", invalid="ignore"):
            reached = (worlds @ self._bounds[place].T).astype(np.float32)
        if not np.isfinite(reached).all():
            raise self.document.error(
                f"{node.place} places its mesh beyond all bounds", rule="positions must be finite"
            )

    def _place(self, place: int, worlds: Matrix, node: Fields) -> None:
        for world, rank in zip(worlds, ranks(worlds), strict=True):
            if rank == 3:
                self.instances.append(Instance(place, world))
            elif rank == 2:
                # A flattening matrix cannot be inverted, which renderers do; its mesh is flattened here instead.
                self.instances.append(Instance(len(self.meshes.read), np.eye(4)))
                self.meshes.read.append(_flattened(self.meshes.read[place], world))
            else:
                self.document.notes.add("a mesh that is scaled to nothing is left out", node.place)


def _flattened(mesh: Mesh, world: Matrix) -> Mesh:
    positions = (mesh.positions @ world[:3, :3].T + world[:3, 3]).astype(np.float32)
    return replace(mesh, positions=positions, normals=None)
