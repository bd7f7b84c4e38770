"""Folders of views: ours come back, others' are understood by their names, gaps are named."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from lippmann.errors import PictureError
from lippmann.exchange.light_field import light_field_of
from lippmann.exchange.view_folder import is_composable, read_view_folder, write_view_folder


@settings(max_examples=12, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(st.data(), st.sampled_from(["uint8", "uint16", "float16", "float32"]))
def test_values_come_back_bit_by_bit(random_displays, picture, same, tmp_path_factory, data, stored):
    image = picture(data.draw(random_displays()), data.draw(st.integers(0, 99)), stored=stored)
    folder = tmp_path_factory.getbasetemp() / "views"
    shutil.rmtree(folder, ignore_errors=True)
    write_view_folder(light_field_of(image, stored), image.display, folder)
    same(read_view_folder(folder).image(), image)


def test_names_count_from_the_top_left_camera(display, picture, tmp_path):
    image = picture(display("square", lenses=(2, 2), pixels=11), stored="uint8")
    field = light_field_of(image, "uint8")
    write_view_folder(field, image.display, tmp_path / "views")
    names = sorted(path.name for path in (tmp_path / "views").glob("*.png"))
    assert names[:2] == ["cam_00_00.png", "cam_00_01.png"]
    assert len(names) == 121
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "views" / "cam_03_10.png")), field.values[3, 10])


def others(folder, names, size=(4, 3)):
    folder.mkdir(exist_ok=True)
    for number, name in enumerate(names):
        Image.new("RGB", size, (number, 0, 0)).save(folder / name)
    return folder


def test_what_views_hold_and_do_not_show_is_noted(tmp_path):
    folder = others(tmp_path / "x", [f"{number}.png" for number in range(2)])
    for name, (across, down) in (("0.png", (100, 100)), ("1.png", (100, 200))):
        Image.new("RGB", (4, 3)).save(folder / name, dpi=(across, down))
    assert read_view_folder(folder, grid=(2, 1)).notes == (
        "1.png: its pixels are 2 times as wide as high: they are shown square",
    )


@pytest.mark.parametrize(
    ("names", "grid"),
    [
        ([f"lego_{row}_{column}.png" for row in range(2) for column in range(3)], None),
        ([f"x{row:02}-{column:02}_rgb.png" for row in range(1, 3) for column in range(1, 4)], None),
        ([f"input_Cam{number:03}.png" for number in range(6)], (3, 2)),
        ([f"{number}.png" for number in range(1, 7)], (3, 2)),
    ],
)
def test_other_programs_names_are_understood(tmp_path, names, grid):
    found = read_view_folder(others(tmp_path / "x", names), grid=grid)
    assert found.shape == (2, 3, 3, 4)
    assert found.values[:, :, 0, 0, 0].tolist() == [[0, 1, 2], [3, 4, 5]]


@pytest.mark.parametrize(
    ("names", "grid", "what"),
    [
        ([], None, "x: there are no views; they end in .png, .exr, .tif, .tiff, .zarr, .jpg, .jpeg, .webp, .avif"),
        (["a_0_0.png", "a_0_1.png", "a_1_1.png"], None, "the view in row 1, column 0, is missing"),
        (["a_0_0.png", "b_0_0.png"], None, "b_0_0.png: is the same view as a_0_0.png"),
        (["a_0_2.png", "a_0_3.png"], None, "the first view is missing; views are counted from 0 or 1"),
        (["a_0_0.png", "a_0_999999.png", "a_999999_999999.png"], None, "the view in row 0, column 1, is missing"),
        (["0.png", "1.png", "3.png"], (2, 2), "holds 3 views; the display has 2 x 2; weave views of"),
        (["0.png", "1.png", "3.png", "4.png"], (2, 2), "view 2 is missing"),
        (["0.png", "1.png"], None, "the number of views in a row is unknown"),
        (["a.png"], None, "a.png: the name has no number"),
    ],
)
def test_gaps_and_doubles_are_named(tmp_path, names, grid, what):
    folder = others(tmp_path / "x", names)
    with pytest.raises(PictureError) as refused:
        read_view_folder(folder, grid=grid)
    assert what in str(refused.value)


def test_views_of_differing_sizes_and_types_are_named(tmp_path):
    folder = others(tmp_path / "x", ["0_0.png", "0_1.png"])
    Image.new("RGB", (5, 3)).save(folder / "0_1.png")
    with pytest.raises(PictureError, match=r"0_1.png: has 5 x 3 pixels; the first view, 0_0.png, has 4 x 3"):
        read_view_folder(folder)
    (folder / "0_1.png").write_bytes(b"\x89PNG")
    with pytest.raises(PictureError, match=r"0_1.png: is no picture"):
        read_view_folder(folder)
    with pytest.raises(PictureError, match="no: no such file"):
        read_view_folder(tmp_path / "no")


def test_folders_of_lippmann_views_are_told_apart(display, picture, tmp_path):
    from lippmann.image import write_views

    image = picture(display(), stored="uint8")
    write_views(image, tmp_path / "ours")
    write_view_folder(light_field_of(image, "uint8"), image.display, tmp_path / "theirs")
    assert is_composable(tmp_path / "ours")
    assert not is_composable(tmp_path / "theirs")
    assert not is_composable(tmp_path)


def test_only_lenses_in_rows_and_columns(display, picture, tmp_path):
    image = picture(display("hexagonal"))
    with pytest.raises(PictureError, match="hexagonal lenses; a folder of views takes"):
        write_view_folder(light_field_of(image, "uint8"), image.display, tmp_path / "x")
    assert not list(tmp_path.iterdir())
