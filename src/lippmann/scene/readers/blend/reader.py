"""Reader of Blender files: a scene is exported by Blender, and read by the glTF reader."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from lippmann.errors import MemoryLimitError, SceneError
from lippmann.runtime.atomic_write import scratch_folder
from lippmann.scene.parsing.files import NamedFiles
from lippmann.scene.readers.blend.export import Exported, export
from lippmann.scene.readers.environment_map import read_environment
from lippmann.scene.readers.gltf import read_gltf
from lippmann.scene.values.description import Environment, SceneDescription


def read_blend(path: Path, *, files: NamedFiles | None = None) -> SceneDescription:
    """Read the scene of a ``.blend`` file at its present frame.

    Lengths are metres, as the file's unit scale has them. Lights keep the brightness that they have in Blender.

    Parameters
    ----------
    files:
        Those that it may name; by default those of its folder and below.

    Raises
    ------
    SceneError
        See :func:`lippmann.scene.readers.blend.export.export`; nothing is to be seen.
    MemoryLimitError
        It takes more memory than is left.
    """
    with export_file(path, files) as made:
        return complete(read_gltf(made.scene), made, path.stem, read_world(made))


@contextmanager
def export_file(path: Path, files: NamedFiles | None, *, is_animated: bool = False) -> Iterator[Exported]:
    """The files that Blender wrote, which are gone afterwards; errors within are the Blender file's."""
    with scratch_folder("lippmann-blend-") as folder:
        made = export(path, Path(folder), NamedFiles.of(path, files), is_animated=is_animated)
        try:
            yield made
        except (SceneError, MemoryLimitError) as error:
            raise type(error)(error.what, where=path.name, rule=error.rule, fix=error.fix) from None


def read_world(files: Exported) -> Environment | None:
    """The light of Blender's world."""
    return None if files.world is None else replace(read_environment(files.world), name="world")


def complete(description: SceneDescription, files: Exported, name: str, world: Environment | None) -> SceneDescription:
    """A scene of the GLB file, with what the file cannot say: the active camera comes first."""
    cameras = sorted(description.cameras, key=lambda camera: camera.name != files.camera)
    notes = [*files.notes, *description.notes]
    if files.exposure:
        notes.append(
            f"the file raises its pictures by {files.exposure:g} stops: exposure={files.exposure:g} does so here"
        )
    return replace(
        description,
        name=name,
        cameras=tuple(cameras),
        environment=world,
        notes=tuple(notes),
        # Lights are balanced for Blender's exposure of 0 already.
        physical_lights=False,
    )
