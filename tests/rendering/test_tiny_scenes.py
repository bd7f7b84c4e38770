"""The least that a scene, a display or a sampler may hold: one or two of everything, and none."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

import lippmann
from lippmann.display import Display, LensArray, Panel
from lippmann.errors import UsageError
from lippmann.options.choices import Integrator, Method
from lippmann.options.placement import PlacementOptions
from lippmann.scene.values.description import Instance, Light, Material, Mesh, SceneDescription
from lippmann.scene.values.splats import Splats

pytestmark = pytest.mark.usefixtures("engine")

METHODS, INTEGRATORS = get_args(Method), get_args(Integrator)
TRIANGLE = np.float32([[-9, -9, 0], [9, -9, 0], [0, 9, 0]])
MIRROR = Material("mirror", metallic=1.0, roughness=0.0)
GLASS = Material("glass", transmission=1.0, roughness=0.0, thickness=1.0)
MATT = Material("matt", base_color=(0.6, 0.6, 0.6), specular=0.0)
GLOW = Material("glow", base_color=(0.0, 0.0, 0.0), emission=(5.0, 4.0, 3.0))


def mesh(material, triangles=1, z=0.0, **more):
    corners = np.concatenate([TRIANGLE + np.float32([0, 0, z - 3 * number]) for number in range(triangles)])
    return Mesh("", corners, np.arange(3 * triangles, dtype=np.uint32).reshape(-1, 3), material, **more)


def lights(*intensities, radius=0.0):
    places = np.tile(np.eye(4), (len(intensities), 1, 1))
    places[:, :3, 3] = [(8 * (number + 1), 6, 30) for number in range(len(intensities))]
    return [Light("point", (each,) * 3, place, radius=radius) for each, place in zip(intensities, places, strict=True)]


def surfaces(*materials, triangles=1, emitters=(), copies=1, round_body=None):
    """Triangles of the first material before a matt one, and further ones behind."""
    meshes = [mesh(0, triangles, stands_for=round_body)]
    meshes += [mesh(number, z=-6.0 * number) for number in range(1, len(materials))]
    copied = np.stack([np.eye(4)] * copies)
    copied[:, 0, 3] = 5.0 * np.arange(copies)
    places = [copied] + [np.eye(4)] * (len(meshes) - 1)
    instances = [Instance(number, place) for number, place in enumerate(places)]
    return SceneDescription("tiny", meshes, list(materials), instances, list(emitters))


def splats(count):
    zero, one = np.zeros((count, 3), np.float32), np.ones(count, np.float32)
    turns = np.tile(np.float32([0, 0, 0, 1]), (count, 1))
    return SceneDescription("tiny", splats=Splats(zero, zero + 3, turns, 0.8 * one, np.ones((count, 1, 3), np.float32)))


def volume(*shape):
    def written(folder):
        np.save(folder / "grid.npy", np.linspace(0, 1, int(np.prod(shape)), dtype=np.float32).reshape(shape))
        return folder / "grid.npy"

    return written


def whitted(folder):
    """One polygon, in a format of Whitted ray tracing."""
    (folder / "one.nff").write_text(
        "v\nfrom 0 0 40\nat 0 0 0\nup 0 1 0\nangle 40\nhither 1\nresolution 8 8\n"
        "l 5 5 30\nf 1 1 1 0.2 0.1 8 0.7 1.3\np 3\n-9 -9 0\n9 -9 0\n0 9 0\n"
    )
    return folder / "one.nff"


#: Descriptions, or what writes a file into a folder.
SCENES = {
    "one mirror triangle, no emitter": surfaces(MIRROR),
    "one mirror triangle, one emitter": surfaces(MIRROR, MATT, emitters=lights(4e3)),
    "two glass triangles, two emitters": surfaces(GLASS, MATT, triangles=2, emitters=lights(4e3, 1e3)),
    "one glass triangle, two emitters, one dark": surfaces(GLASS, MATT, emitters=lights(0.0, 4e3, radius=1.0)),
    "one mirror triangle, dark emitters": surfaces(MIRROR, MATT, emitters=lights(0.0, 0.0)),
    "one glowing triangle": surfaces(GLOW),
    "one mirror, one glowing triangle": surfaces(MIRROR, GLOW, MATT),
    "two copies of a mirror triangle": surfaces(MIRROR, MATT, copies=2, emitters=lights(4e3)),
    "one ball": surfaces(MIRROR, MATT, round_body="ball", emitters=lights(4e3)),
    "one splat": splats(1),
    "two splats": splats(2),
    "one voxel": volume(1, 1, 1),
    "two voxels": volume(1, 1, 2),
    "one polygon by Whitted ray tracing": whitted,
}
#: Columns, rows, pixels of a lens.
PANELS = {
    "1 pixel": (1, 1, 1),
    "2 pixels of 1 lens": (2, 2, 2),
    "2 lenses": (2, 1, 1),
    "8 x 8 pixels of 1 lens": (8, 8, 8),
}
#: What the plain suite takes; the rest takes a second or more each.
QUICK = ("one glass triangle, two emitters, one dark", "two splats", "one voxel")


def named(values, quick):
    return [pytest.param(name, marks=() if name in quick else pytest.mark.long) for name in values]


def a_scene(name, folder):
    made = SCENES[name]
    return lippmann.load_scene(made(folder) if callable(made) else made)


def render(scene, panel="2 lenses", **options):
    columns, rows, pixels = PANELS[panel]
    display = Display("tiny", Panel(columns, rows, 4.0), LensArray("square", 4.0 * pixels), 20.0)
    placement = PlacementOptions(place="display")
    return lippmann.render(scene, display, placement=placement, threads=1, **options)


@pytest.mark.long_cases("one glass triangle, two emitters, one dark", "two splats", "one voxel")
@pytest.mark.parametrize("name", named(SCENES, QUICK))
def test_each_tiny_scene_is_rendered_by_every_integrator_and_method(name, tmp_path):
    """By each integrator with the method that it takes by default, and by each method with the integrator."""
    scene, made = a_scene(name, tmp_path), []
    pairs = [(integrator, "auto") for integrator in INTEGRATORS] + [("auto", method) for method in METHODS[1:]]
    for integrator, method in pairs:
        try:
            picture = render(scene, integrator=integrator, method=method, spp=2)
        except UsageError:  # one line says that they do not go together
            continue
        assert picture.pixels.shape == (1, 2, 3)
        if integrator not in ("depth", "position"):
            assert np.isfinite(picture.pixels).all()
        made.append((integrator, method))
    assert {("auto", "auto"), ("auto", "full")} <= set(made)


@pytest.mark.slow
@pytest.mark.parametrize("panel", named(PANELS, ["1 pixel"]))
@pytest.mark.parametrize(
    "options", [{"spp": 1, "method": "full", "caustics": "photons"}, {"spp": 2}, {"quality": 20.0}]
)
def test_tiny_panels_are_rendered(panel, options):
    scene = lippmann.load_scene(SCENES["one glass triangle, two emitters, one dark"])
    picture = render(scene, panel, integrator="path", **options)
    assert np.isfinite(picture.pixels).all()
