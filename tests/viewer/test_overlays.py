"""Maps in colours: which there are, what their colours mean."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel
from lippmann.image import IntegralImage, Provenance
from lippmann.metrics.error_image import BRIGHTEST, SCALE, in_false_color
from lippmann.rendering.reprojection.point_image import INTERPOLATED, REPROJECTED, TRACED
from lippmann.viewer.overlays import overlays
from lippmann.viewer.tiles import Tiles
from lippmann.viewing.diagnostic_maps import EMPTY_CODE

SHAPE = (6, 10)
ALL = (slice(None), slice(None))
LENSES = LensArray("lenticular", 0.5)
DISPLAY = Display("d", Panel(10, 6, 0.1), LENSES, gap=1.0, viewing_distance=500.0, aperture_distance=5.0)
DARK, BRIGHT = np.rint(255 * SCALE[0]), np.rint(255 * SCALE[-1])


def picture(maps, **made):
    return IntegralImage(np.zeros((*SHAPE, 3)), DISPLAY, maps=maps, provenance=Provenance(**made))


def plain(value, *channels):
    return np.full((*SHAPE, *channels), value, dtype=np.float32)


def test_a_picture_without_maps_has_none():
    assert overlays(picture({})) == {}


def test_known_maps_come_first_and_what_is_no_picture_not_at_all():
    names = ("zeal", "albedo", "normal", "depth", "samples", "error", "status", "position", "shape", "pair")
    channels = {"albedo": (3,), "normal": (3,), "position": (3,), "pair": (2,)}
    maps = {name: plain(0, *channels.get(name, ())) for name in names}
    assert list(overlays(picture(maps))) == ["status", "error", "samples", "depth", "normal", "albedo", "zeal"]


def test_origins_of_pixels():
    status = plain(REPROJECTED)
    status[0, 0], status[1, 2], status[5, 9] = TRACED, INTERPOLATED, -1
    overlay = overlays(picture({"status": status}))["status"]
    colors = {item["label"]: tuple(item["color"]) for item in overlay.description["classes"]}
    codes = overlay.codes(ALL)
    assert tuple(codes[0, 0]) == colors["traced"]
    assert tuple(codes[1, 2]) == colors["interpolated"]
    assert tuple(codes[3, 3]) == colors["reprojected"]
    assert tuple(codes[5, 9]) == EMPTY_CODE
    assert len(set(colors.values())) == 3


def test_only_origins_that_occur_are_explained():
    overlay = overlays(picture({"status": plain(TRACED)}))["status"]
    assert [item["label"] for item in overlay.description["classes"]] == ["traced"]


@pytest.mark.parametrize(("method", "value"), [("full", 0.01), ("error map", 0.1)])
def test_errors_of_estimates_are_squares_those_of_comparisons_roots(method, value):
    error = plain(value)
    error[0, 0] = 0
    overlay = overlays(picture({"error": error}, method=method))["error"]
    assert overlay.description["range"] == [0.0, BRIGHTEST]
    codes = overlay.codes(ALL)
    np.testing.assert_array_equal(codes[0, 0], DARK)
    np.testing.assert_array_equal(codes[1, 1], np.rint(255 * in_false_color(np.array(0.1 / BRIGHTEST))))


def test_other_numbers_fill_their_own_scale():
    depth = np.linspace(-30, 20, SHAPE[0] * SHAPE[1], dtype=np.float32).reshape(SHAPE)
    depth[0, 1] = -np.inf
    overlay = overlays(picture({"depth": depth}))["depth"]
    assert overlay.description["range"] == [-30.0, 20.0]
    assert overlay.description["unit"] == "mm"
    np.testing.assert_array_equal(overlay.description["colors"], np.rint(255 * SCALE))
    codes = overlay.codes(ALL)
    np.testing.assert_array_equal(codes[0, 0], DARK)
    np.testing.assert_array_equal(codes[-1, -1], BRIGHT)
    assert tuple(codes[0, 1]) == EMPTY_CODE


def test_counts_begin_at_zero():
    assert overlays(picture({"samples": plain(8)}))["samples"].description["range"] == [0.0, 8.0]


@pytest.mark.parametrize("value", [3.0, 1e20, np.nan, -np.inf])
def test_scales_have_a_length(value):
    overlay = overlays(picture({"depth": plain(value)}))["depth"]
    low, high = overlay.description["range"]
    assert high > low
    assert np.isfinite([low, high]).all()
    assert overlay.codes(ALL).shape == (*SHAPE, 3)


def test_whole_numbers_are_shown_too():
    samples = np.arange(60, dtype=np.uint32).reshape(SHAPE)
    codes = overlays(picture({"samples": samples}))["samples"].codes(ALL)
    np.testing.assert_array_equal(codes[-1, -1], BRIGHT)


def test_normals_and_reflectances_are_their_own_colours():
    normal, albedo = plain(0, 3), plain(1, 3)
    normal[..., 2] = 1
    found = overlays(picture({"normal": normal, "albedo": albedo}))
    assert tuple(found["normal"].codes(ALL)[0, 0]) == (128, 128, 255)
    assert tuple(found["albedo"].codes(ALL)[0, 0]) == (255, 255, 255)


def test_parts_are_parts_of_the_whole():
    depth = np.random.default_rng(2).random(SHAPE, dtype=np.float32)
    tiles = Tiles(picture({"depth": depth}), 4)
    whole = overlays(picture({"depth": depth}))["depth"].codes(ALL)
    np.testing.assert_array_equal(tiles.codes("depth", 1, 1), whole[4:8, 4:8])
    assert [layer["name"] for layer in tiles.description()["layers"]] == ["picture", "depth"]
