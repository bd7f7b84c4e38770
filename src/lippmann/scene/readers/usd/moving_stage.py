"""Stages with time samples: the scene at any time."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.parsing.files import NamedFiles
from lippmann.scene.readers.usd.assets import Assets
from lippmann.scene.readers.usd.process import ask_stage
from lippmann.scene.readers.usd.reader import check_file, describe
from lippmann.scene.readers.usd.records import Record
from lippmann.scene.values.description import SceneDescription

Stored = Sequence[NDArray[np.generic]]


class MovingStage:
    """A stage with time samples; its pictures are decoded once.

    Parameters
    ----------
    animation:
        None: a stage has one timeline, without a name.
    files, variants:
        As of :func:`lippmann.scene.readers.usd.reader.read_usd`.

    Raises
    ------
    SceneError
        As :func:`lippmann.scene.readers.usd.reader.read_usd`, and where the stage names no range of time codes.
    """

    def __init__(
        self,
        path: Path,
        *,
        animation: str | None = None,
        files: NamedFiles | None = None,
        variants: Mapping[str, str] | None = None,
    ) -> None:
        if animation is not None:
            raise SceneError(
                "a USD stage has one timeline", where=path.name, rule="it has no name", fix="leave animation=... out"
            )
        check_file(path)
        self._path = path
        self._variants = dict(variants or {})
        self._named = NamedFiles(path.resolve().parent, NamedFiles.of(path, files).anywhere)
        self._assets = Assets(path, self._named)
        tree, _ = self._ask(0.0)
        if tree["duration"] <= 0.0:
            raise SceneError(
                "the stage has no range of time codes",
                where=path.name,
                rule="startTimeCode and endTimeCode say when it moves",
                fix="leave frames=... out",
            )
        self.duration: float = tree["duration"]
        self._files: list[str] = tree["files"]

    @property
    def content(self) -> object:
        """All that the stage depends on, but for image files, which belong to the scene."""
        digests = [hashlib.sha256(Path(file).read_bytes()).hexdigest() for file in self._files]
        return digests, sorted(self._variants.items())

    def at(self, seconds: float) -> SceneDescription:
        """The scene at a time; after the last time code it stands still.

        Raises
        ------
        SceneError
            As :func:`lippmann.scene.readers.usd.reader.read_usd`.
        """
        tree, arrays = self._ask(min(max(seconds, 0.0), self.duration))
        return describe(tree, arrays, self._path, self._assets)

    def _ask(self, seconds: float) -> tuple[Record, Stored]:
        return ask_stage(self._path, self._variants, seconds, self._named)
