"""Splats through displays, against a slow twin of whole pictures, and composited with surfaces."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import lippmann
from lippmann.color.transfer import decode_srgb, encode_srgb
from lippmann.display import Display, LensArray, Panel
from lippmann.options.placement import PlacementOptions
from lippmann.scene.values.description import Instance, Material, Mesh, SceneDescription
from lippmann.scene.values.splats import Splats, real_harmonics

SHEET = Display("sheet", Panel(48, 36, 0.25), LensArray("lenticular", 2.0), gap=6.0)
SLANTED = Display("slanted", Panel(48, 36, 0.25), LensArray("lenticular", 1.9, slant=9.5), gap=6.0)
HEXAGONS = Display("hexagons", Panel(48, 36, 0.25), LensArray("hexagonal", 2.0), gap=6.0)
#: The display's millimetres are the scene's.
IN_PLACE = PlacementOptions(place="display")


def random_splats(count, degree, seed=0):
    """Gaussians behind and about the lens plane of the displays, sub-pixel ones and large ones."""
    random = np.random.default_rng(seed)
    return Splats(
        (random.uniform(-1, 1, (count, 3)) * [6, 5, 8] - [0, 0, 4]).astype(np.float32),
        np.exp(random.normal(-0.5, 0.8, (count, 3))).astype(np.float32),
        Rotation.random(count, rng=random).as_quat().astype(np.float32),
        random.uniform(0.05, 1, count).astype(np.float32),
        (0.4 * random.normal(size=(count, (degree + 1) ** 2, 3))).astype(np.float32),
    )


def twin(splats, origins, directions, behind=0.0, ends=np.inf):
    """Linear colours of rays ``(n, 3)``: all Gaussians of each, sorted by their peaks, in float64."""
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    axes = Rotation.from_quat(splats.rotations.astype(float)).as_matrix() * splats.scales.astype(float)[:, None, :]
    inverse = np.linalg.inv(axes @ axes.transpose(0, 2, 1))
    offset = splats.centers[None] - origins[:, None]
    curved = np.einsum("nij,rj->rni", inverse, directions)
    peak = np.einsum("rni,rni->rn", curved, offset) / np.einsum("rni,ri->rn", curved, directions)
    nearest = peak[..., None] * directions[:, None] - offset
    alpha = splats.opacities * np.exp(-0.5 * np.einsum("rni,nij,rnj->rn", nearest, inverse, nearest))
    alpha = np.where((peak >= 0) & (peak <= np.reshape(ends, (-1, 1))) & (alpha >= 1 / 255), np.minimum(alpha, 0.99), 0)
    basis = np.stack(real_harmonics(*directions.T), axis=1)[:, : splats.harmonics.shape[1]]
    color = np.maximum(0, 0.5 + np.einsum("rj,njc->rnc", basis, splats.harmonics))
    order = np.argsort(peak, axis=1)
    alpha = np.take_along_axis(alpha, order, axis=1)
    color = np.take_along_axis(color, order[..., None], axis=1)
    left = np.cumprod(1 - alpha, axis=1)
    before = np.concatenate([np.ones((len(left), 1)), left[:, :-1]], axis=1)
    return decode_srgb(((before * alpha)[..., None] * color).sum(axis=1) + left[:, -1:] * behind)


def light_rays(display, channel=None):
    v, u = np.mgrid[: display.panel.height, : display.panel.width] + 0.5
    u, v = u.ravel(), v.ravel()
    x, y = display.panel_point(u, v) if channel is None else display.subpixel_point(u, v, np.full(u.shape, channel))
    origin, direction = display.light_ray(x, y)
    return (np.stack(np.broadcast_arrays(*part, x)[:3], axis=1).astype(float) for part in (origin, direction))


def psnr(found, true):
    return -10 * np.log10(np.mean((encode_srgb(np.float64(found)) - encode_srgb(true)) ** 2))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("display", "degree"),
    [(SHEET, 0), (SHEET, 1), (SLANTED, 2), (SLANTED, 3), (HEXAGONS, 3)],
    ids=lambda value: getattr(value, "name", str(value)),
)
def test_pictures_are_those_of_the_twin(display, degree):
    splats = random_splats(150, degree, seed=degree)
    scene = lippmann.load_scene(SceneDescription("cloud", splats=splats))
    image = lippmann.render(scene, display, placement=IN_PLACE)
    assert image.provenance.spp == 1
    true = np.empty((*image.pixels.shape[:2], 3))
    for channel in range(3):
        own = channel if image.provenance.subpixels else None
        true[..., channel] = twin(splats, *light_rays(display, own))[:, channel].reshape(true.shape[:2])
    assert psnr(image.pixels, true) > 60
    assert image.provenance.subpixels == (display is SLANTED)
    # The twin of a cloud that lacks some splats is another picture.
    fewer = twin(splats.select(np.arange(10, 150)), *light_rays(display)).reshape(true.shape)
    assert psnr(image.pixels, fewer) < 50


def wall(z, half=50.0):
    corners = np.float32([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])
    return Mesh("wall", corners, np.uint32([[0, 1, 2], [0, 2, 3]]), 0)


def beside_wall(splats, z, color=(0.5, 0.25, 0.125), **material):
    glow = Material("glow", base_color=color, unlit=True, **material)
    return SceneDescription("both", [wall(z)], [glow], [Instance(0, np.eye(4))], splats=splats)


@pytest.mark.long
def test_surfaces_are_seen_through_splats_and_hide_those_behind():
    splats = random_splats(150, 1)
    color = np.array([0.5, 0.25, 0.125])
    origins, directions = light_rays(SHEET)
    for z in (-4.0, -40.0):
        scene = lippmann.load_scene(beside_wall(splats, z), environment="none")
        image = lippmann.render(scene, SHEET, placement=IN_PLACE, spp=1, pixel_filter="point")
        ends = (z - origins[:, 2]) / (directions[:, 2] / np.linalg.norm(directions, axis=1))
        true = twin(splats, origins, directions, encode_srgb(color), ends)
        assert psnr(image.pixels.reshape(-1, 3), true) > 60
        assert (psnr(image.pixels.reshape(-1, 3), twin(splats, origins, directions, encode_srgb(color))) < 40) == (
            z > -9
        )


@pytest.mark.slow
def test_nothing_behind_a_near_wall_is_seen():
    splats = random_splats(50, 0)
    behind = Splats(
        splats.centers - np.float32([0, 0, 30]), splats.scales, splats.rotations, splats.opacities, splats.harmonics
    )
    scene = lippmann.load_scene(beside_wall(behind, -1.0), environment="none")
    image = lippmann.render(scene, SHEET, placement=IN_PLACE, spp=1)
    np.testing.assert_allclose(image.pixels, np.broadcast_to([0.5, 0.25, 0.125], image.pixels.shape), rtol=1e-5)


@pytest.mark.slow
def test_holes_of_surfaces_show_the_splats_behind():
    splats = random_splats(50, 0)
    hole = lippmann.load_scene(beside_wall(splats, 9.0, alpha=0.0, alpha_mode="mask"), environment="none")
    image = lippmann.render(hole, SHEET, placement=IN_PLACE, spp=1, pixel_filter="point")
    true = twin(splats, *light_rays(SHEET)).reshape(image.pixels.shape)
    assert psnr(image.pixels, true) > 50


def test_backgrounds_lie_behind_and_linear_colors_are_composited_as_they_are():
    splats = random_splats(60, 0)
    scene = lippmann.load_scene(SceneDescription("cloud", splats=splats), background=(0.2, 0.4, 0.6))
    image = lippmann.render(scene, SHEET, placement=IN_PLACE)
    true = twin(splats, *light_rays(SHEET), behind=encode_srgb(np.array([0.2, 0.4, 0.6])))
    assert psnr(image.pixels.reshape(-1, 3), true) > 60
    linear = Splats(*(getattr(splats, name) for name in splats.__dataclass_fields__ if name != "linear"), linear=True)
    image = lippmann.render(lippmann.load_scene(SceneDescription("c", splats=linear)), SHEET, placement=IN_PLACE)
    codes = encode_srgb(twin(splats, *light_rays(SHEET)))
    assert psnr(np.clip(image.pixels.reshape(-1, 3), 0, 1), np.clip(codes, 0, 1)) > 60
