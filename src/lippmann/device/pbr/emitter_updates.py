"""Light of a built scene as data: its direction and strength change without another kernel."""

from __future__ import annotations

from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.device.pbr.emitters import active_lights, environment_to_world
from lippmann.options.light import LightOptions
from lippmann.scene.scene import Scene, change_source, light_rotation
from lippmann.scene.values.description import Light, Matrix

if TYPE_CHECKING:
    from lippmann.device.pbr import BuiltScene
    from lippmann.device.types import Emitter

#: Parameters of Mitsuba's emitters that hold how much light they give.
_STRENGTHS = ("intensity.value", "irradiance.value", "radiance.value")


class EmitterUpdates:
    """Turns and scales the light of a built scene.

    Parameters
    ----------
    scene, built:
        A scene without changes to its light, and what was built of it.
    """

    def __init__(self, scene: Scene, built: BuiltScene) -> None:
        self._environment = scene.environment
        emitter = built.mitsuba.environment() if self._environment is not None else None
        self._surroundings = None if emitter is None else _Emitter(emitter)
        by_name = {_name(emitter): emitter for emitter in built.mitsuba.emitters()}
        self._sources = [
            (light, _Emitter(by_name[f"light_{number}"])) for number, light in enumerate(active_lights(scene.lights))
        ]
        self._last = LightOptions()

    def can_apply(self, light: LightOptions) -> bool:
        """Whether ``light`` is data: spots with a radius keep the strength that they were built with."""
        return light.light_strength == 1.0 or all(source.has_strength for _, source in self._sources)

    def apply(self, light: LightOptions, world_from_viewer: Matrix) -> None:
        """Set the light, which may follow the viewer, whose axes ``world_from_viewer`` ``(4, 4)`` tells."""
        environment = self._environment
        if environment is not None and self._surroundings is not None:
            viewer = world_from_viewer if environment.follows_viewer else np.eye(4)
            placed = viewer @ light_rotation(light) @ environment.world_from_environment
            self._surroundings.scale(light.environment_strength)
            self._surroundings.place(environment_to_world(placed))
        if (light.light_turn, light.light_strength) != (self._last.light_turn, self._last.light_strength):
            for original, emitter in self._sources:
                emitter.scale(light.light_strength)
                if original.kind == "directional":
                    emitter.place(_directional_frame(change_source(original, light)))
        self._last = light


class _Emitter:
    """The parameters of an emitter."""

    def __init__(self, emitter: Emitter) -> None:
        self._parameters = mi.traverse(emitter)
        self._key = next((key for key in _STRENGTHS if key in self._parameters), None)
        self._color = mi.Color3f(0.0 if self._key is None else self._parameters[self._key])

    @property
    def has_strength(self) -> bool:
        """Whether the emitter's strength is a parameter."""
        return self._key is not None

    def scale(self, factor: float) -> None:
        """Give ``factor`` times the light that the emitter was built with."""
        if self._key is not None:
            self._set(self._key, self._color * dr.opaque(mi.Float, factor))
        elif "scale" in self._parameters:
            self._set("scale", dr.opaque(mi.Float, factor))

    def place(self, to_world: Matrix) -> None:
        """Turn the emitter, if it has a direction."""
        if "to_world" not in self._parameters:
            return
        # Each number by itself: of equal ones the compiler would make one, and another kernel where they differ.
        rows = [[dr.opaque(mi.Float, value) for value in row] for row in np.asarray(to_world).tolist()]
        self._set("to_world", mi.Transform4f(mi.Matrix4f(rows)))

    def _set(self, key: str, value: object) -> None:
        # Constants of a kernel would need another one for each value.
        dr.make_opaque(value)
        self._parameters[key] = value
        self._parameters.update()


def _name(emitter: Emitter) -> str:
    """The builder's name for an emitter, or for the sphere that it makes shine."""
    shape = emitter.get_shape()
    return str(emitter.id() if shape is None else shape.id())


def _directional_frame(light: Light) -> Matrix:
    """A ``to_world`` whose z axis lies along the light."""
    axis = -np.asarray(light.world_from_light, np.float64)[:3, 2]
    axis /= np.linalg.norm(axis)
    x = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    x /= np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3, :3] = np.stack([x, np.cross(axis, x), axis], axis=1)
    return frame
