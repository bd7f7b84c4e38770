"""How noisy caustics by paths would be, and that photons are not traced for light that nobody would miss."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.rendering.preparation.photon_worth import LEAST_WORTH, are_worth_photons


@pytest.mark.parametrize(
    ("light", "radiance", "share", "samples", "gain", "expected"),
    [
        (0.1, 0.0, 0.0, 1, 1.0, True),
        (0.01, 0.0, 0.0, 1, 1.0, False),  # paths never meet an emitter without size, and show no noise
        (0.01, 0.0, 0.0, 1, 8.0, True),
        (0.01, 0.0, 0.0, 16, 1.0, True),  # what is missing stays
        (0.01, 500.0, 0.5, 1, 1.0, True),
        (1e-4, 500.0, 1.0, 16, 1.0, False),
        (0.01, 0.01, 1.0, 1, 1.0, False),  # a wide emitter, whose light paths meet without noise
        (0.01, 0.01, 1.0, 1, 8.0, True),
    ],
)
def test_photons_are_worth_what_paths_miss_or_show_as_noise(light, radiance, share, samples, gain, expected):
    assert are_worth_photons(np.full(8, light), radiance, share, samples, gain) == expected


def test_single_bright_pixels_count_as_white():
    light = np.zeros(10_000)
    light[7] = 1000.0
    assert not are_worth_photons(light, 0.0, 0.0, 1, 1.0)
    light[:4] = 1000.0
    assert are_worth_photons(light, 0.0, 0.0, 1, 1.0)


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


@pytest.mark.parametrize(
    ("intensity", "exposure", "expected"), [(4e4, 0, "photons"), (40, 0, None), (40, 9, "photons")]
)
def test_photons_are_left_out_where_paths_hardly_make_noise(engine, intensity, exposure, expected):
    """A glass ball before a wall under an emitter of some size, bright, dim, and dim but exposed by nine stops."""
    from lippmann.scene.values.description import Light

    light = Light("point", (intensity,) * 3, at(60, 40, 90), radius=10.0)
    way, picture = caustics_of([-20], 4, light, exposure=exposure)
    assert way == expected
    asked_way, asked = caustics_of([-20], 4, light, exposure=exposure, caustics="photons")
    assert asked_way == "photons"
    # What is left out would not be seen.
    if expected is None:
        assert np.square(picture.pixels - asked.pixels).mean() < LEAST_WORTH


@pytest.mark.long
def test_they_are_left_out_where_the_eye_does_not_look(engine):
    """A glass ball under a point light before a wall that is seen, and behind it before another one."""
    from lippmann.scene.values.description import Light

    assert caustics_of([-20], 4, Light("point", (4e4,) * 3, at(30, 20, 60)), exposure=0)[0] == "photons"
    assert caustics_of([-20, -90], -50, Light("point", (4e4,) * 3, at(0, 0, -26)), exposure=0)[0] is None
