"""Places of views from the numbers in their names, as the field's archives and programs write them."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.errors import PictureError
from lippmann.quilts.view_names import line_of_grid, middle_row, places_of_views


def places(*names):
    return {path.name: place for place, path in places_of_views([Path(name) for name in names]).items()}


GRID = [(row, column) for row in range(2) for column in range(3)]


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("lego_{0:02}_{1:02}", GRID),
        ("scene2_{0}-{1}_rgb", GRID),
        ("{0:03}_{1:03}_640_480", GRID),  # numbers that all share say nothing
        ("view_x{1}_y{0}", GRID),
        ("Col{1:02}Row{0:02}_rgb", GRID),
        ("row{0}_col{1}", GRID),
        ("Cam{2:03}", [(number,) for number in range(6)]),
        ("shot2_{2:03}_30_36", [(number,) for number in range(6)]),
        ("take{2}_view{2}", [(number,) for number in range(6)]),  # both count: no rows repeat
    ],
)
def test_rows_and_columns_repeat_and_what_all_share_is_passed_over(name, expected):
    names = [name.format(row, column, number) for number, (row, column) in enumerate(GRID)]
    assert places(*names) == dict(zip(names, expected, strict=True))


@pytest.mark.parametrize(("down", "right"), [(1, 1), (1, -1), (-1, 1), (-1, -1)])
@pytest.mark.parametrize("end", ["", "_", "_30_36"])
def test_cameras_of_the_stanford_archive_are_ordered_by_where_they_stood(down, right, end):
    # out_ROW_COLUMN_Y_X: y downwards, x to the right, in mm; either may fall as its number rises.
    y, x = [60.25 * row * down - 30 for row in range(2)], [1100 + 61.5 * column * right for column in range(3)]
    names = {(row, column): f"out_{row:02}_{column:02}_{y[row]:.6f}_{x[column]:.6f}{end}.png" for row, column in GRID}
    found = places(*names.values())
    for (row, column), name in names.items():
        assert found[name] == (row if down > 0 else 1 - row, column if right > 0 else 2 - column)


@pytest.mark.parametrize("grid", [GRID, [(0, 0), (0, 1), (0, 2)], [(0, 0), (1, 0)]])
def test_views_of_jpeg_pleno_are_named_by_column_and_row(grid):
    names = {(row, column): Path(f"{column:03}_{row:03}.ppm") for row, column in grid}
    assert places_of_views([*names.values()]) == names


def test_names_without_numbers_and_doubles_are_named():
    with pytest.raises(PictureError, match=r"a\.png: the name has no number.*rename it: view_00"):
        places("a.png", "b_1.png")
    with pytest.raises(PictureError, match=r"a_1\.png: is the same view as a_01\.png"):
        places("a_01.png", "a_1.png")


def test_the_middle_row_of_a_grid_is_a_row_of_views():
    grid = {(row, column): Path(f"{row}_{column}") for row in (1, 2, 3) for column in (0, 1)}
    assert middle_row(grid) == ({0: Path("2_0"), 1: Path("2_1")}, 3)
    assert middle_row({(7,): Path("a"), (8,): Path("b")}) == ({7: Path("a"), 8: Path("b")}, 1)


@pytest.mark.parametrize("name", ["view_{0:02}_{1:02}.png", "out_{0:02}_{1:02}_{0}.0_{1}.0_.png"])
def test_of_a_whole_grid_the_middle_row_or_column_is_a_line(name):
    paths = {(row, column): Path(name.format(row, column)) for row in range(3) for column in range(5)}
    line, notes = line_of_grid(list(paths.values()))
    assert line == [paths[1, column] for column in range(5)]
    assert notes == ("of a grid of 5 x 3 cameras the middle row is taken: 5 views",)
    assert line_of_grid(list(paths.values()), down=True)[0] == [paths[row, 2] for row in range(3)]


@pytest.mark.parametrize(
    "names",
    [
        ["a.jpg", "b.jpg"],
        ["frame_1.png", "frame_2.png", "frame_10.png"],
        ["v_0_0.png", "v_0_1.png", "v_1_0.png"],  # a corner is missing
        ["row1_1.png", "row1_2.png"],
    ],
)
def test_other_pictures_are_a_line_as_they_are(names):
    paths = [Path(name) for name in names]
    assert line_of_grid(paths) == (paths, ())


def test_views_of_the_benchmark_lie_in_rows_as_their_parameters_say(tmp_path):
    paths = [tmp_path / f"input_Cam{number:03}.png" for number in range(12)]
    assert places_of_views(paths)[(11,)] == paths[11]
    (tmp_path / "parameters.cfg").write_text("[extrinsics]\nnum_cams_x = 4\nnum_cams_y = 3\n")
    assert places_of_views(paths)[2, 3] == paths[11]
    assert line_of_grid(paths)[0] == paths[4:8]


def test_views_of_the_benchmark_without_parameters_are_a_square_if_all_are_there(tmp_path):
    paths = [tmp_path / f"input_Cam{number:03}.png" for number in range(25)]
    assert line_of_grid(paths)[0] == paths[10:15]
    assert line_of_grid(paths[10:14])[0] == paths[10:14]
    assert places_of_views(paths[:24])[(23,)] == paths[23]
