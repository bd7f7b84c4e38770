"""Pooled pictures against the full renderer's, and against radiance that is known exactly."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")


def coded(x):
    x = np.clip(x, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def squared_error(a, b):
    return float(np.mean((coded(a) - coded(b)) ** 2))


def wall(z=-1.0, scale=4.0, **bsdf):
    import mitsuba as mi

    return {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().translate([0, 0, z]).scale(scale),
        "bsdf": bsdf or {"type": "diffuse", "reflectance": 0.5},
    }


def sky(value=1.0):
    return {"type": "constant", "radiance": value}


def studio():
    """A textured floor and wall, a rough metal ball, a mirror ball and a glass ball under a lamp and a sky."""
    import mitsuba as mi

    transform = mi.ScalarTransform4f
    board = {
        "type": "checkerboard",
        "color0": {"type": "rgb", "value": [0.7, 0.5, 0.3]},
        "color1": {"type": "rgb", "value": [0.1, 0.2, 0.4]},
        "to_uv": transform().scale(8),
    }
    return {
        "floor": {
            "type": "rectangle",
            "to_world": transform().translate([0, -0.9, 0]).rotate([1, 0, 0], -90).scale(3),
            "bsdf": {"type": "diffuse", "reflectance": board},
        },
        "wall": wall(-1.5),
        "metal": {
            "type": "sphere",
            "center": [-0.9, -0.2, -0.3],
            "radius": 0.6,
            "bsdf": {"type": "roughconductor", "alpha": 0.3},
        },
        "glass": {"type": "sphere", "center": [0.2, -0.3, 0.2], "radius": 0.4, "bsdf": {"type": "dielectric"}},
        "mirror": {"type": "sphere", "center": [1.1, -0.1, -0.5], "radius": 0.6, "bsdf": {"type": "conductor"}},
        "lamp": {
            "type": "rectangle",
            "to_world": transform().translate([0, 2, 0]).rotate([1, 0, 0], 90).scale(0.7),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [4, 4, 3]}},
        },
        "sky": sky(0.2),
    }


@pytest.mark.parametrize("subpixels", [False, True])
def test_wall_under_an_even_sky_shows_its_albedo(make_pooled, subpixels):
    # An infinite diffuse wall sees nothing but the sky: its radiance is the albedo. A doubled albedo would show.
    pooled, _ = make_pooled({"wall": wall(scale=200.0), "sky": sky()}, depth=1, subpixels=subpixels)
    pooled.add(4)
    for picture in (pooled.picture(), pooled.raw()):
        assert picture.mean() == pytest.approx(0.5, abs=3e-3)
    # Four samples of sky and surface leave a noise of 0.1 in each pixel; shared, it is much less.
    np.testing.assert_allclose(pooled.picture(), 0.5, atol=0.1)
    assert pooled.picture().std() < pooled.raw().std() / 2


def test_white_furnace_is_one_through_glass_and_mirrors(make_pooled):
    white = {"type": "diffuse", "reflectance": 1.0}
    ball = {"type": "sphere", "center": [-0.6, 0, -0.4], "radius": 0.5, "bsdf": {"type": "dielectric"}}
    mirror = {
        "type": "sphere",
        "center": [0.7, 0, -0.4],
        "radius": 0.5,
        "bsdf": {"type": "conductor", "material": "none"},
    }
    parts = {"wall": wall(-1.5, **white), "ball": ball, "mirror": mirror, "sky": sky()}
    pooled, _ = make_pooled(parts, depth=64)
    pooled.add(4)
    assert pooled.picture().mean() == pytest.approx(1, abs=0.01)
    np.testing.assert_allclose(pooled.picture(), 1, atol=0.3)


def test_error_and_bias_vanish_as_samples_grow(make_pooled):
    _, full = make_pooled(studio())
    reference = full(1024)
    errors, biases = [], []
    for samples in (2, 32):
        pooled, _ = make_pooled(studio(), seed=3)
        pooled.add(samples)
        errors.append(squared_error(pooled.picture(), reference))
        biases.append(abs(float(pooled.picture().mean() / reference.mean()) - 1))
    assert errors[1] < errors[0] / 2.5
    assert biases[1] < 0.01


def test_wins_over_full_at_equal_paths(make_pooled):
    pooled, full = make_pooled(studio(), seed=5)
    reference = full(1024)
    pooled.add(8)
    assert squared_error(pooled.picture(), reference) < squared_error(full(8), reference) / 3


def test_unpooled_picture_is_unbiased(make_pooled):
    pooled, full = make_pooled(studio(), seed=6)
    reference = full(256)
    pooled.add(64)
    blocks = [x.reshape(2, 16, 8, 16, 3).mean(axis=(1, 3)) for x in (pooled.raw(), reference)]
    np.testing.assert_allclose(blocks[0], blocks[1], rtol=0.06, atol=0.01)


def test_what_is_added_at_once_or_bit_by_bit_is_the_same(make_pooled):
    one, _ = make_pooled(studio(), seed=8)
    two, _ = make_pooled(studio(), seed=8)
    one.add(4)
    for _ in range(4):
        two.add(1)
    np.testing.assert_allclose(one.raw(), two.raw(), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(one.picture(), two.picture(), rtol=1e-3, atol=1e-3)


def test_two_sides_of_a_sheet_do_not_share_light(make_pooled):
    import mitsuba as mi

    # A thin sheet seen edge on from both sides: its upper side is lit, the lower in the dark.
    transform = mi.ScalarTransform4f
    sheet = {
        "type": "rectangle",
        "to_world": transform().rotate([1, 0, 0], -90).scale([3, 2, 1]),
        "bsdf": {"type": "twosided", "nested": {"type": "diffuse", "reflectance": 0.8}},
    }
    lamp = {"type": "directional", "direction": [0, -1, 0], "irradiance": 2.0}
    tilted = {"sheet": sheet | {"to_world": transform().rotate([1, 0, 0], -80).scale(3)}, "lamp": lamp}
    pooled, full = make_pooled(tilted, depth=1)
    pooled.add(4)
    below = {"sheet": sheet | {"to_world": transform().rotate([1, 0, 0], -100).scale(3)}, "lamp": lamp}
    dark, dark_full = make_pooled(below, depth=1)
    dark.add(4)
    assert full(4).mean() > 0.05
    np.testing.assert_allclose(pooled.picture(), full(64), atol=0.1)
    np.testing.assert_allclose(dark.picture(), dark_full(4), atol=1e-6)


@pytest.mark.parametrize("fault", ["none", "shift", "albedo"])
def test_error_estimate_tells_good_pictures_from_faulty_ones(make_pooled, monkeypatch, fault):
    pooled, full = make_pooled(studio(), seed=9)
    pooled.add(18)
    see = pooled.see
    if fault == "shift":  # everything shows one lens to the right
        monkeypatch.setattr(pooled, "see", lambda: tuple(np.roll(part, 8, axis=1) for part in see()))
    if fault == "albedo":
        monkeypatch.setattr(pooled, "see", lambda: (see()[0] * 2, see()[1] * 2, *see()[2:]))
    # Unpooled samples would make up for the fault: here they only judge.
    weightless = np.zeros((32, 128), np.float32)
    monkeypatch.setattr("lippmann.render.pooled.renderer.blended", lambda x, y, judge, block: (x, weightless))
    true = squared_error(pooled.picture(), full(512))
    estimated = float(pooled.squared_error().values.mean())
    # The slope of the coding curve stands for the curve: large errors in the dark come out too large.
    assert (true > 1e-2) == (fault != "none")
    assert (estimated > 5e-3) == (fault != "none")


def test_error_estimate_is_right_in_the_mean(make_pooled):
    # What was chosen must not be judged by what chose it: the estimate would be too good.
    _, full = make_pooled(studio())
    reference = full(512)
    true, estimated = [], []
    for seed in range(5):
        pooled, _ = make_pooled(studio(), seed=20 + seed, looks=16)
        pooled.add(6)
        true.append(squared_error(pooled.picture(), reference))
        estimated.append(float(pooled.squared_error().values.mean()))
    spread = np.std(estimated) / np.sqrt(len(estimated))
    assert abs(np.mean(estimated) - np.mean(true)) < 3 * spread + 0.1 * np.mean(true)


def test_share_of_pooled_light_falls_as_samples_grow(make_pooled):
    pooled, _ = make_pooled(studio(), seed=4)
    pooled.add(1)
    assert (pooled.pooled_share() == 1).all()
    pooled.add(5)
    few = pooled.pooled_share()
    pooled.add(24)
    many = pooled.pooled_share()
    assert few.shape == (32, 128)
    assert 0 <= many.min() <= many.mean() < few.mean() <= few.max() <= 1


def test_error_needs_samples(make_pooled):
    from lippmann.errors import UsageError

    pooled, _ = make_pooled(studio())
    pooled.add(2)
    with pytest.raises(UsageError, match="at least 6"):
        pooled.squared_error()


def test_little_memory_makes_cells_larger_and_says_so(make_pooled, monkeypatch):
    monkeypatch.setattr("lippmann.render.pooled.renderer.LEAST_CELLS", 300)
    pooled, full = make_pooled(studio(), memory=1 << 20)
    pooled.add(4)
    error = squared_error(pooled.picture(), full(256))
    assert "memory" in pooled.notes[0]
    assert error < 0.01


def test_errors_flicker_less_than_those_of_full(make_pooled, lens_display):
    from lippmann.image import IntegralImage
    from lippmann.quality import view_flicker

    pooled, full = make_pooled(studio(), seed=12)
    pooled.add(8)
    reference, noisy, shared = (
        IntegralImage(pixels, lens_display, np.eye(4)) for pixels in (full(1024), full(8, seed=5), pooled.picture())
    )
    # At an equal error its share says how much of it changes from view to view.
    assert view_flicker(reference, shared).share < view_flicker(reference, noisy).share
