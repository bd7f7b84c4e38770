"""Pooled light as a method of ``lippmann render``."""

from __future__ import annotations

import pytest

from lippmann import render
from lippmann.image import read_picture

DENOISED, IN_CELLS = ("--method", "pooled"), ("--method", "pooled", "--denoise", "none")


@pytest.fixture(scope="module")
def long_picture(engine, tmp_path_factory):
    path = tmp_path_factory.mktemp("long") / "long.exr"
    render("teapot", "mla-square", method="full", spp=64, seed=9).save(path)
    return path


def rendered(lippmann, output, *words):
    done = lippmann(
        "render", "teapot", "--display", "mla-square", *words, "--json", "--maps", output.with_suffix(""), "-o", output
    )
    assert done.code == 0, done.err
    return done


def psnr(lippmann, reference, picture):
    return lippmann("compare", reference, picture, "--json").json["psnr"]


def test_it_denoises_shares_and_knows_its_error(lippmann, long_picture, tmp_path):
    pytest.importorskip("pyoidn")
    oidn = ("--denoise", "oidn-fast")
    done = rendered(lippmann, tmp_path / "pooled.exr", *DENOISED, *oidn, "--spp", 2)
    rendered(lippmann, tmp_path / "denoised.exr", "--method", "full", *oidn, "--spp", 2)
    assert done.json["method"] == "pooled"
    assert done.json["options"]["denoise"] == "oidn"
    assert "not proven" not in done.err
    found = {name: psnr(lippmann, long_picture, tmp_path / f"{name}.exr") for name in ("pooled", "denoised")}
    assert found["pooled"] > found["denoised"] + 0.2
    stated = done.json["estimate"]
    assert stated["psnr_low"] - 0.5 < found["pooled"] < stated["psnr_high"] + 3
    assert (tmp_path / "pooled" / "error.png").exists()
    assert not (tmp_path / "pooled" / "pooled.png").exists()


def test_a_denoiser_is_its_default_where_one_is_installed(lippmann, engine, tmp_path):
    pytest.importorskip("pyoidn")
    done = rendered(lippmann, tmp_path / "a.exr", *DENOISED, "--spp", 1)
    assert done.json["options"]["denoise"] == "oidn"
    assert "one sample per pixel" in done.err


def test_it_can_be_asked_for_a_quality(lippmann, engine, tmp_path):
    pytest.importorskip("pyoidn")
    done = rendered(lippmann, tmp_path / "a.exr", *DENOISED, "--quality-mean", 33)
    assert done.json["estimate"]["psnr"] >= 33
    assert done.json["spp"] < 64


def test_in_cells_it_comes_nearer_to_a_long_picture_with_as_many_paths(lippmann, long_picture, tmp_path):
    done = rendered(lippmann, tmp_path / "pooled.exr", *IN_CELLS, "--spp", 2)
    rendered(lippmann, tmp_path / "full.exr", "--spp", 2)
    assert done.json["method"] == "pooled"
    assert done.json["estimate"] is None
    assert "not proven" in done.err
    assert done.json["rays"]["primary"] == 2 * 510 * 510
    found = {name: psnr(lippmann, long_picture, tmp_path / f"{name}.exr") for name in ("full", "pooled")}
    assert found["pooled"] > found["full"] + 5
    pooled = read_picture(tmp_path / "pooled.exr")
    assert pooled.provenance.method == "pooled"
    assert (tmp_path / "pooled" / "pooled.png").exists()
    assert not (tmp_path / "full" / "pooled.png").exists()
    assert 0.5 < pooled.maps["pooled"].mean() < 1


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--integrator", "classic"), "--integrator"),
        (("--integrator", "normal"), "--integrator"),
        (("--denoise", "none", "--quality", "30"), "--quality"),
        (("--denoise", "none", "--max-time", "9"), "--max-time"),
        (("--spp", "1", "--quality", "30"), "--spp"),
        (("--order", "paper"), "--order"),
    ],
)
def test_what_cannot_be_pooled_is_refused(lippmann, engine, tmp_path, words, complaint):
    done = lippmann("render", "teapot", "--method", "pooled", *words, "-o", tmp_path / "a.png")
    assert done.code == 2
    assert done.err.startswith(f"lippmann: {complaint}")
