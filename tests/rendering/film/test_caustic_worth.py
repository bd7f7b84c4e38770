"""How noisy caustics by paths would be, and that photons are not traced for light that nobody would miss."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lippmann.rendering.film.caustic_worth import LEAST_WORTH, variance_by_paths
from lippmann.rendering.transport.photon_map import Photons

SIDE = 64


def spread(count, size=1.0, seed=2):
    """Photons that light a square of this size evenly with an irradiance of 0.5."""
    random = np.random.default_rng(seed)
    position = np.zeros((count, 3), np.float32)
    position[:, :2] = size * random.random((count, 2))
    power = np.full((count, 3), 0.5 * size**2 / count, np.float32)
    up = np.tile(np.float32([0, 0, 1]), (count, 1))
    return Photons(position, up, up, power, np.ones(count, np.uint32))


def wall(size=1.0):
    """Points of a square wall, as a picture sees them."""
    y, x = (np.mgrid[0:SIDE, 0:SIDE] + 0.5) * size / SIDE
    return np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)


@pytest.mark.parametrize("size", [1.0, 40.0])
@pytest.mark.parametrize("radiance", [0.1, 30.0])
def test_it_is_the_variance_of_what_paths_meet(size, radiance):
    """A white wall: a path meets the emitter by the chance E / (pi L), and brings L then."""
    photons = spread(3000, size)
    found = variance_by_paths(photons, np.full(3000, radiance), wall(size), SIDE**2)
    chance = 0.5 / (math.pi * radiance)
    hits = np.random.default_rng(1).random(200_000) < min(1.0, chance)
    assert radiance**2 * chance == pytest.approx(0.5 * radiance / math.pi)
    # At the sides of the square fewer points lie about a photon.
    assert found == pytest.approx(0.5 * radiance / math.pi, rel=0.1)
    if radiance == 30.0:
        assert found == pytest.approx(np.var(radiance * hits), rel=0.1)


def test_what_shows_no_surface_counts_as_dark():
    photons = spread(500)
    whole = variance_by_paths(photons, np.full(500, 2.0), wall(), SIDE**2)
    assert variance_by_paths(photons, np.full(500, 2.0), wall(), 4 * SIDE**2) == pytest.approx(whole / 4)


def test_emitters_without_size_are_never_found():
    radiance = np.full(500, 1e-9)
    radiance[7] = np.inf
    assert variance_by_paths(spread(500), radiance, wall(), SIDE**2) == math.inf


def test_without_photons_there_is_nothing_to_miss():
    assert variance_by_paths(Photons.dark(0), np.zeros(0), wall(), SIDE**2) == 0


@pytest.mark.parametrize(
    ("intensity", "exposure", "expected"), [(4e4, 0, "photons"), (40, 0, None), (40, 9, "photons")]
)
def test_photons_are_left_out_where_paths_hardly_make_noise(engine, intensity, exposure, expected):
    """A glass ball before a wall under an emitter of some size, bright, dim, and dim but exposed by nine stops."""
    import lippmann
    from lippmann.display import Display, LensArray, Panel
    from lippmann.scene.placement import PlacementOptions
    from lippmann.scene.values.description import Instance, Light, Material, Mesh, SceneDescription

    trimesh = pytest.importorskip("trimesh")
    shapes = [trimesh.creation.box((300, 200, 2)), trimesh.creation.icosphere(3, 18)]
    meshes = [Mesh("", m.vertices.astype(np.float32), m.faces.astype(np.uint32), n) for n, m in enumerate(shapes)]
    materials = [
        Material("wall", base_color=(0.6, 0.6, 0.6), roughness=1.0, specular=0.0),
        Material("glass", transmission=1.0, roughness=0.0, ior=1.5, thickness=1.0),
    ]
    behind, before, above = np.eye(4), np.eye(4), np.eye(4)
    behind[2, 3], before[2, 3] = -20, 4
    above[:3, 3] = 60, 40, 90
    light = Light("point", (intensity,) * 3, above, radius=10.0)
    instances = [Instance(0, behind), Instance(1, before)]
    scene = lippmann.load_scene(SceneDescription("ball", meshes, materials, instances, lights=[light]))
    display = Display("test", Panel(96, 64, 1.0), LensArray("square", 8.0), 30.0, "", 500.0, 80.0)
    options = {"placement": PlacementOptions(mode="display"), "method": "full", "spp": 4, "integrator": "path"}
    picture = lippmann.render(scene, display, exposure=exposure, **options)
    assert picture.provenance.options.get("caustics") == expected
    asked = lippmann.render(scene, display, exposure=exposure, caustics="photons", **options)
    assert asked.provenance.options["caustics"] == "photons"
    # What is left out would not be seen.
    if expected is None:
        apart = np.square(picture.pixels - asked.pixels).mean()
        assert apart < LEAST_WORTH
