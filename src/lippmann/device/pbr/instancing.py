"""Choice between merging the copies of a mesh into one shape and instancing them, by time and memory.

A merged copy takes memory for its triangles; building the acceleration structure over a million of them takes 0.7 s.
An instance takes almost no memory but is a shape of its own for Mitsuba: every kernel launch pays for all shapes, and
more than proportionally. On two cores 20 instances cost 0.02 s a launch, 200 cost 1.4 s and 800 cost 18 s, and
compiling the first kernel takes twice as long. Copies are therefore merged, unless they are few and large or their
merged triangles would not fit the memory.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import TypeVar

from lippmann.errors import SceneError
from lippmann.runtime.machine import amount_in_words

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
