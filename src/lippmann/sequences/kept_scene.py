"""The scene on the device, kept from frame to frame where nothing moves but the display and light from far away."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lippmann.runtime.engine import Engine
from lippmann.scene.scene import Scene

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene


class KeptScene:
    """Builds scenes as :func:`lippmann.device.pbr.build` does, or turns the light of the last one.

    On a turntable, and where a camera flies, shapes, materials and textures stay as they are. The picture is that of a
    scene built anew, byte for byte.
    """

    def __init__(self) -> None:
        self._last: tuple[Scene, BuiltScene] | None = None

    def build(self, scene: Scene, engine: Engine, *, memory: int | None = None) -> BuiltScene:
        """The scene on the device; parameters and errors as those of :func:`lippmann.device.pbr.build`."""
        from lippmann.device.pbr import build
        from lippmann.device.pbr.emitters import turn_environment

        if self._last is not None and _differs_by_far_light(self._last[0], scene):
            built = self._last[1]
            if scene.environment is not None:
                turn_environment(built.mitsuba.environment(), scene.environment.world_from_environment)
        else:
            self._last = None  # two scenes may not fit the memory
            built = build(scene, engine, memory=memory)
        self._last = scene, built
        return built


def _differs_by_far_light(one: Scene, other: Scene) -> bool:
    """Whether two scenes are alike but for the direction of their surroundings.

    Light sources have places, which a scene on the device keeps.
    """
    if one is other:
        return True
    return one.physical is other.physical and one.light == other.light and not one.lights


__all__ = ["KeptScene"]
