"""The scene that a command names, with what its options say of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lippmann.scene.light_options import LightOptions
    from lippmann.scene.readers.load import Up
    from lippmann.scene.scene import Scene
    from lippmann.scene.splat_selection import Crop


@dataclass(frozen=True)
class SceneSource:
    """A scene's file or name, and the options that change what is read of it."""

    name: str
    environment: Path | None = None
    background: tuple[float, float, float] | None = None
    allow_outside: bool = False
    single_scattering: bool = False
    up: Up | None = None
    crop: Crop | None = None
    unit_scale: float | None = None
    min_opacity: float | None = None
    light: LightOptions | None = None
    variants: Mapping[str, str] | None = None
    depth_map: Path | None = None
    transfer_function: str | None = None
    window: tuple[float, float] | None = None
    series: str | None = None

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
            crop=self.crop,
            unit_scale=self.unit_scale,
            min_opacity=self.min_opacity,
            light=self.light,
            variants=self.variants,
            depth_map=self.depth_map,
            transfer_function=self.transfer_function,
            window=self.window,
            series=self.series,
        )
