"""The picture that nobody asked anything special of: filled, lit from where the viewer stands, clean, of true shape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

import lippmann
from lippmann.color.transfer import encode_srgb
from lippmann.display import Display, LensArray, Panel
from lippmann.options.placement import PlacementOptions
from lippmann.scene.values.description import Instance, Material, Mesh, SceneDescription

pytestmark = pytest.mark.usefixtures("engine")


def lenticular(distance=600.0):
    """96 mm x 72 mm, 6 pixels per lens; resolves 30 mm to either side."""
    return Display("test", Panel(96, 72, 1.0), LensArray("lenticular", 6.0), 5.0, "", distance, 20.0)


GREY = Material("grey", base_color=(0.5, 0.5, 0.5), roughness=0.5)


def mesh_scene(*meshes):
    """A grey scene of trimesh's meshes, without any light of its own."""
    found = [Mesh("", m.vertices.astype(np.float32), m.faces.astype(np.uint32), 0) for m in meshes]
    instances = [Instance(number, np.eye(4)) for number in range(len(found))]
    return lippmann.load_scene(SceneDescription("test", meshes=found, materials=[GREY], instances=instances))


def letter_f():
    """The letter, standing on the plane y = 0, which faces +z."""
    boxes = [((1, 6, 1), (0, 3, 0)), ((3, 1, 1), (1.5, 5.5, 0)), ((2, 1, 1), (1, 3, 0))]
    return trimesh.util.concatenate(
        [trimesh.creation.box(size, trimesh.transformations.translation_matrix(at)) for size, at in boxes]
    )


def turned(mesh, angle, axis):
    copy = mesh.copy()
    copy.apply_transform(trimesh.transformations.rotation_matrix(np.radians(angle), axis))
    return copy


def brightness(scene, **placed):
    """sRGB codes of the pixels that see the model."""
    options = PlacementOptions(**placed)
    image = lippmann.render(scene, lenticular(), placement=options, method="full", spp=64, layers=True, tone_map="none")
    return encode_srgb(image.pixels.mean(axis=2))[image.maps["shape"] >= 0]


PLACED = PlacementOptions(depth_scale=0.4, turn=(20.0, 35.0, 10.0))


@pytest.fixture(scope="module")
def scenes(engine):
    """A scene, and that scene as a display shows it that compresses depth: flat by itself, in mm."""
    meshes = letter_f(), trimesh.creation.icosphere(3, 1.5).apply_translation((2, 1, 1))
    scene = mesh_scene(*meshes)
    placement = lippmann.render(scene, lenticular(), placement=PLACED, integrator="depth").world_from_display
    in_display = [mesh.copy().apply_transform(np.linalg.inv(placement)) for mesh in meshes]
    return scene, mesh_scene(*in_display)


class TestCompressedDepth:
    @pytest.mark.slow
    @pytest.mark.parametrize("surface", ["depth", "position", "normal", "albedo"])
    def test_surfaces(self, scenes, surface):
        compressed, flat = scenes
        asked = {"integrator": surface, "method": "full", "spp": 4}
        first = lippmann.render(compressed, lenticular(), placement=PLACED, **asked).pixels
        second = lippmann.render(flat, lenticular(), placement=PlacementOptions(place="display"), **asked).pixels
        apart = np.abs(first - second).max(axis=2)
        assert np.abs(second).max() > 0.4
        assert (apart > 2e-3 * max(np.abs(second).max(), 1.0)).mean() < 2e-3  # rays that graze an edge

    @pytest.mark.slow
    def test_methods_that_share_points_show_what_full_rendering_shows(self, scenes):
        compressed, _ = scenes
        asked = {"display": lenticular(), "placement": PLACED, "integrator": "direct", "spp": 16, "tone_map": "none"}
        full = lippmann.render(compressed, method="full", **asked).pixels
        for method in ("lens-view", "interpolated", "pooled"):
            shared = lippmann.render(compressed, method=method, **asked).pixels
            error = np.mean((encode_srgb(full) - encode_srgb(shared)) ** 2)
            assert -10 * np.log10(error) > 30, method

    def test_the_layers_of_a_picture(self, scenes):
        compressed, flat = scenes
        asked = {"integrator": "albedo", "layers": True}
        first = lippmann.render(compressed, lenticular(), placement=PLACED, **asked).maps
        second = lippmann.render(flat, lenticular(), placement=PlacementOptions(place="display"), **asked).maps
        seen = np.isfinite(second["depth"]) & np.isfinite(first["depth"])
        assert seen.mean() > 0.2
        for name in ("depth", "normal"):
            apart = np.abs(first[name][seen] - second[name][seen])
            assert np.percentile(apart, 99) < 1e-3


class TestStudio:
    @pytest.mark.slow
    def test_turning_the_model_leaves_the_light_in_its_place(self):
        upright = letter_f()
        plain = brightness(mesh_scene(upright))
        stored_z_up = brightness(mesh_scene(turned(upright, 90, (1, 0, 0))), turn=(0.0, -90.0, 0.0))
        assert stored_z_up.mean() == pytest.approx(plain.mean(), abs=0.003)
        for yaw in (90.0, 180.0, -90.0):
            beside = brightness(mesh_scene(turned(upright, -yaw, (0, 1, 0))), turn=(yaw, 0.0, 0.0))
            assert beside.mean() == pytest.approx(plain.mean(), abs=0.003)

    @pytest.mark.slow
    def test_the_viewer_sees_the_lit_side_whichever_it_is(self):
        ball = trimesh.creation.icosphere(4, 1.0)
        means = [brightness(mesh_scene(ball), turn=turn).mean() for turn in ((0, 0, 0), (180, 0, 0), (70, 40, 120))]
        assert np.ptp(means) < 0.004

    @pytest.mark.slow
    def test_a_grey_model_is_neither_dark_nor_clipped(self):
        seen = brightness(mesh_scene(trimesh.creation.icosphere(4, 1.0), turned(letter_f(), 30, (0, 1, 0))))
        assert 0.25 < seen.mean() < 0.75
        assert (seen > 254.5 / 255).mean() <= 0.01


@pytest.mark.slow
@pytest.mark.parametrize("distance", [600.0, 150.0])
def test_the_model_fills_the_panel(distance):
    scene = mesh_scene(turned(trimesh.creation.icosphere(4, 1.0), 45, (1, 1, 0)))
    display = lenticular(distance)
    depth = lippmann.render(scene, display, integrator="depth", layers=True).maps["depth"]
    # Under each lens the pixel that the eye before the middle sees.
    seen = np.isfinite(depth[:, 2::6] + depth[:, 3::6])
    rows = np.flatnonzero(seen.any(axis=1))
    assert (rows[-1] - rows[0] + 1) / len(seen) == pytest.approx(0.95, abs=0.03)


@pytest.mark.slow
def test_default_light_is_pooled_and_a_slanted_sheet_gets_sub_pixels():
    scene = mesh_scene(trimesh.creation.icosphere(2, 1.0))
    upright = lippmann.render(scene, lenticular()).provenance
    assert (upright.method, upright.spp, upright.subpixels) == ("pooled", 16, False)
    display = replace(lenticular(), lens_array=LensArray("lenticular", 6.0, 15.0))
    slanted = lippmann.render(scene, display).provenance
    assert (slanted.method, slanted.subpixels) == ("pooled", True)
    plain = lippmann.render(scene, display, method="full", subpixels=False).provenance
    assert (plain.method, plain.spp, plain.subpixels) == ("full", 16, False)


def test_unlit_surfaces_get_samples_as_their_edges_need_them():
    """The confetti is nothing but edges; the plate has four, in few pixels."""
    generator = np.random.default_rng(5)
    places = generator.uniform(-1, 1, (3000, 1, 3)) * (4, 3, 1) + generator.normal(0, 0.1, (3000, 3, 3))
    confetti = Mesh("", places.reshape(-1, 3).astype(np.float32), np.arange(9000, dtype=np.uint32).reshape(-1, 3), 0)
    corners = np.array([[-4, -3, 0], [4, -3, 0], [4, 3, 0], [-4, 3, 0]], np.float32)
    plate = Mesh("", corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32), 0)
    material = Material("own colour", base_color=(0.9, 0.2, 0.1), unlit=True)
    edged, plain = (
        lippmann.load_scene(SceneDescription("unlit", [mesh], [material], [Instance(0, np.eye(4))]))
        for mesh in (confetti, plate)
    )
    assert lippmann.render(plain, lenticular()).provenance.spp == 16
    image = lippmann.render(edged, lenticular())
    assert image.provenance.method == "full"
    assert 16 < image.provenance.spp <= 128
    reference = lippmann.render(edged, lenticular(), method="full", spp=1024)
    error = np.mean(np.square(encode_srgb(image.pixels) - encode_srgb(reference.pixels)))
    assert -10 * np.log10(error) > 36.0
