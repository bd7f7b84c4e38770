"""A glTF file that moves: its scene at any moment of one of its animations."""

from __future__ import annotations

import difflib
from pathlib import Path

from lippmann.errors import SceneError
from lippmann.scene.readers.gltf.document import check_extensions, open_document
from lippmann.scene.readers.gltf.json_fields import Fields
from lippmann.scene.readers.gltf.reader import Contents
from lippmann.scene.readers.gltf_animation.keyframes import Animation, Floats, Target, read_animations
from lippmann.scene.values.description import SceneDescription


class MovingGltf:
    """The file, opened once; bytes, pictures and meshes that stay the same are kept from moment to moment.

    Parameters
    ----------
    animation:
        Its name, or ``None`` for the first one.
    allow_outside:
        Let the file name buffers and images outside its own folder.

    Attributes
    ----------
    animation:
        The one that is played.

    Raises
    ------
    SceneError
        As :func:`lippmann.scene.readers.gltf.read_gltf`, and where the file has no (such) animation.
    """

    def __init__(self, path: Path, *, animation: str | None = None, allow_outside: bool = False) -> None:
        document = open_document(path, allow_outside=allow_outside)
        check_extensions(document)
        self._name = path.stem
        self._contents = Contents.of(document)
        self._at_rest = document.all("nodes")
        self.animation = _chosen(read_animations(document, self._contents.accessors), animation, document.file)
        known = len(document.root.children("animations"))
        if known > 1 and animation is None:
            document.notes.add(f"of {known} animations '{self.animation.name}' is played")

    @property
    def content(self) -> object:
        """All that the animation is made of, as plain values; pictures beside the file are in the scene itself."""
        return self._contents.document.root.values, self._contents.accessors.buffers.all(), self.animation.name

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
            nodes[target[0]] = _moved(nodes[target[0]], target, value)
        self._contents = self._contents.posed(nodes)
        return self._contents.description(self._name)


def _moved(node: Fields, target: Target, value: Floats) -> Fields:
    return Fields({**node.values, target[1]: value.tolist()}, node.place, node.file)


def _chosen(animations: tuple[Animation, ...], name: str | None, file: str) -> Animation:
    if not animations:
        raise SceneError("the file has no animation", where=file, fix="leave frames=... out")
    if name is None:
        return animations[0]
    for animation in animations:
        if animation.name == name:
            return animation
    known = [animation.name for animation in animations]
    close = difflib.get_close_matches(name, known, n=1)
    raise SceneError(
        f"no animation is named '{name}'",
        where=file,
        rule=f"the file has {', '.join(repr(one) for one in known)}",
        fix=f"is '{close[0]}' meant?" if close else "",
    )
