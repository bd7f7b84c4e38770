"""Furnaces: the share of even light that white surfaces keep, for every parameter of a material.

Time on two cores: an estimated 5 minutes.

python benchmarks/furnace.py

A surface that absorbs nothing keeps all light. Directions are sampled by the material's own plugin, whose weights have
the kept share for their mean; the light that enters a denser body is counted, not its radiance. Glass is also tried as
a whole ball, whose paths cross many interfaces. ``single`` is glTF's formula as it stands (``--single-scattering``).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from harness import save
from lippmann.runtime import engine
from lippmann.scene.values.description import Environment, Image, Instance, Material, Mesh, SceneDescription, Texture

SAMPLES = 400_000
COSINES = (0.95, 0.5, 0.2)
#: Paths through a rough ball cross tens of interfaces.
BALL_DEPTH = 64

WHITE = Material(base_color=(1.0, 1.0, 1.0))
METAL = replace(WHITE, metallic=1.0)
SHEET = replace(WHITE, transmission=1.0)
GLASS = replace(SHEET, thickness=1.0)


def tilted(degrees: float) -> Texture:
    """A normal map that leans by so much all over."""
    texel = (np.float32([math.sin(math.radians(degrees)), 0, math.cos(math.radians(degrees))]) + 1) / 2
    return Texture(Image("n", np.tile(texel, (2, 2, 1))), srgb=False)


def rows() -> dict[str, Material]:
    """The materials by what is varied."""
    found: dict[str, Material] = {}
    for roughness in (0.1, 0.5, 1.0):
        found[f"metal, roughness {roughness:g}"] = replace(METAL, roughness=roughness)
        found[f"plastic, roughness {roughness:g}"] = replace(WHITE, roughness=roughness)
        found[f"thin sheet, roughness {roughness:g}"] = replace(SHEET, roughness=roughness)
        found[f"solid glass, roughness {roughness:g}"] = replace(GLASS, roughness=roughness)
    found["half metal, roughness 0.5"] = replace(METAL, metallic=0.5, roughness=0.5)
    found["half transmitting sheet, roughness 0.5"] = replace(SHEET, transmission=0.5, roughness=0.5)
    for ior in (1.0, 1.1, 2.4):
        found[f"solid glass, index {ior:g}, roughness 0.5"] = replace(GLASS, ior=ior, roughness=0.5)
    found["plastic, index 2.4"] = replace(WHITE, ior=2.4, roughness=0.5)
    found["plastic, specular 0"] = replace(WHITE, specular=0.0)
    found["plastic, specular colour 2"] = replace(WHITE, specular_color=(2.0, 2.0, 2.0), roughness=0.5)
    for roughness in (0.0, 0.5, 1.0):
        found[f"clear coat, roughness {roughness:g}, on plastic"] = replace(
            WHITE, clearcoat=1.0, clearcoat_roughness=roughness
        )
    for roughness in (0.2, 0.5, 1.0):
        found[f"white sheen, roughness {roughness:g}, on plastic"] = replace(
            WHITE, sheen_color=(1.0, 1.0, 1.0), sheen_roughness=roughness
        )
    for strength in (0.5, 1.0):
        found[f"metal, roughness 0.3, anisotropy {strength:g}"] = replace(METAL, roughness=0.3, anisotropy=strength)
    for thickness in (200.0, 500.0):
        found[f"metal, film of {thickness:g} nm"] = replace(
            METAL, roughness=0.3, iridescence=1.0, iridescence_thickness_maximum=thickness
        )
    for degrees in (30, 50, 60, 80):
        found[f"metal, normal map at {degrees} degrees"] = replace(METAL, roughness=0.3, normal_texture=tilted(degrees))
    found["plastic, normal map at 60 degrees"] = replace(WHITE, roughness=0.5, normal_texture=tilted(60))
    return found


def kept(material: Material, cosine: float, *, multiple: bool) -> float:
    """Share of light from a direction of that cosine which the surface sends on."""
    import drjit as dr
    import mitsuba as mi

    bsdf = _built([_square()], material, multiple).shapes()[0].bsdf()
    rng = np.random.default_rng(1)
    u = [mi.Float(rng.random(SAMPLES, dtype=np.float32)) for _ in range(3)]
    si = dr.zeros(mi.SurfaceInteraction3f, SAMPLES)
    sine = math.sqrt(1 - cosine**2)
    si.wi = mi.Vector3f(0.6 * sine, 0.8 * sine, cosine)
    sample, weight = bsdf.sample(mi.BSDFContext(), si, u[0], mi.Point2f(u[1], u[2]))
    through = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Transmission)
    return float(np.array(weight * dr.select(through, dr.square(sample.eta), 1)).mean())


def kept_by_ball(material: Material, *, multiple: bool) -> float:
    """Mean brightness of a ball in surroundings of brightness 1."""
    import mitsuba as mi

    scene = _built([_ball()], material, multiple, Environment(np.ones((2, 4, 3), np.float32)))
    frame = mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]) @ mi.ScalarTransform4f().scale(
        [0.7, 0.7, 1]
    )
    film = {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}}
    sensor = mi.load_dict({"type": "orthographic", "to_world": frame, "film": film})
    integrator = mi.load_dict({"type": "path", "max_depth": BALL_DEPTH, "rr_depth": 1000})
    return float(np.array(mi.render(scene, sensor=sensor, integrator=integrator, spp=256)).mean())


def main() -> None:
    engine.start()
    surfaces = {
        name: {
            "compensated": [kept(material, cosine, multiple=True) for cosine in COSINES],
            "single": [kept(material, cosine, multiple=False) for cosine in COSINES],
        }
        for name, material in rows().items()
    }
    balls = {
        f"ball of solid glass, index {ior:g}, roughness {roughness:g}": {
            name: kept_by_ball(replace(GLASS, ior=ior, roughness=roughness), multiple=name == "compensated")
            for name in ("compensated", "single")
        }
        for ior, roughness in ((1.5, 0.2), (1.5, 0.5), (1.5, 1.0), (1.0, 0.5))
    }
    save("furnace", {"cosines": COSINES, "surfaces": surfaces, "balls": balls})


def _built(meshes: list[Mesh], material: Material, multiple: bool, environment: Environment | None = None) -> Any:
    from lippmann.device.pbr import build_description

    instances = [Instance(number, np.eye(4)) for number in range(len(meshes))]
    description = SceneDescription(
        "furnace", meshes, [material], instances, environment=environment, multiple_scattering=multiple
    )
    return build_description(description).mitsuba


def _square() -> Mesh:
    corners = np.float32([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    uvs = np.float32([(0, 1), (1, 1), (1, 0), (0, 0)])
    return Mesh("square", corners, np.uint32([(0, 1, 2), (0, 2, 3)]), 0, None, (uvs,))


def _ball() -> Mesh:
    import trimesh

    ball = trimesh.creation.icosphere(4)
    return Mesh("ball", np.float32(ball.vertices), np.uint32(ball.faces), 0, np.float32(ball.vertex_normals))


if __name__ == "__main__":
    main()
