"""Zarr: everything comes back of every display, other programs see named axes, half stores are refused."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest
import zarr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lippmann.errors import PictureError
from lippmann.exchange import zarr_store
from lippmann.exchange.light_field import light_field_of
from lippmann.exchange.zarr_store import read_zarr, write_zarr

LAYOUTS = ("square", "lenticular", "hexagonal")
TYPES = st.sampled_from(["uint8", "uint16", "float16", "float32"])


def there_and_back(image, folder, stored):
    shutil.rmtree(folder, ignore_errors=True)
    write_zarr(light_field_of(image, stored), image.display, folder)
    return read_zarr(folder)


@pytest.mark.slow
@settings(max_examples=8, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(st.data(), TYPES)
def test_everything_comes_back_bit_by_bit(random_displays, picture, same, tmp_path_factory, data, stored):
    display = data.draw(random_displays(LAYOUTS))
    shape = (display.panel.height, display.panel.width)
    maps = {"shape": np.arange(shape[0] * shape[1], dtype=np.uint32).reshape(shape)}
    maps["normal"] = np.random.default_rng(0).normal(size=(*shape, 3)).astype(np.float32)
    image = picture(display, data.draw(st.integers(0, 99)), stored=stored, depth=True, maps=maps)
    same(there_and_back(image, tmp_path_factory.getbasetemp() / "x.zarr", stored).image(), image)


@pytest.mark.parametrize("name", ["panel-4k", "print-60lpi"])
def test_slanted_and_broken_lenses_too(picture, same, tmp_path, name):
    from lippmann.display import load_display

    image = picture(load_display(name).resized(90, 40), stored="uint8", depth=True)
    found = there_and_back(image, tmp_path / "x.zarr", "uint8")
    assert found.mask is not None
    same(found.image(), image)


def test_what_other_programs_see(display, picture, tmp_path):
    image = picture(display("square", lenses=(4, 3), pixels=2), stored="uint8", depth=True)
    field = light_field_of(image, "uint8")
    there_and_back(image, tmp_path / "x.zarr", "uint8")
    group = zarr.open_group(str(tmp_path / "x.zarr"), mode="r")
    assert group["LF"].shape == (2, 2, 3, 4, 3)
    assert group["LF"].chunks == (2, 2, 1, 4, 3)  # one row of lenses
    assert group["LF"].attrs["_ARRAY_DIMENSIONS"] == ["t", "s", "v", "u", "c"]
    assert group["maps/depth"].attrs["_ARRAY_DIMENSIONS"] == ["t", "s", "v", "u"]
    np.testing.assert_array_equal(group["LF"][...], field.values)
    assert group.attrs["lippmann"] == 1
    assert group.attrs["layout"] == "zarr"
    assert group.attrs["display"]["name"] == "test-square"
    assert json.loads((tmp_path / "x.zarr" / "LF" / ".zarray").read_text())["zarr_format"] == 2


def test_a_sheet_has_chunks_of_about_a_megabyte(picture, tmp_path):
    from lippmann.display import load_display

    image = picture(load_display("seed-lenticular"), stored="uint16")
    there_and_back(image, tmp_path / "x.zarr", "uint16")
    chunks = zarr.open_group(str(tmp_path / "x.zarr"), mode="r")["LF"].chunks
    assert chunks == (1, 8, 341, 64, 3)


def test_black_is_written_too_so_that_a_missing_chunk_is_noticed(display, picture, tmp_path):
    made = display("square", lenses=(4, 3), pixels=2)
    black = picture(made).with_pixels(np.zeros((6, 8, 3)))
    there_and_back(black, tmp_path / "x.zarr", "float32")
    assert len([p for p in (tmp_path / "x.zarr" / "LF").iterdir() if p.name[0] != "."]) == 3


def test_another_program_s_store(tmp_path, display):
    values = np.random.default_rng(0).random((3, 3, 3, 4, 3)).astype(np.float32)
    root = zarr.open_group(str(tmp_path / "x.zarr"), mode="w")
    zarr.open_array(str(tmp_path / "x.zarr"), path="LF", mode="w", shape=values.shape, dtype="f4")[...] = values
    assert root is not None
    found = read_zarr(tmp_path / "x.zarr")
    np.testing.assert_array_equal(found.values, values)
    with pytest.raises(PictureError, match=r"has no display in it; its display has 3 x 3 pixels under each lens"):
        found.image(where="x.zarr")
    assert found.image(display()).stored == "float32"


@pytest.mark.skipif(not hasattr(zarr, "create_array"), reason="this zarr reads format 2 alone")
@pytest.mark.parametrize(
    ("version", "options"), [(3, {}), (2, {"chunk_key_encoding": {"name": "v2", "separator": "/"}})]
)
def test_another_program_s_store_of_many_chunks(tmp_path, monkeypatch, version, options):
    monkeypatch.setattr(zarr_store, "_FEW_CHUNKS", 8)
    values = np.random.default_rng(0).random((3, 3, 2, 3, 3)).astype(np.float32)
    group = zarr.open_group(str(tmp_path / "x.zarr"), mode="w", zarr_format=version)
    group.create_array("LF", shape=values.shape, chunks=(1, 1, 1, 1, 3), dtype="f4", **options)[...] = values
    np.testing.assert_array_equal(read_zarr(tmp_path / "x.zarr").values, values)


def test_axes_in_another_order_are_named(tmp_path):
    values = np.zeros((3, 3, 3, 4, 3), np.float32)
    root = zarr.open_group(str(tmp_path / "x.zarr"), mode="w")
    array = zarr.open_array(str(tmp_path / "x.zarr"), path="LF", mode="w", shape=values.shape, dtype="f4")
    array[...] = values
    array.attrs["_ARRAY_DIMENSIONS"] = list("vustc")
    assert root is not None
    with pytest.raises(PictureError, match="has the axes v, u, s, t, c; they must be t, s, v, u, c"):
        read_zarr(tmp_path / "x.zarr")
    array.attrs["_ARRAY_DIMENSIONS"] = ["row", "column", "y", "x", "colour"]
    np.testing.assert_array_equal(read_zarr(tmp_path / "x.zarr").values, values)


def test_half_and_wrong_stores_are_refused(display, picture, tmp_path):
    folder = tmp_path / "x.zarr"

    def refused():
        with pytest.raises(PictureError) as error:
            read_zarr(folder)
        assert str(error.value).startswith(str(folder))
        return str(error.value)

    assert "is no Zarr group" in refused()
    folder.mkdir()
    assert "is no Zarr group" in refused()
    image = picture(display("square", lenses=(4, 3), pixels=2), stored="uint8", depth=True)

    def written():
        there_and_back(image, folder, "uint8")

    written()
    (folder / "LF" / "0.0.1.0.0").unlink()
    assert "LF: 1 of its 3 chunks are missing, the first 0.0.1.0.0" in refused()
    written()
    (folder / "maps" / "depth" / "0.0.0.0").unlink()
    assert "maps/depth: 1 of its 3 chunks are missing" in refused()
    written()
    (folder / "LF" / "0.0.1.0.0").write_bytes(b"nonsense")
    assert "LF: is damaged" in refused()
    written()
    shutil.rmtree(folder / "LF")
    assert "LF" in refused()
    written()
    attributes = json.loads((folder / ".zattrs").read_text())
    (folder / ".zattrs").write_text(json.dumps(attributes | {"layout": "hci"}))
    assert "the layout is 'hci'; it must be 'zarr'" in refused()
    (folder / ".zattrs").write_text("{")
    assert "is no Zarr group" in refused()


def test_a_group_without_a_light_field_is_refused(tmp_path):
    zarr.open_group(str(tmp_path), mode="w")
    zarr.open_array(str(tmp_path), path="XY", mode="w", shape=(2, 2), dtype="u1")
    with pytest.raises(PictureError, match="has no array LF; it holds XY"):
        read_zarr(tmp_path)


@pytest.mark.parametrize(
    ("shape", "dtype", "what"),
    [
        ((3, 3, 4), "u1", "has the shape (3, 3, 4)"),
        ((2, 2, 2, 2, 3), "i8", "holds int64"),
        ((1 << 10, 1 << 10, 1 << 10, 4, 3), "u1", "claims 4294967296 pixels"),
    ],
)
def test_arrays_that_are_no_light_fields_are_refused_before_they_are_read(tmp_path, shape, dtype, what):
    zarr.open_group(str(tmp_path / "x.zarr"), mode="w")
    zarr.open_array(str(tmp_path / "x.zarr"), path="LF", mode="w", shape=shape, dtype=dtype, chunks=(1,) * len(shape))
    with pytest.raises(PictureError) as refused:
        read_zarr(tmp_path / "x.zarr")
    assert what in str(refused.value)
