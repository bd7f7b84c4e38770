"""Which pictures have photons: all with an emitter and a caster whose light lands in what is seen."""

from __future__ import annotations

import numpy as np
import pytest


def caustics_of(walls, ball, light, **options):
    """How the caustics come of a glass ball at a depth, between walls at others, under a light; and the picture."""
    import lippmann
    from lippmann.display import Display, LensArray, Panel
    from lippmann.options.placement import PlacementOptions
    from lippmann.scene.values.description import Instance, Material, Mesh, SceneDescription

    trimesh = pytest.importorskip("trimesh")
    shapes = [trimesh.creation.box((300, 200, 2)), trimesh.creation.icosphere(3, 18)]
    meshes = [Mesh("", m.vertices.astype(np.float32), m.faces.astype(np.uint32), n) for n, m in enumerate(shapes)]
    materials = [
        Material("wall", base_color=(0.6, 0.6, 0.6), roughness=1.0, specular=0.0),
        Material("glass", transmission=1.0, roughness=0.0, ior=1.5, thickness=1.0),
    ]
    instances = [Instance(0, at(0, 0, depth)) for depth in walls] + [Instance(1, at(0, 0, ball))]
    scene = lippmann.load_scene(SceneDescription("ball", meshes, materials, instances, lights=[light]))
    display = Display("test", Panel(96, 64, 1.0), LensArray("square", 8.0), 30.0, "", 500.0, 80.0)
    placed = PlacementOptions(place="display")
    picture = lippmann.render(scene, display, placement=placed, method="full", spp=4, integrator="path", **options)
    return picture.provenance.options.get("caustics"), picture


def at(x, y, z):
    place = np.eye(4)
    place[:3, 3] = x, y, z
    return place


def test_photons_bring_what_an_emitter_and_glass_make(engine):
    """A glass ball before a wall, under an emitter of some size, bright or dim."""
    from lippmann.scene.values.description import Light

    for intensity in (4e4, 40.0):
        light = Light("point", (intensity,) * 3, at(60, 40, 90), radius=10.0)
        assert caustics_of([-20], 4, light, exposure=0, denoise="none")[0] == "photons"


@pytest.mark.long
def test_they_are_left_out_where_the_eye_does_not_look(engine):
    """A glass ball under a point light in front of a wall that is seen, and between two others far behind it."""
    from lippmann.scene.values.description import Light

    assert caustics_of([-20], 4, Light("point", (4e4,) * 3, at(30, 20, 60)), exposure=0)[0] == "photons"
    assert caustics_of([-20, -200, -400], -300, Light("point", (4e4,) * 3, at(0, 0, -276)), exposure=0)[0] is None


@pytest.mark.parametrize("caustics", ["auto", "photons"])
def test_a_picture_of_few_paths_has_few_emissions(engine, monkeypatch, caustics):
    """Pilot and both halves together."""
    from lippmann.rendering.transport.photon_shooter import PhotonShooter
    from lippmann.scene.values.description import Light

    counts, shoot = [], PhotonShooter.shoot

    def counted(self, count, *rest):
        counts.append(count)
        return shoot(self, count, *rest)

    monkeypatch.setattr(PhotonShooter, "shoot", counted)
    assert caustics_of([-20], 4, Light("point", (4e4,) * 3, at(30, 20, 60)), exposure=0, caustics=caustics)[0]
    paths = 96 * 64 * 4
    assert len(counts) == 3
    assert sum(counts) <= 2 / 3 * paths
    assert min(counts) > 0.01 * paths
