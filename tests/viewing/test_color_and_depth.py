"""Colour beside depth and depth maps: codes by hand, files read by other readers and read back."""

from __future__ import annotations

import av
import imagecodecs
import numpy as np
import OpenEXR
import pytest
import tifffile
from PIL import Image

from lippmann.codecs.rgbd_names import RgbdForm
from lippmann.display import load_display
from lippmann.errors import OutputError, SceneError, UsageError
from lippmann.image import IntegralImage
from lippmann.scene.readers import depth_photo
from lippmann.scene.readers.depth_layers import split_layers
from lippmann.scene.readers.depth_map import read_depth_map
from lippmann.scene.readers.depth_photo import read_depth_photo
from lippmann.scene.readers.load import load_scene
from lippmann.viewing import color_and_depth
from lippmann.viewing.color_and_depth import (
    depth_codes,
    named,
    range_of,
    rgbd_codes,
    visible_distance,
    write_depth,
    write_rgbd,
)
from lippmann.viewing.video_file import write_codes

EYE = (0.0, 0.0, 600.0)


@pytest.fixture(scope="module")
def slope():
    """A plane that leans from 30 mm behind the lens plane to 20 mm in front of it; nothing is hit above."""
    display = load_display("seed-lenticular")
    shape = display.panel.height, display.panel.width
    depth = np.broadcast_to(np.linspace(-30, 20, shape[1], dtype=np.float32), shape).copy()
    depth[:100] = -np.inf
    pixels = np.full((*shape, 3), (0.9, 0.2, 0.1), np.float32)
    return IntegralImage(pixels, display, maps={"depth": depth})


def test_codes_are_linear_in_inverse_depth():
    distance = np.array([[500.0, 600.0, 750.0, 1000.0, np.inf]], np.float32)
    # 1/500 is white, 1/1000 black: 1/600 lies two thirds of the way, 1/750 one third.
    assert depth_codes(distance, 500, 1000, 8, "near").tolist() == [[255, 170, 85, 0, 0]]
    assert depth_codes(distance, 500, 1000, 8, "far").tolist() == [[0, 85, 170, 255, 255]]
    assert depth_codes(distance, 500, 1000, 16, "near").tolist() == [[65535, 43690, 21845, 0, 0]]


def test_what_is_not_seen_is_far_where_all_else_is_at_one_distance():
    distance = np.array([[600, np.inf]], np.float32)
    assert depth_codes(distance, 600, 600, 8, "near").tolist() == [[255, 0]]
    assert depth_codes(distance, 600, 600, 8, "far").tolist() == [[0, 255]]


def test_distance_is_from_the_eye_and_infinite_where_nothing_is_hit(slope):
    distance = visible_distance(slope, EYE, (64, 64))
    assert np.isinf(distance[:10]).all()
    middle = distance[40]
    assert middle[32] == pytest.approx(605.0, abs=1.5)
    assert middle[-1] < 590 < 620 < middle[0]


def test_depth_of_a_film_is_coded_between_the_same_ends_in_each_frame(slope):
    seen = visible_distance(slope, EYE, (64, 64))
    wide = rgbd_codes(slope, RgbdForm(), EYE, between=(400.0, 900.0), size=(64, 64))[:, 64:]
    np.testing.assert_array_equal(wide[..., 0], depth_codes(seen, 400.0, 900.0, 8, "near"))
    assert wide.max() < rgbd_codes(slope, RgbdForm(), EYE, size=(64, 64))[:, 64:].max()


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("form", [RgbdForm(), RgbdForm(half=True), RgbdForm(white="far"), RgbdForm(True, "far")])
@pytest.mark.parametrize("kind", [".png", ".tif"])
def test_pictures_are_read_back_within_a_code(tmp_path, monkeypatch, slope, bits, form, kind):
    path = named(tmp_path / f"photo{kind}", form)
    codes = rgbd_codes(slope, form, EYE, bits=bits, size=(64, 64))
    write_rgbd(codes, path)
    if kind == ".png" and bits == 8:
        with Image.open(path) as picture:
            read = np.asarray(picture)
    else:
        read = tifffile.imread(path) if kind == ".tif" else imagecodecs.png_decode(path.read_bytes())
    np.testing.assert_array_equal(read, codes)
    assert read.shape == (64, 64 if form.half else 128, 3)
    color, depth = np.split(read, 2, axis=1)
    assert (color[40, 5] > color[40, 5][::-1]).tolist() == [True, False, False]
    right, left = int(depth[40, -2, 0]), int(depth[40, 1, 0])
    assert (right > left) == (form.white == "near")
    seen = []

    def watched(inverse, *rest):
        seen.append(inverse)
        return split_layers(inverse, *rest)

    monkeypatch.setattr(depth_photo, "split_layers", watched)
    load_scene(path)
    shares = seen[0] * (1.0 if bits == 8 else 65535.0)
    shares = shares if form.white == "near" else shares + 2**bits - 1
    distance = visible_distance(slope, EYE, (64, 64))
    expected = depth_codes(distance, *range_of(distance), bits, "near")
    expected = np.repeat(expected[:, ::2], 2, axis=1) if form.half else expected
    assert np.abs(shares - expected).max() <= 1.0


def test_halved_colours_are_means_of_light_and_halved_depths_are_those_of_surfaces(slope, monkeypatch):
    """As in pairs of half width: a black and a white column have half the light together, not half the code."""
    stripes = np.tile(np.float32([0, 1]), (4, 8))
    monkeypatch.setattr(color_and_depth, "replay", lambda *eye, **options: np.repeat(stripes[..., None], 3, axis=2))
    monkeypatch.setattr(color_and_depth, "visible_distance", lambda *seen: 500 + 500 * (1 - stripes))
    codes = rgbd_codes(slope, RgbdForm(half=True), EYE, size=(16, 4))
    assert codes.shape == (4, 16, 3)
    assert (codes[:, :8] == 188).all()  # sRGB's code of half the light
    assert (codes[:, 8:] == 0).all()  # the far columns; no surface lies between near and far


@pytest.mark.parametrize("form", [RgbdForm(), RgbdForm(True, "far")])
@pytest.mark.parametrize(("codec", "share", "most"), [("h264", 0.995, 4), ("hevc", 0.995, 2), ("h264-rgb", 1.0, 0)])
def test_a_film_keeps_depth_within_a_code(tmp_path, slope, form, codec, share, most):
    """Lossy codecs miss it along outlines alone, and the colours beside it do not bleed into it."""
    codes = rgbd_codes(slope, form, EYE)
    write_codes([codes] * 2, tmp_path / "film.mp4", codec=codec, has_depth=True)
    with av.open(str(tmp_path / "film.mp4")) as film:
        *_, last = (frame.to_ndarray(format="rgb24") for frame in film.decode(video=0))
    height, width = codes.shape[:2]
    error = np.abs(last[:height, width // 2 : width].astype(int) - codes[:, width // 2 :])
    assert (error <= 1).mean() >= share
    assert error.max() <= most


@pytest.mark.parametrize("kind", [".exr", ".tif", ".pfm", ".png"])
def test_depth_maps_are_read_back(tmp_path, slope, kind):
    distance = visible_distance(slope, EYE, (64, 48))
    path = tmp_path / f"photo_depth{kind}"
    write_depth(distance, path)
    if kind == ".exr":
        np.testing.assert_array_equal(OpenEXR.File(str(path)).channels()["Z"].pixels, distance)
    elif kind == ".tif":
        np.testing.assert_array_equal(tifffile.imread(path), distance)
    elif kind == ".pfm":
        with Image.open(path) as picture:
            np.testing.assert_array_equal(np.asarray(picture), distance)
    elif kind == ".png":
        with Image.open(path) as picture:
            codes = np.asarray(picture).astype(int)
        far = distance[np.isfinite(distance)].max()
        assert (codes[np.isinf(distance)] == 65535).all()
        assert np.abs(codes - distance / far * 65534)[np.isfinite(distance)].max() <= 0.51
    inverse = read_depth_map(path).inverse
    hit = np.isfinite(distance)
    ratio = inverse[hit] * distance[hit]
    assert ratio == pytest.approx(ratio.mean(), rel=2e-5)


def test_what_cannot_be(tmp_path, slope):
    with pytest.raises(UsageError, match="has no depth; that is one of its layers"):
        visible_distance(slope.with_pixels(slope.pixels, maps={}))
    with pytest.raises(OutputError, match="the name says another form; this one's ends in _rgbd-far"):
        named(tmp_path / "a_rgbd.png", RgbdForm(white="far"))
    Image.fromarray(np.zeros((8, 9, 3), np.uint8)).save(tmp_path / "odd_rgbd.png")
    with pytest.raises(SceneError, match=r"odd_rgbd\.png: is 9 pixels wide"):
        read_depth_photo(tmp_path / "odd_rgbd.png")
    tinted = np.zeros((8, 16, 3), np.uint8)
    tinted[:, 8:, 0] = 200
    Image.fromarray(tinted).save(tmp_path / "tinted_rgbd.png")
    with pytest.raises(SceneError, match="is a picture in colours; depth is grey"):
        read_depth_photo(tmp_path / "tinted_rgbd.png")
