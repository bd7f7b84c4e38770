"""The scene that a command names, with what its options say of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lippmann.scene.readers.load import Up
    from lippmann.scene.scene import Scene


@dataclass(frozen=True)
class SceneSource:
    """A scene's file or name, and the options that change what is read of it."""

    name: str
    environment: Path | None = None
    background: tuple[float, float, float] | None = None
    allow_outside: bool = False
    single_scattering: bool = False
    up: Up | None = None
    variants: Mapping[str, str] | None = None
    depth_map: Path | None = None

    def load(self) -> Scene:
        """The scene.

        Raises
        ------
        SceneError
            As :func:`lippmann.load_scene`.
        """
        from lippmann.api import load_scene

        return load_scene(
            self.name,
            environment=self.environment,
            background=self.background,
            allow_outside=self.allow_outside,
            multiple_scattering=not self.single_scattering,
            up=self.up,
            variants=self.variants,
            depth_map=self.depth_map,
        )
