"""The teapot for the classic light models: polished copper under two lights, on the geometry of :mod:`.teapot`."""

from __future__ import annotations

from lippmann.scene.bundled.teapot import LAYOUT, NAME, STAGE, pot_from_newell, tessellate, tiles
from lippmann.scene.values.whitted_scene import ClassicScene
from lippmann.scene.values.whitted_surfaces import Background, ClassicLight, ClassicMaterial
from lippmann.scene.whitted.builder import ClassicSceneBuilder

GLAZE = ClassicMaterial(
    color=(0.76, 0.44, 0.26), ambient=0.08, diffuse=0.62, specular=0.28, phong=0.45, phong_size=22.0, phong_kind="metal"
)
LIGHT_TILE = ClassicMaterial(color=(0.92, 0.92, 0.90), ambient=0.08, diffuse=0.45, specular=0.5)
DARK_TILE = ClassicMaterial(color=(0.10, 0.14, 0.25), ambient=0.08, diffuse=0.45, specular=0.5)
LIGHTS = (
    ClassicLight("point", (0.84, 0.81, 0.76), center=(-150.0, 210.0, 190.0)),
    ClassicLight("point", (0.50, 0.53, 0.58), center=(190.0, 160.0, 90.0)),
)
SKY = Background(color=(0.08, 0.30, 0.62))
RAY_DEPTH = 6


def make() -> ClassicScene:
    """Return the classic teapot: polished copper on half-mirroring tiles under two lights."""
    builder = ClassicSceneBuilder(NAME, handedness="right")
    for is_light, material in ((True, LIGHT_TILE), (False, DARK_TILE)):
        corners, faces = tiles(light=is_light)
        builder.mesh(corners, faces, builder.material(material))
    pot, matrix = tessellate(LAYOUT.subdivisions), pot_from_newell()[:3, :3]
    normals = pot.normals @ matrix.T / LAYOUT.unit
    builder.mesh(pot.positions @ matrix.T, pot.faces, builder.material(GLAZE), normals=normals)
    return builder.build(LIGHTS, background=SKY, camera=STAGE.classic_camera(ray_depth=RAY_DEPTH))
