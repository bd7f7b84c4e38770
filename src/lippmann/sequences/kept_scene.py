"""What of a scene on the device is kept from frame to frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lippmann.runtime.engine import Engine
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import SceneDescription

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene


class KeptScene:
    """Builds scenes as :func:`lippmann.device.pbr.build` does, with what they share with the last one.

    On a turntable, and where a camera flies, shapes stay as they are, and light sources are placed anew. An animation
    keeps its materials and textures. The picture is that of a scene built anew, byte for byte.
    """

    def __init__(self) -> None:
        self._last: tuple[Scene, BuiltScene] | None = None
        self._unknown: Scene | None = None

    def known(self, scene: Scene) -> Scene:
        """The scene that was built last, or the last that was not known, where nothing but cameras is different.

        ``scene`` itself where both are others.
        """
        for before in (None if self._last is None else self._last[0], self._unknown):
            if before is not None and _is_equal(_without_cameras(before), _without_cameras(scene)):
                return before
        self._unknown = scene
        return scene

    def build(self, scene: Scene, engine: Engine, *, memory: int | None = None) -> BuiltScene:
        """The scene on the device; parameters and errors as those of :func:`lippmann.device.pbr.build`."""
        from lippmann.device.pbr import build
        from lippmann.device.pbr.emitters import place_lights, turn_environment

        if self._last is None:
            built = build(scene, engine, memory=memory)
        elif self._last[0] is scene:
            built = self._last[1]
        elif _differs_by_light(self._last[0], scene):
            built = self._last[1]
            environment = scene.environment
            if environment is not None:
                turn_environment(built.mitsuba.environment(), environment.world_from_environment)
            place_lights(built.mitsuba, scene.lights)
        else:
            finishes = self._last[1].finishes if _has_same_materials(self._last[0], scene) else None
            self._last = None  # two scenes may not fit the memory
            built = build(scene, engine, memory=memory, finishes=finishes)
        self._last = scene, built
        return built


def _differs_by_light(one: Scene, other: Scene) -> bool:
    """Whether two scenes are alike but for the places of their light: none that a shape gives, which is built in."""
    return one.physical is other.physical and one.light == other.light and not any(light.radius for light in one.lights)


def _has_same_materials(one: Scene, other: Scene) -> bool:
    """Whether all materials of two scenes are the same objects."""
    before, after = one.physical, other.physical
    if not (isinstance(before, SceneDescription) and isinstance(after, SceneDescription)):
        return False
    if len(before.materials) != len(after.materials) or before.multiple_scattering != after.multiple_scattering:
        return False
    return all(old is new for old, new in zip(before.materials, after.materials, strict=True))


def _without_cameras(scene: Scene) -> Scene:
    description = scene.description
    if not isinstance(description, SceneDescription):
        return scene
    return replace(scene, description=replace(description, cameras=(), notes=()))


def _is_equal(one: Any, other: Any) -> bool:
    """Whether two values are the same, of dataclasses and collections all parts."""
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return bool(np.array_equal(one, other))
    if isinstance(one, Mapping):
        return one.keys() == other.keys() and all(_is_equal(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(_is_equal(*pair) for pair in zip(one, other, strict=True))
    if is_dataclass(one):
        return all(_is_equal(getattr(one, part.name), getattr(other, part.name)) for part in fields(one))
    return bool(one == other)


__all__ = ["KeptScene"]
