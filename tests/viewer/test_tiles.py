"""Tiles are the picture's own codes, whatever they are cut from, and its maps in colours."""

from __future__ import annotations

import io

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from PIL import Image

from lippmann.color.transfer import dequantize, quantize
from lippmann.display import Display, LensArray, Panel
from lippmann.errors import UsageError
from lippmann.image import IntegralImage, Provenance, open_picture, read_picture
from lippmann.viewer.tiles import PICTURE, TILE_SIZE, Tiles

LENSES = LensArray("lenticular", 0.4)


def display(width, height):
    return Display("d", Panel(width, height, 0.1), LENSES, gap=1.0, viewing_distance=500.0, aperture_distance=5.0)


def picture(pixels, **parts):
    height, width = pixels.shape[:2]
    return IntegralImage(pixels, display(width, height), **parts)


@pytest.fixture
def noise():
    return np.random.default_rng(1).random((21, 34, 3), dtype=np.float32)


def joined(tiles, layer=PICTURE):
    rows = [[tiles.codes(layer, column, row) for column in range(tiles.columns)] for row in range(tiles.rows)]
    return np.concatenate([np.concatenate(row, axis=1) for row in rows])


@pytest.mark.parametrize("size", [1, 5, 7, 21, 34, 100])
@pytest.mark.parametrize("transfer", ["srgb", "linear"])
def test_tiles_together_are_the_picture(noise, size, transfer):
    image = picture(noise, provenance=Provenance(transfer=transfer))
    tiles = Tiles(image, size)
    assert (tiles.columns, tiles.rows) == (-(-34 // size), -(-21 // size))
    np.testing.assert_array_equal(joined(tiles), quantize(noise, 8, transfer))


def test_edge_tiles_are_smaller(noise):
    assert Tiles(picture(noise), 16).codes(PICTURE, 2, 1).shape == (5, 2, 3)


def test_forms_hold_the_same_codes(noise):
    tiles = Tiles(picture(noise), 16)
    codes = tiles.codes(PICTURE, 1, 0)
    assert tiles.rgb(PICTURE, 1, 0) == codes.tobytes()
    with Image.open(io.BytesIO(tiles.png(PICTURE, 1, 0))) as png:
        np.testing.assert_array_equal(np.asarray(png), codes)
        assert "srgb" not in png.info
        assert "gamma" not in png.info


def test_description(noise):
    described = Tiles(picture(noise), 16).description()
    layers = [{"name": "picture", "title": "Picture"}]
    assert described == {"width": 34, "height": 21, "size": 16, "columns": 3, "rows": 2, "layers": layers}
    assert TILE_SIZE == 1024


@pytest.mark.parametrize(
    ("layer", "column", "row"), [("depth", 0, 0), ("", 0, 0), (PICTURE, 3, 0), (PICTURE, 0, 2), (PICTURE, -1, 0)]
)
def test_what_is_not_there_is_said(noise, layer, column, row):
    with pytest.raises(UsageError, match=r"unknown layer|no layer|there is no tile"):
        Tiles(picture(noise), 16).codes(layer, column, row)


@settings(
    max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(
    codes=arrays.arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(5, 9), st.just(3))),
    transfer=st.sampled_from(["srgb", "linear"]),
    size=st.integers(1, 10),
    name=st.sampled_from(["a.png", "a.tif"]),
)
def test_codes_of_a_file_come_back(tmp_path, codes, transfer, size, name):
    image = picture(dequantize(codes, transfer), provenance=Provenance(transfer=transfer))
    image.save(tmp_path / name, bits=8)
    np.testing.assert_array_equal(joined(Tiles(open_picture(tmp_path / name, keeps_codes=True), size)), codes)


FILES = [("a.png", 8), ("a.png", 16), ("a.exr", 16), ("a.exr", 32), ("a.tif", 8), ("a.tif", 16), ("a.tif", 32)]


@pytest.mark.parametrize(("name", "bits"), FILES)
def test_files_of_all_depths_are_shown_by_the_same_codes(noise, tmp_path, name, bits):
    picture(noise).save(tmp_path / name, bits=bits)
    expected = quantize(read_picture(tmp_path / name).pixels, 8, "srgb")
    np.testing.assert_array_equal(joined(Tiles(open_picture(tmp_path / name, keeps_codes=True), 16)), expected)


def test_values_beyond_the_codes_are_clipped_like_the_display_does():
    pixels = np.array([[[-1.0, 0.5, 7.0]] * 5], dtype=np.float32)
    np.testing.assert_array_equal(joined(Tiles(picture(pixels))), quantize(pixels, 8, "srgb"))
