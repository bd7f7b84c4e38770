"""A classic scene made ready for the device."""

from __future__ import annotations

import time
from dataclasses import dataclass

from lippmann.device.types import Color3f, Point3f, Vector3f
from lippmann.device.whitted.background_fog import background_color
from lippmann.device.whitted.geometry import Geometry
from lippmann.device.whitted.materials import MaterialTable
from lippmann.device.whitted.shading import LightTable, Shader
from lippmann.device.whitted.textures import TextureTable
from lippmann.runtime.engine_lock import EngineOwner
from lippmann.scene.values.whitted_scene import ClassicScene


@dataclass(frozen=True, eq=False)
class BuiltClassic(EngineOwner):
    """The parts of a classic scene on the device; ``seconds`` is what making them took."""

    scene: ClassicScene
    geometry: Geometry
    materials: MaterialTable
    textures: TextureTable
    lights: LightTable
    shader: Shader
    seconds: float

    def background_color(self, o: Point3f, d: Vector3f) -> Color3f:
        """Colour of the background for rays from ``o`` along ``d``."""
        return background_color(self.scene.background, o, d)


def build_classic(scene: ClassicScene) -> BuiltClassic:
    """Make the tables and hierarchies of a scene, under the variant that runs."""
    started = time.perf_counter()
    textures = TextureTable(scene.materials, scene.images)
    materials = MaterialTable(scene.materials, textures.numbers)
    geometry = Geometry(scene)
    lights = LightTable(scene.lights)
    shader = Shader(scene, geometry, lights, materials)
    return BuiltClassic(scene, geometry, materials, textures, lights, shader, time.perf_counter() - started)
