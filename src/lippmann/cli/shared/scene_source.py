"""The scene that a command names, with what its options say of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lippmann.options.light import LightOptions
from lippmann.options.outputs import AccessOptions
from lippmann.options.scene import SceneOptions

if TYPE_CHECKING:
    from lippmann.scene.scene import Scene


@dataclass(frozen=True)
class SceneSource:
    """A scene's file or name, and the options that change what is read of it."""

    name: str
    asked: SceneOptions
    light: LightOptions
    access: AccessOptions

    def load(self) -> Scene:
        """The scene.

        Raises
        ------
        SceneError
            As :func:`lippmann.load_scene`.
        """
        from lippmann.scene.readers.load import read_scene

        return read_scene(self.name, self.asked, self.light, allow_outside=self.access.allow_outside)
