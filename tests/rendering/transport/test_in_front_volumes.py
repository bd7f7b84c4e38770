"""Volumes through displays: native rays, surfaces before and behind them, and where their light comes from."""

import numpy as np
import pytest

import lippmann
from lippmann.display import Display, LensArray, Panel
from lippmann.options.placement import PlacementOptions
from lippmann.rendering.transport.in_front import toward_light
from lippmann.scene.values.description import Instance, Material, Mesh, SceneDescription
from lippmann.scene.values.volume import TransferFunction, Volume

SHEET = Display("sheet", Panel(48, 36, 0.25), LensArray("lenticular", 2.0), gap=6.0)
IN_PLACE = PlacementOptions(place="display")
#: A slab 4 mm thick from z = -8 to -4, which lets 0.8 of the light through each millimetre.
SLAB = Volume(
    np.zeros((4, 2, 2), np.int16),
    np.array([[50.0, 0, 0, -25], [0, 50, 0, -25], [0, 0, 1, -7.5], [0, 0, 0, 1]]),
    TransferFunction(np.array([0.0, 1.0]), np.tile([0.5, 0.25, 0.125], (2, 1)), np.full(2, 0.2), shading=0.0),
)
WALL = Material("glow", base_color=(0.2, 0.4, 0.6), unlit=True)


def wall(z, half=50.0):
    corners = np.float32([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])
    return Mesh("wall", corners, np.uint32([[0, 1, 2], [0, 2, 3]]), 0)


def slopes(display):
    v, u = np.mgrid[: display.panel.height, : display.panel.width] + 0.5
    _, direction = display.light_ray(*display.panel_point(u, v))
    direction = np.stack(np.broadcast_arrays(*direction, u)[:3], axis=-1)
    return np.linalg.norm(direction, axis=-1) / np.abs(direction[..., 2])


def rendered(description, **options):
    scene = lippmann.load_scene(description, environment="none")
    return lippmann.render(scene, SHEET, placement=IN_PLACE, **options)


@pytest.mark.long
def test_native_rays_run_as_far_through_a_slab_as_they_are_slanted():
    description = SceneDescription("slab", volume=SLAB)
    whole, image = rendered(description), rendered(description, spp=1)
    assert (whole.provenance.spp, image.provenance.spp, image.provenance.method) == (16, 1, "full")
    left = 0.8 ** (4 * slopes(SHEET))
    np.testing.assert_allclose(image.pixels, (1 - left)[..., None] * [0.5, 0.25, 0.125], rtol=2e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("z", "thickness"), [pytest.param(-20.0, 4.0, marks=pytest.mark.long), (-6.0, 2.0), (-3.0, 0.0)]
)
def test_surfaces_are_seen_through_a_volume_and_hide_what_is_behind(z, thickness):
    description = SceneDescription("both", [wall(z)], [WALL], [Instance(0, np.eye(4))], volume=SLAB)
    image = rendered(description, spp=1, pixel_filter="point")
    left = 0.8 ** (thickness * slopes(SHEET))[..., None]
    np.testing.assert_allclose(image.pixels, (1 - left) * [0.5, 0.25, 0.125] + left * [0.2, 0.4, 0.6], rtol=5e-4)


def test_light_stands_with_the_viewer():
    assert toward_light(np.eye(4)) @ [0, 0, 1] > 0.7
    turned = np.eye(4)
    turned[:3, :3] = 3.0 * np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]])  # the viewer looks along the world's -x
    assert toward_light(turned) == pytest.approx(toward_light(np.eye(4)) @ turned[:3, :3] / 3.0)
