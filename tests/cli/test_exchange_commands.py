"""``lippmann export`` and ``lippmann import``, whole commands."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from lippmann.image import read_picture

PATHS = {"hci": "out", "lftoolbox": "out.mat", "eslf": "out.png", "zarr": "out.lf", "views": "out"}


@pytest.mark.slow
@pytest.mark.parametrize("layout", list(PATHS))
def test_there_and_back(lippmann, picture, tmp_path, layout):
    path = tmp_path / PATHS[layout]
    done = lippmann("export", picture, "--as", layout, "-o", path, "--json", "-q")
    assert done.code == 0, done.err
    # 64 cylindrical lenses over 8 pixels each, 512 rows: eight views side by side.
    assert done.json == {
        "output": str(path),
        "layout": layout,
        "views": [8, 1],
        "size": [64, 512],
        "stored": "uint8",
        "notes": ["no ground truth is written: the picture has no layer depth"] if layout == "hci" else [],
    }
    again = lippmann("import", path, "-o", tmp_path / "again.png", "--json", "-q")
    assert again.json["display"] == "seed-lenticular"
    assert again.json["size"] == [512, 512]
    assert np.array_equal(Image.open(tmp_path / "again.png"), Image.open(picture))
    assert read_picture(tmp_path / "again.png").provenance == read_picture(picture).provenance


def test_a_name_without_an_ending_gets_that_of_the_layout(lippmann, picture, tmp_path):
    for layout, made in (("eslf", "a.png"), ("lftoolbox", "a.mat"), ("hci", "a")):
        done = lippmann("export", picture, "--as", layout, "-o", tmp_path / "a", "--json")
        assert done.code == 0, done.err
        assert done.json["output"] == str(tmp_path / made)
        assert (tmp_path / made).exists()


def test_remarks_and_results_are_told(lippmann, picture, tmp_path):
    done = lippmann("export", picture, "--as", "hci", "-o", tmp_path / "out", "--bits", "16", "--distance", "900")
    assert done.out == f"{tmp_path / 'out'}: 8x1 views of 64x512 pixels, uint16\n"
    assert "no ground truth is written" in done.err
    again = lippmann("import", tmp_path / "out", "-o", tmp_path / "x.png", "--bits", "16")
    assert again.out == f"{tmp_path / 'x.png'}: 512x512 pixels for seed-lenticular\n"


def test_another_program_s_views_on_a_display_that_is_asked_for(lippmann, tmp_path):
    (tmp_path / "theirs").mkdir()
    for number in range(225):
        Image.new("RGB", (34, 34), (number, 0, 9)).save(tmp_path / "theirs" / f"{number:03}.png")
    refused = lippmann("import", tmp_path / "theirs", "-o", tmp_path / "x.png", "-q")
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert "the number of views in a row is unknown" in refused.err
    assert lippmann("import", tmp_path / "theirs", "-d", "mla-square", "-o", tmp_path / "x.png", "-q").code == 0
    codes = np.asarray(Image.open(tmp_path / "x.png"))
    # Under each lens the first camera's pixel is the last one, at the lower right.
    assert codes[14, 14].tolist() == [0, 0, 9]
    assert codes[0, 0].tolist() == [224, 0, 9]


@pytest.mark.slow
def test_bad_input_is_one_line_and_code_2(lippmann, picture, tmp_path):
    out, there = tmp_path / "out", tmp_path / "there"
    there.mkdir()
    (there / "mine.txt").write_text("kept")
    (tmp_path / "junk.mat").write_bytes(b"junk")
    (tmp_path / "empty").mkdir()

    def refused(*words):
        outcome = lippmann(*words, "-q")
        assert outcome.code == 2, outcome
        assert outcome.out == ""
        assert outcome.err.startswith("lippmann: ")
        assert outcome.err.count("\n") == 1
        return outcome.err

    assert "--as" in refused("export", picture, "-o", out)
    assert "unknown layout 'hdf5'; known are hci, lftoolbox, eslf, zarr, views" in refused(
        "export", picture, "--as=hdf5", "-o", out
    )
    assert "lftoolbox files end in .mat" in refused("export", picture, "--as=lftoolbox", "-o", tmp_path / "out.png")
    assert "holds 'mine.txt', which Lippmann did not write" in refused("export", picture, "--as=hci", "-o", there)
    assert "24 bits per channel" in refused("export", picture, "--as=hci", "-o", out, "--bits", "24")
    assert "--distance: does not apply" in refused("export", picture, "--as=views", "-o", out, "--distance=5")
    assert "no such file" in refused("export", tmp_path / "no.png", "--as=hci", "-o", out)
    assert "no such file" in refused("import", tmp_path / "no", "-o", tmp_path / "x.png")
    assert "is no .mat file" in refused("import", tmp_path / "junk.mat", "-o", tmp_path / "x.png")
    assert "there are no views" in refused("import", tmp_path / "empty", "-o", tmp_path / "x.png")
    assert "parameters.cfg: no such file" in refused("import", tmp_path / "empty", "--as=hci", "-o", tmp_path / "x.png")
    assert "is no Zarr group" in refused("import", tmp_path / "empty", "--as=zarr", "-o", tmp_path / "x.png")
    assert "unknown ending '.jpg'" in refused("import", tmp_path / "empty", "-o", tmp_path / "x.jpg")
    assert "unknown display" in refused("import", tmp_path / "empty", "-d", "none", "-o", tmp_path / "x.png")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["empty", "junk.mat", "there"]
