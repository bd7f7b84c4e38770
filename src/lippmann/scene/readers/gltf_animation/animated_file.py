"""Animated glTF files: the scene at any time of one of the animations."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from lippmann.errors import SceneError
from lippmann.scene.parsing.files import NamedFiles
from lippmann.scene.readers.gltf.document import check_extensions, open_document
from lippmann.scene.readers.gltf.json_fields import Fields
from lippmann.scene.readers.gltf.points_lines import has_points_or_lines
from lippmann.scene.readers.gltf.reader import Contents
from lippmann.scene.readers.gltf_animation.keyframes import Animation, Floats, Target, read_animations
from lippmann.scene.values.description import SceneDescription


class MovingGltf:
    """An animated glTF file, opened once; bytes, images and meshes that do not change are shared by all times.

    Parameters
    ----------
    animation:
        Its name, or ``None`` for the first one.
    files, variants:
        As of :func:`lippmann.scene.readers.gltf.read_gltf`.

    Attributes
    ----------
    animation:
        The animation that is played.

    Raises
    ------
    SceneError
        As :func:`lippmann.scene.readers.gltf.read_gltf`, and where the file has no (such) animation.
    """

    def __init__(
        self,
        path: Path,
        *,
        animation: str | None = None,
        files: NamedFiles | None = None,
        variants: Mapping[str, str] | None = None,
    ) -> None:
        document = open_document(path, files=files, variants=variants)
        check_extensions(document)
        self._name = path.stem
        self._contents = Contents.of(document)
        self._at_rest = document.all("nodes")
        if has_points_or_lines(document):
            # The scene at rest says how wide they are. What else is wrong with it is told of the times asked for.
            with suppress(SceneError):
                self._contents.description(self._name)
        self.animation = _choose(read_animations(document, self._contents.accessors), animation, document.file)
        known = len(document.root.children("animations"))
        if known > 1 and animation is None:
            document.notes.add(f"of {known} animations '{self.animation.name}' is played")

    @property
    def content(self) -> object:
        """All values that the animation depends on, but for image files, which belong to the scene."""
        document = self._contents.document
        return document.root.values, document.variant, self._contents.accessors.buffers.all(), self.animation.name

    @property
    def duration(self) -> float:
        """Seconds from time 0 to the animation's last key."""
        return self.animation.duration

    def at(self, seconds: float) -> SceneDescription:
        """The scene at a time; after the last key it stands still.

        Raises
        ------
        SceneError
            As :func:`lippmann.scene.readers.gltf.read_gltf`.
        """
        nodes = list(self._at_rest)
        for target, value in self.animation.at(seconds).items():
            nodes[target[0]] = _replace_value(nodes[target[0]], target, value)
        self._contents = self._contents.pose(nodes)
        return self._contents.description(self._name)


def _replace_value(node: Fields, target: Target, value: Floats) -> Fields:
    return Fields({**node.values, target[1]: value.tolist()}, node.place, node.file)


def _choose(animations: tuple[Animation, ...], name: str | None, file: str) -> Animation:
    if not animations:
        raise SceneError("the file has no animation", where=file, fix="leave frames=... out")
    if name is None:
        return animations[0]
    for animation in animations:
        if animation.name == name:
            return animation
    raise SceneError.unknown("animation", name, [animation.name for animation in animations], where=file)
