"""Light shared between micro-images, on surfaces whose light is known everywhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel
from lippmann.display.micro_image_layout import lens_numbers, lens_numbers_in_full_color
from lippmann.display.panel import PixelWindow
from lippmann.rendering.film.feature_buffers import Guides
from lippmann.rendering.sharing.cross_lens import share_light

pytestmark = pytest.mark.usefixtures("engine")

RGB_STRIPE = ((-1 / 3, 0.0), (0.0, 0.0), (1 / 3, 0.0))
SIZE = (144, 60)
LENTICULAR = Display("sheet", Panel(*SIZE, 0.25), LensArray("lenticular", 3.0), 6.0, aperture_distance=40.0)
DISPLAYS = {
    "lenticular": LENTICULAR,
    "slanted": replace(LENTICULAR, lens_array=LensArray("lenticular", 2.3, slant=9.5)),
    "near viewer": replace(LENTICULAR, lens_array=LensArray("lenticular", 2.3, slant=-9.5), viewing_distance=300.0),
    "square": replace(LENTICULAR, lens_array=LensArray("square", 2.5)),
    "hexagonal": replace(LENTICULAR, lens_array=LensArray("hexagonal", 3.0), viewing_distance=400.0),
}


def on_plane(display: Display, z: float, channel: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Where the plane at height ``z`` is seen by each pixel, or by its sub-pixel: x and y in millimetres."""
    v, u = (index + 0.5 for index in np.mgrid[: display.panel.height, : display.panel.width].astype(float))
    if channel is None:
        x, y = display.panel_point(u, v)
    else:
        x, y = display.subpixel_point(u, v, np.full_like(u, channel))
    (ox, oy, oz), (dx, dy, dz) = display.light_ray(x, y)
    length = (z - oz) / dz
    return ox + length * dx, oy + length * dy


def waves(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Light on the plane, of 1 in the mean: smooth over a pixel, not over a lens."""
    return 1 + 0.4 * np.sin(2 * np.pi * x / 20.0) * np.cos(2 * np.pi * y / 12.0)


def plain_guides(display: Display, z: float, albedo: float = 0.5) -> Guides:
    shape = (display.panel.height, display.panel.width)
    normal = np.zeros((*shape, 3), np.float32)
    normal[..., 2] = 1
    return Guides(np.full((*shape, 3), albedo, np.float32), normal, np.full(shape, z, np.float32))


def gray(light: np.ndarray) -> np.ndarray:
    return np.repeat(light[..., None], 3, axis=2).astype(np.float32)


def inner(values: np.ndarray) -> np.ndarray:
    return values[8:-8, 24:-24]


@pytest.mark.parametrize("z", [-24.0, 15.0])
@pytest.mark.parametrize("name", DISPLAYS)
def test_light_is_fetched_from_where_the_same_point_lies(name, z):
    display = DISPLAYS[name]
    light = waves(*on_plane(display, z))
    guides = plain_guides(display, z)
    clean = share_light(gray(light * 0.5), display, guides, stop=0.0)
    assert np.abs(inner(clean)[..., 0] - inner(light) * 0.5).max() < 0.03
    # A wrong height fetches light from elsewhere: what is above can fail.
    wrong = share_light(gray(light * 0.5), display, replace(guides, height=-guides.height), stop=0.0)
    assert np.abs(inner(wrong)[..., 0] - inner(light) * 0.5).max() > 0.09


@pytest.mark.parametrize("name", DISPLAYS)
def test_noise_that_lenses_do_not_share_falls(name):
    display = DISPLAYS[name]
    light = waves(*on_plane(display, -24.0))
    noise = np.random.default_rng(5).normal(0, 0.02, light.shape)
    shared = share_light(gray(light + noise), display, plain_guides(display, -24.0, 1.0), stop=10.0)
    exact = share_light(gray(light), display, plain_guides(display, -24.0, 1.0), stop=10.0)
    left = inner(shared - exact)[..., 0]
    assert left.std() < 0.02 / 3.5
    assert abs(left.mean()) < 0.001


def test_an_even_light_stays_as_it_is_under_any_texture():
    albedo = np.random.default_rng(1).uniform(0, 1, (SIZE[1], SIZE[0], 3)).astype(np.float32)
    guides = replace(plain_guides(LENTICULAR, -20.0), albedo=albedo)
    pixels = 0.7 * (albedo + np.float32(0.02))
    np.testing.assert_allclose(share_light(pixels, LENTICULAR, guides, stop=40.0), pixels, rtol=0, atol=1e-6)


def test_light_of_other_surfaces_is_left_out():
    rng = np.random.default_rng(2)
    guides = plain_guides(LENTICULAR, -20.0)
    other = rng.random((SIZE[1], SIZE[0])) < 0.5
    light = np.where(other, 2.0, 1.0)
    for changed in ("normal", "height"):
        values = getattr(guides, changed).copy()
        values[other] = (1.0, 0.0, 0.0) if changed == "normal" else -60.0
        apart = replace(guides, **{changed: values})
        kept = share_light(gray(light), LENTICULAR, apart, stop=0.0)
        np.testing.assert_allclose(kept[..., 0], light, rtol=0, atol=2e-3)
    assert np.abs(share_light(gray(light), LENTICULAR, guides, stop=0.0)[..., 0] - light).mean() > 0.2


def test_what_shines_another_way_from_lens_to_lens_is_not_smeared():
    light = np.ones((SIZE[1], SIZE[0]))
    light[:, 70:74] = 4.0  # one lens's pixels alone
    guides = plain_guides(LENTICULAR, -20.0)
    kept = share_light(gray(light), LENTICULAR, guides, stop=40.0)[..., 0]
    np.testing.assert_allclose(kept, light, rtol=1e-3)
    assert share_light(gray(light), LENTICULAR, guides, stop=0.0)[30, 72, 0] < 3


def test_in_the_lens_plane_every_lens_stands_for_itself():
    rng = np.random.default_rng(3)
    per_lens = rng.uniform(1, 2, SIZE[0] // 12)
    light = np.broadcast_to(np.repeat(per_lens, 12), (SIZE[1], SIZE[0]))
    shared = share_light(gray(light), LENTICULAR, plain_guides(LENTICULAR, 0.0), stop=0.0)
    np.testing.assert_allclose(shared[..., 0], light, rtol=1e-5)


def test_sub_pixels_take_from_sub_pixels_of_their_own_colour_and_lens():
    display = replace(DISPLAYS["slanted"], panel=Panel(*SIZE, 0.25, subpixel_offsets=RGB_STRIPE))
    light = np.stack([waves(*on_plane(display, -24.0, channel)) for channel in range(3)], axis=2)
    light *= [0.5, 1.0, 2.0]
    guides = plain_guides(display, -24.0)
    shared = share_light(
        light.astype(np.float32), display, guides, stop=0.0, lenses=lens_numbers(display, subpixels=True)
    )
    assert (np.abs(inner(shared) - inner(light)) / [0.5, 1.0, 2.0]).max() < 0.06
    together = share_light(light.astype(np.float32), display, guides, stop=0.0)
    wrong = (np.abs(inner(together) - inner(light)) / [0.5, 1.0, 2.0]).mean()
    assert wrong > 1.5 * (np.abs(inner(shared) - inner(light)) / [0.5, 1.0, 2.0]).mean()


@pytest.mark.parametrize("order", ["rgb", "brg"])
def test_sub_pixels_in_full_colour_take_from_where_sub_pixels_lie(order):
    offsets = tuple((order.index(color) / 3 - 1 / 3, 0.0) for color in "rgb")
    display = replace(DISPLAYS["slanted"], panel=Panel(*SIZE, 0.25, subpixel_offsets=offsets))
    places = [on_plane(display, -24.0, "rgb".index(color)) for color in order]
    light = np.stack([waves(*place) for place in places], axis=2).reshape(SIZE[1], -1)
    normal = np.broadcast_to(np.float32([0, 0, 1]), (*light.shape, 3)).copy()
    height = np.full(light.shape, -24.0, np.float32)
    guides = Guides(np.full((*light.shape, 3), 0.5, np.float32), normal, height)
    noise = np.random.default_rng(6).normal(0, 0.02, light.shape)

    def shared(values, **options):
        lenses = lens_numbers_in_full_color(display)
        given = {"lenses": lenses, "columns": 3, **options}
        clean = share_light(gray(values * 0.5), display, guides, stop=0.0, **given)
        return clean[8:-8, 72:-72, 0] / 0.5

    exact = light[8:-8, 72:-72]
    assert np.abs(shared(light) - exact).max() < 0.06
    assert (shared(light + noise) - shared(light)).std() < 0.02 / 3.5
    # By the lenses of a panel with another order of its sub-pixels it would be worse: what is above can fail.
    other = replace(display, panel=replace(display.panel, subpixel_offsets=offsets[::-1]))
    moved = np.roll(lens_numbers_in_full_color(other), 8, axis=2)
    assert np.abs(shared(light, lenses=moved) - exact).max() > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("name", DISPLAYS)
def test_a_window_is_a_part_of_the_whole(name):
    display = DISPLAYS[name]
    pixels = gray(waves(*on_plane(display, -15.0)))
    guides = plain_guides(display, -15.0)
    whole = share_light(pixels, display, guides, stop=40.0)
    part = np.s_[4:60, 10:140]
    window = PixelWindow(10, 4, 130, 56)
    cut = Guides(guides.albedo[part], guides.normal[part], guides.height[part])
    inside = np.s_[26:-26, 45:-45]  # what no pixel outside reaches
    found = share_light(pixels[part], display, cut, stop=40.0, lenses=lens_numbers(display, window))
    np.testing.assert_allclose(found[inside], whole[part][inside], rtol=0, atol=1e-6)


def test_pixels_that_are_not_open_stay_as_they_are():
    display, guides = DISPLAYS["slanted"], plain_guides(DISPLAYS["slanted"], -20.0)
    pixels = np.random.default_rng(5).random((*guides.height.shape, 3), dtype=np.float32)
    mask = np.zeros(guides.height.shape, bool)
    mask[20:30, 40:90] = True
    whole, part = (share_light(pixels, display, guides, stop=0.0, mask=only) for only in (None, mask))
    np.testing.assert_array_equal(part[mask], whole[mask])
    np.testing.assert_allclose(part[~mask], pixels[~mask], rtol=1e-6)
