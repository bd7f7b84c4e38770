"""Reuse in physically based light, a few noisy samples per pixel, through the public call."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import lippmann

pytestmark = pytest.mark.usefixtures("engine")

LIGHT = {"integrator": "path", "depth": 3, "pixel_filter": "box", "tone_map": "none"}


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    """The teapot, and a glTF file of a matt box on a floor with a metal ball, lit by the studio."""
    material = trimesh.visual.material.PBRMaterial
    world = trimesh.Scene()
    for name, shape, place, looks in (
        ("floor", trimesh.creation.box((4, 0.1, 4)), (0, -0.5, 0), material(baseColorFactor=(150, 140, 120, 255))),
        ("box", trimesh.creation.box((0.8, 0.8, 0.8)), (-0.5, 0, 0), material(baseColorFactor=(200, 60, 40, 255))),
        ("ball", trimesh.creation.icosphere(3, 0.4), (0.6, 0, 0.2), material(metallicFactor=1.0, roughnessFactor=0.1)),
    ):
        shape.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(shape.vertices), 2)), material=looks)
        world.add_geometry(shape, geom_name=name, transform=trimesh.transformations.translation_matrix(place))
    path = tmp_path_factory.mktemp("gltf") / "shelf.glb"
    path.write_bytes(world.export(file_type="glb"))
    return {"gltf": lippmann.load_scene(path), "teapot": lippmann.load_scene("teapot")}


@pytest.fixture(scope="module")
def full(scenes):
    """Fully traced pictures by scene, display and samples, made once."""
    made = {}

    def get(name, display, spp):
        key = (name, display.title, spp)
        if key not in made:
            made[key] = lippmann.render(scenes[name], display, spp=spp, **LIGHT)
        return made[key]

    return get


def means_of_lenses(image):
    """Mean colour of each micro-image, ``(lenses, 3)``, and its pixels."""
    from lippmann.display.lens_field import LensField

    lens = LensField.of(image.display).lens.ravel()
    counts = np.bincount(lens)
    colors = np.clip(image.pixels, 0, 1).reshape(-1, 3)
    sums = np.stack([np.bincount(lens, colors[:, channel]) for channel in range(3)], axis=1)
    return sums[counts > 0] / counts[counts > 0, None], counts[counts > 0]


@pytest.mark.parametrize("name", ["gltf", "teapot"])
@pytest.mark.parametrize(
    ("preset", "size", "spp", "method", "careful"),
    [
        pytest.param("seed-lenticular", (128, 96), 2, "lens-view", True, marks=pytest.mark.long),
        pytest.param("seed-lenticular", (128, 96), 4, "interpolated", True, marks=pytest.mark.long),
        pytest.param("seed-lenticular", (128, 96), 4, "lens-view", False, marks=pytest.mark.long),
        pytest.param("seed-lenticular", (128, 96), 4, "interpolated", False, marks=pytest.mark.long),
        pytest.param("mla-square", (120, 120), 2, "interpolated", True, marks=pytest.mark.long),
    ],
)
def test_micro_images_have_the_mean_colors_of_full_tracing(scenes, full, name, preset, size, spp, method, careful):
    display = lippmann.load_display(preset).resized(*size)
    reference = full(name, display, spp)
    image = lippmann.render(scenes[name], display, method=method, respect_gloss=careful, spp=spp, **LIGHT)
    shares = dict(image.provenance.pixel_shares)
    assert sum(shares.values()) == pytest.approx(1)
    assert (shares["interpolated"] > 0) <= (method == "interpolated")
    assert image.provenance.rays["primary"] == spp * round(shares["traced"] * size[0] * size[1])
    assert shares["traced"] < (0.97 if careful else 0.35)
    means, counts = means_of_lenses(image)
    expected, _ = means_of_lenses(reference)
    wrong = np.abs(means - expected).max(axis=1)[counts >= 64]
    # A carried colour has its own pixel's noise, not that of the pixel it comes to: means differ, but not to one side.
    assert wrong.max() < (0.045 if careful else 0.08)
    assert wrong.mean() < (0.008 if careful else 0.02)
    assert np.abs(np.average(means - expected, axis=0, weights=counts)).max() < (0.004 if careful else 0.008)
