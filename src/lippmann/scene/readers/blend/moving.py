"""Moving scenes of Blender: the frames of the scene's range as one animation."""

from __future__ import annotations

from pathlib import Path

from lippmann.scene.parsing.files import NamedFiles
from lippmann.scene.readers.blend.reader import complete, export_file, read_world
from lippmann.scene.readers.gltf_animation.animated_file import MovingGltf
from lippmann.scene.values.description import SceneDescription


class MovingBlend:
    """The scene of a ``.blend`` file at any time; time 0 is the first frame of its range.

    Parameters
    ----------
    animation, files:
        As of :class:`lippmann.scene.readers.gltf_animation.animated_file.MovingGltf`.

    Raises
    ------
    SceneError
        As :func:`lippmann.scene.readers.blend.read_blend`, and where nothing moves.
    """

    def __init__(self, path: Path, *, animation: str | None = None, files: NamedFiles | None = None) -> None:
        self._name = path.stem
        with export_file(path, files, is_animated=True) as made:
            self._files = made
            self._world = read_world(made)
            self._moving = MovingGltf(made.scene, animation=animation)

    @property
    def content(self) -> object:
        """All values that the frames depend on."""
        return self._moving.content, self._world

    @property
    def duration(self) -> float:
        """Seconds from the first frame to the last."""
        return self._moving.duration

    def at(self, seconds: float) -> SceneDescription:
        """The scene at a time; after the last frame it stands still.

        Raises
        ------
        SceneError
            Nothing is to be seen.
        """
        return complete(self._moving.at(seconds), self._files, self._name, self._world)
