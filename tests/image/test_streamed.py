"""Pictures read piece by piece show what they show in one piece."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import tifffile
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.codecs import tiff
from lippmann.display.panel import PixelWindow
from lippmann.errors import PictureError
from lippmann.image import (
    IntegralImage,
    open_file,
    part_folders,
    read_picture,
    streamed,
    write_micro_images,
    write_views,
)
from lippmann.image.streamed import ChunkedPixels, LargePicture, open_picture, pixels_of_file
from lippmann.image.views import panel_rows_of_view_rows, pixels_of_view, pixels_of_view_rows, view_grid
from lippmann.viewing.refocus import refocus
from lippmann.viewing.replay import replay

LAYOUTS = [
    {"lenses": (8, 5), "pixels": 4},
    {"lenses": (8, 5), "pixels": 4, "slant": 9.46, "distance": 400.0},
    {"lenses": (8, 5), "pixels": 4, "pitch": 1.13},
    {"layout": "square", "lenses": (7, 6), "pixels": 5},
    {"layout": "square", "lenses": (7, 6), "pixels": 5, "pitch": 1.27, "distance": 300.0},
    {"layout": "hexagonal", "lenses": (6, 6), "pixels": 5},
]


#: Each layout in one format, and each format: which pieces a file has is the same to all layouts.
PAIRS = [*(("tiled.tif", layout) for layout in LAYOUTS), ("strips.tif", LAYOUTS[4]), ("a.zarr", LAYOUTS[1])]
in_pieces = pytest.mark.parametrize(("saved", "layout"), PAIRS, indirect=["saved"], ids=range(len(PAIRS)))


@pytest.fixture(autouse=True, scope="module")
def all_are_large():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(streamed, "LARGE", 0)
        yield


@pytest.fixture(params=["tiled.tif", "strips.tif", "a.zarr"])
def saved(request, tmp_path, monkeypatch):
    """Write a picture so that it has many pieces, and open it twice: piece by piece and whole."""

    def call(display, bits=16, **provenance):
        rng = np.random.default_rng(3)
        pixels = rng.random((display.panel.height, display.panel.width, 3), dtype=np.float32)
        image = IntegralImage(pixels, display)
        image = replace(image, provenance=replace(image.provenance, **provenance))
        path = tmp_path / request.param
        monkeypatch.setattr(tiff, "TILE", 16)
        monkeypatch.setattr(tiff, "TILED_FROM", 0 if request.param == "tiled.tif" else 1 << 40)
        image.save(path, bits=bits)
        opened = open_picture(path)
        assert isinstance(opened, LargePicture)
        return opened, read_picture(path)

    return call


@pytest.mark.parametrize("bits", [8, 16, 32])
@pytest.mark.parametrize("transfer", ["srgb", "linear"])
def test_values_are_the_same(saved, display, bits, transfer):
    opened, whole = saved(display("square", lenses=(7, 6), pixels=5), bits, transfer=transfer)
    height, width = whole.pixels.shape[:2]
    assert (opened.provenance, opened.stored, opened.display) == (whole.provenance, whole.stored, whole.display)
    assert np.array_equal(opened.rows(0, height), whole.pixels)
    assert np.array_equal(opened.rows(3, 18), whole.rows(3, 18))
    rng = np.random.default_rng(0)
    row, column = rng.integers(0, height, (4, 9)), rng.integers(0, width, (4, 9))
    assert np.array_equal(opened.take(row, column), whole.pixels[row, column])
    assert np.array_equal(opened.take(row, column, slice(1, 2)), whole.take(row, column, slice(1, 2)))


@given(data=st.data())
@settings(max_examples=60, deadline=None)
def test_windows_and_single_pixels_of_any_cut(data):
    height, width = data.draw(st.integers(1, 20)), data.draw(st.integers(1, 20))
    high, wide = data.draw(st.integers(1, 24)), data.draw(st.integers(1, 24))
    values = np.random.default_rng(0).integers(0, 256, (height, width, 3), dtype=np.uint8)
    loads = []

    def load(row, column):
        loads.append((row, column))
        return values[row * high : (row + 1) * high, column * wide : (column + 1) * wide]

    source = ChunkedPixels(
        (width, height), (high, wide), values.dtype, load, cache_bytes=data.draw(st.integers(0, 400))
    )
    top, left = data.draw(st.integers(0, height - 1)), data.draw(st.integers(0, width - 1))
    window = PixelWindow(left, top, data.draw(st.integers(1, width - left)), data.draw(st.integers(1, height - top)))
    assert np.array_equal(source.window(window), values[window.slices])
    rows = np.array(data.draw(st.lists(st.integers(0, height - 1), max_size=12)), dtype=np.intp)
    columns = np.array([(3 * row + 1) % width for row in rows], dtype=np.intp)
    assert np.array_equal(source.take(rows, columns), values[rows, columns])


@pytest.fixture
def counted():
    """``counted(width, height)``: pieces of 4 x 4 pixels with no room for more than has to be kept, and their loads."""

    def make(width, height):
        loads = []

        def load(row, column):
            loads.append((row, column))
            return np.zeros((4, 4, 3), dtype=np.uint8)

        return ChunkedPixels((width, height), (4, 4), np.dtype(np.uint8), load, cache_bytes=0), loads

    return make


def test_pieces_are_decoded_once_while_they_are_kept(counted):
    source, loads = counted(4, 16)
    row = np.array([0, 1, 4, 5, 8, 2])
    source.take(row, np.zeros(6, dtype=int))
    source.take(row, np.zeros(6, dtype=int))
    assert loads == [(0, 0), (1, 0), (2, 0)]
    # What was not looked at for longest goes first.
    source.window(PixelWindow(0, 0, 1, 1))
    source.window(PixelWindow(0, 12, 1, 1))
    source.window(PixelWindow(0, 0, 1, 1))
    assert loads[3:] == [(3, 0)]
    source.window(PixelWindow(0, 4, 1, 1))
    assert loads[4:] == [(1, 0)]


def test_rows_from_the_top_down_decode_each_piece_once(counted):
    source, loads = counted(40, 32)
    for top in range(0, 29, 2):
        source.window(PixelWindow(0, top, 40, 4))
    assert len(loads) == len(set(loads)) == 10 * 8


@pytest.mark.long
@given(data=st.data())
@settings(max_examples=150, deadline=None)
def test_every_view_shows_the_same_pixels_without_a_table(random_displays, data):
    display = data.draw(random_displays())
    height, width = display.panel.height, display.panel.width
    numbers = np.arange(height * width, dtype=np.float32).reshape(height, width, 1)
    views, mask = IntegralImage(np.repeat(numbers, 3, axis=2), display).views_and_mask()
    grid = view_grid(display)
    row, i = np.indices(views.shape[2:4])
    for view in np.ndindex(*views.shape[:2]):
        found, at_row, at_column = pixels_of_view(display, grid, view, row, i)
        assert np.array_equal(found, mask[view])
        assert np.array_equal((at_row * width + at_column)[found], views[view][found][:, 0])
        first, last = sorted((data.draw(st.integers(0, len(row) - 1)), data.draw(st.integers(1, len(row)))))
        last = max(last, first + 1)
        parts = pixels_of_view_rows(display, grid, view, first, last)
        some = [np.broadcast_to(part, row[first:last].shape) for part in parts]
        assert np.array_equal(some[0], found[first:last])
        assert np.array_equal((some[1] * width + some[2])[some[0]], (at_row * width + at_column)[first:last][some[0]])
        top, bottom = panel_rows_of_view_rows(display, first, last)
        assert 0 <= top < bottom <= height
        assert ((some[1] >= top) & (some[1] < bottom))[some[0]].all()


@pytest.mark.slow
@in_pieces
def test_replay_and_refocus_see_the_same(saved, display, layout):
    opened, whole = saved(display(**layout))
    for options in ({}, {"filter": "linear"}, {"subpixels": True}, {"filter": "linear", "subpixels": True}):
        eye = (5.0, 2.0, 300.0)
        assert np.array_equal(replay(opened, eye, **options), replay(whole, eye, **options))
    for plane in (0.0, 4.0):
        np.testing.assert_allclose(refocus(opened, plane), refocus(whole, plane), atol=1e-6)


@pytest.mark.slow
@in_pieces
@pytest.mark.parametrize("write", [write_views, write_micro_images])
def test_folders_are_the_same(saved, display, layout, write, tmp_path, monkeypatch):
    opened, image = saved(display(**layout))
    count = write(image, tmp_path / "whole")
    # Little at a time, so that every kind of lot comes up.
    monkeypatch.setattr(part_folders, "LOT_BYTES", 3000)
    assert write(opened, tmp_path / "pieces") == count
    files = {path.name: path.read_bytes() for path in (tmp_path / "whole").iterdir()}
    assert {path.name: path.read_bytes() for path in (tmp_path / "pieces").iterdir()} == files


def test_folders_in_another_depth(saved, display, tmp_path):
    opened, image = saved(display(**LAYOUTS[0]))
    write_views(opened, tmp_path / "pieces", format="tiff", bits=8)
    write_views(image, tmp_path / "whole", format="tiff", bits=8)
    for path in (tmp_path / "whole").glob("*.tif"):
        assert path.read_bytes() == (tmp_path / "pieces" / path.name).read_bytes()
    manifests = [json.loads((tmp_path / name / "lippmann.json").read_text()) for name in ("pieces", "whole")]
    assert manifests[0] == manifests[1]


def test_small_pictures_are_read_whole(display, tmp_path, monkeypatch):
    monkeypatch.setattr(streamed, "LARGE", 1 << 25)
    image = IntegralImage(np.zeros((15, 12, 3), np.float32), display(lenses=(4, 5)))
    for name in ("a.tif", "a.png"):
        image.save(tmp_path / name)
        assert isinstance(open_picture(tmp_path / name), IntegralImage)


def test_formats_without_pieces_are_read_whole(display, tmp_path):
    IntegralImage(np.zeros((15, 12, 3), np.float32), display(lenses=(4, 5))).save(tmp_path / "a.png")
    assert isinstance(open_picture(tmp_path / "a.png"), IntegralImage)
    with pytest.raises(PictureError, match="piece by piece"):
        pixels_of_file(open_file(tmp_path / "a.png"))


def test_grey_and_transparent_pieces(tmp_path):
    rng = np.random.default_rng(0)
    grey = rng.integers(0, 256, (40, 50), dtype=np.uint8)
    tifffile.imwrite(tmp_path / "grey.tif", grey, tile=(16, 16), photometric="minisblack")
    source = pixels_of_file(open_file(tmp_path / "grey.tif"))
    assert np.array_equal(source.window(PixelWindow(0, 0, 50, 40)), np.repeat(grey[..., None], 3, axis=2))
    clear = rng.integers(0, 255, (40, 50, 4), dtype=np.uint8)
    tifffile.imwrite(tmp_path / "clear.tif", clear, tile=(16, 16), photometric="rgb", extrasamples=["unassalpha"])
    with pytest.raises(PictureError, match="transparent"):
        pixels_of_file(open_file(tmp_path / "clear.tif")).window(PixelWindow(0, 0, 4, 4))


@pytest.mark.parametrize("name", ["tiled.tif", "a.zarr"])
def test_damaged_pieces_are_refused_when_they_are_met(display, tmp_path, monkeypatch, name):
    monkeypatch.setattr(tiff, "TILE", 16)
    monkeypatch.setattr(tiff, "TILED_FROM", 0)
    pixels = np.random.default_rng(0).random((60, 60, 3), dtype=np.float32)
    path = tmp_path / name
    IntegralImage(pixels, display("square", lenses=(12, 12), pixels=5)).save(path)
    damaged = path
    if path.is_dir():
        damaged = sorted(file for file in path.rglob("*") if file.is_file() and "json" not in file.name)[-1]
    data = damaged.read_bytes()
    middle = len(data) // 2
    damaged.write_bytes(data[:middle] + bytes(60) + data[middle + 60 :])
    opened = open_picture(path)
    with pytest.raises(PictureError, match=f"{name}.*damaged"):
        opened.rows(0, 60)


def test_a_file_carries_no_seconds(display, tmp_path):
    image = IntegralImage(np.zeros((15, 12, 3), np.float32), display(lenses=(4, 5)))
    for name in ("a.png", "a.exr", "a.tif", "a.zarr"):
        files = []
        for seconds in (1.0, 2.0):
            made = replace(image.provenance, seconds={"trace": seconds})
            folder = tmp_path / f"{seconds}"
            folder.mkdir(exist_ok=True)
            replace(image, provenance=made).save(folder / name)
            parts = sorted(path for path in (folder / name, *(folder / name).rglob("*")) if path.is_file())
            files.append([path.read_bytes() for path in parts])
        assert files[0] == files[1]
