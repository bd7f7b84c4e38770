"""What of a scene on the device is kept from frame to frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

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


__all__ = ["KeptScene"]
