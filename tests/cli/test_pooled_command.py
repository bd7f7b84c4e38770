"""Pooled light as a method of ``lippmann render``."""

from __future__ import annotations

import pytest

from lippmann import render

POOLED = ("--method", "pooled")


@pytest.fixture(scope="module")
def long_picture(engine, tmp_path_factory):
    path = tmp_path_factory.mktemp("long") / "long.exr"
    render("teapot", "mla-square", method="full", spp=64, seed=9, tone_map="none").save(path)
    return path


def rendered(lippmann, output, *words):
    done = lippmann(
        "render", "teapot", "--display", "mla-square", *words, "--json", "--maps", output.with_suffix(""), "-o", output
    )
    assert done.code == 0, done.err
    return done


def psnr(lippmann, reference, picture):
    return lippmann("compare", reference, picture, "--json").json["psnr"]


@pytest.mark.long
def test_it_denoises_shares_and_knows_its_error(lippmann, long_picture, tmp_path):
    oidn = ("--denoise", "oidn-fast")
    done = rendered(lippmann, tmp_path / "pooled.exr", *POOLED, *oidn, "--spp", 2)
    rendered(lippmann, tmp_path / "denoised.exr", "--method", "full", *oidn, "--spp", 2)
    assert done.json["method"] == "pooled"
    assert done.json["options"]["denoise"] == "oidn"
    found = {name: psnr(lippmann, long_picture, tmp_path / f"{name}.exr") for name in ("pooled", "denoised")}
    assert found["pooled"] > found["denoised"] + 0.1
    stated = done.json["estimate"]
    assert stated["psnr_low"] - 0.5 < found["pooled"] < stated["psnr_high"] + 3
    assert (tmp_path / "pooled" / "error.png").exists()


@pytest.mark.long
def test_a_denoiser_is_its_default(lippmann, engine, tmp_path):
    done = rendered(lippmann, tmp_path / "a.exr", *POOLED, "--spp", 1)
    assert done.json["options"]["denoise"] == "oidn"
    assert "one sample per pixel" in done.err


@pytest.mark.long
def test_it_can_be_asked_for_a_quality(lippmann, engine, tmp_path):
    done = rendered(lippmann, tmp_path / "a.exr", *POOLED, "--quality", 33)
    assert done.json["estimate"]["psnr"] >= 33
    assert done.json["spp"] < 64


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--integrator", "classic"), "--integrator"),
        (("--integrator", "normal"), "--integrator"),
        (
            ("--denoise", "none"),
            "--denoise: pooled needs the denoiser; pooled shares denoised light; use --method full",
        ),
        (("--denoise", "none", "--quality-worst", "30"), "--denoise"),
        (("--spp", "1", "--quality-worst", "30"), "--spp"),
        (("--order", "paper"), "--order"),
    ],
)
def test_what_cannot_be_pooled_is_refused(lippmann, engine, tmp_path, words, complaint):
    done = lippmann("render", "teapot", "--method", "pooled", *words, "-o", tmp_path / "a.png")
    assert done.code == 2
    assert done.err.startswith(f"lippmann: {complaint}")
    assert done.err.count("\n") == 1
