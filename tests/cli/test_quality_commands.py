"""``lippmann compare``: its text, its JSON, its files, and what it refuses."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest

from lippmann.display import load_display
from lippmann.image import IntegralImage, Provenance, read_picture


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """A grey picture for the paper's display, and the same with lens 12 a tenth too bright."""
    folder = tmp_path_factory.mktemp("pair")
    display = load_display("seed-lenticular").resized(512, 64)
    codes = np.full((64, 512, 3), 0.5, dtype=np.float32)
    for name in ("a.exr", "b.exr"):
        IntegralImage(codes, display, provenance=Provenance(transfer="linear")).save(folder / name, bits=32)
        codes[:, 96:104] = 0.6
    return folder / "a.exr", folder / "b.exr"


def test_compare_says_what_it_found(lippmann, pair):
    done = lippmann("compare", *pair, "--json")
    assert done.code == 0
    values = done.json
    assert (values["reference"], values["test"]) == tuple(map(str, pair))
    assert values["identical"] is False
    assert values["psnr"] == pytest.approx(20 + 10 * math.log10(64), abs=1e-3)
    worst = values["micro_images"]["worst"]
    assert (worst["lens"], worst["pixels"]) == ([12, 0], 512)
    assert worst["psnr"] == pytest.approx(20, abs=1e-3)
    assert len(values["ssim"]["views"][0]) == 8
    assert values["paper"]["unchanged_micro_images"] == 63
    text = lippmann("compare", *pair).out
    assert "38.06 dB" in text
    assert "20.00 dB (lens 12, 0 of 64)" in text
    assert "63 without error" in text


def test_equal_pictures_have_no_figure_in_json(lippmann, pair):
    values = lippmann("compare", pair[0], pair[0], "--json").json
    assert values["identical"] is True
    assert values["psnr"] is values["micro_images"]["worst"]["psnr"] is None
    text = lippmann("compare", pair[0], pair[0]).out
    assert "the pictures are identical" in text
    assert "infinite" in text


def test_the_table_has_a_row_for_every_lens(lippmann, pair, tmp_path):
    out = tmp_path / "lenses.csv"
    assert lippmann("compare", *pair, "--csv", out, "-q").code == 0
    with out.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["column"]) for row in rows] == list(range(64))
    assert float(rows[12]["psnr"]) == pytest.approx(20, abs=1e-3)
    assert float(rows[13]["psnr"]) == math.inf
    assert float(rows[12]["paper_rmse"]) == 25**2  # codes 128 and 153


@pytest.mark.parametrize("ending", ["png", "exr"])
def test_the_map_is_a_picture_of_the_display(lippmann, pair, tmp_path, ending):
    out = tmp_path / f"errors.{ending}"
    assert lippmann("compare", *pair, "--map", out, "-q").code == 0
    shown = read_picture(out)
    light = shown.pixels.sum(axis=(0, 2))
    assert set(np.flatnonzero(light > light.min())) == set(range(96, 104))
    assert set(shown.maps) == ({"error", "micro_image_psnr", "silhouettes"} if ending == "exr" else set())
    if ending == "exr":
        np.testing.assert_allclose(shown.maps["error"][0, 100], 0.1, atol=1e-3)


def test_pictures_of_other_programs_need_a_display(lippmann, tmp_path):
    from PIL import Image

    for name, value in (("a.png", 10), ("b.png", 13)):
        Image.fromarray(np.full((512, 512, 3), value, dtype=np.uint8)).save(tmp_path / name)
    words = ("compare", tmp_path / "a.png", tmp_path / "b.png")
    refused = lippmann(*words)
    assert refused.code == 2
    assert "--display" in refused.err
    values = lippmann(*words, "--display", "seed-lenticular", "--json").json
    assert values["paper"]["paper_mean_rmse"] == 9


def test_what_cannot_be_compared_is_refused_in_one_line(lippmann, pair, tmp_path):
    other = tmp_path / "other.png"
    small = load_display("seed-lenticular").resized(256, 64)
    IntegralImage(np.zeros((64, 256, 3)), small).save(other)
    damaged = tmp_path / "damaged.png"
    damaged.write_bytes(other.read_bytes()[:200])
    (tmp_path / "empty.exr").touch()
    for words, what in (
        ((pair[0], other), "512 x 64 and 256 x 64 pixels"),
        ((pair[0], damaged), "damaged.png"),
        ((pair[0], tmp_path / "empty.exr"), "empty.exr"),
        ((pair[0], tmp_path / "missing.png"), "missing.png"),
        ((*pair, "--map", tmp_path / "map.txt"), "'.txt'"),
        ((*pair, "--csv", tmp_path / "no" / "folder.csv"), "there is no folder"),
        ((*pair, "--display", "none-such"), "none-such"),
    ):
        done = lippmann("compare", *words)
        assert (done.code, done.out) == (2, ""), words
        assert len(done.err.strip().splitlines()) == 1
        assert what in done.err
    assert not (tmp_path / "map.txt").exists()
