"""Asking for a quality or a time, and what a picture says of its own error."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.image import read_info, read_picture


@pytest.fixture
def small(tmp_path):
    """The paper's display with fewer pixels, as a file."""
    import lippmann.display.presets as presets

    text = (Path(presets.__path__[0]) / "seed-lenticular.toml").read_text()
    path = tmp_path / "small.toml"
    path.write_text(text.replace("width = 512", "width = 128").replace("height = 512", "height = 48"))
    return path


def test_a_quality_is_worked_for_and_stated(lippmann, engine, tmp_path, small):
    out = tmp_path / "a.png"
    done = lippmann("render", "teapot", "--display", small, "--quality", 30, "--json", "-o", out)
    assert done.code == 0, done.err
    stated = done.json["estimate"]
    assert stated["worst"] >= 30
    assert stated["worst_low"] < stated["worst"] < stated["worst_high"]
    assert stated["psnr"] > stated["worst"]
    assert done.json["spp"] >= 16
    assert read_info(out).metadata.provenance.estimate == stated
    assert f"estimated   {stated['psnr']:.1f} dB" in lippmann("info", out).out
    assert "estimated PSNR" in done.err
    more = lippmann("render", "teapot", "--display", small, "--quality-mean", 36, "--json", "-o", out)
    assert more.json["estimate"]["psnr"] >= 36


def test_samples_alone_are_judged_too_and_the_error_is_a_layer(lippmann, engine, tmp_path, small):
    out = tmp_path / "a.exr"
    done = lippmann("render", "teapot", "--display", small, "--spp", 4, "--maps", tmp_path / "maps", "-o", out)
    assert done.code == 0
    assert "estimated PSNR" in done.err
    assert [path.name for path in (tmp_path / "maps").glob("*.png")] == ["error.png"]
    assert read_picture(out).maps["error"].mean() > 0


def test_time_ends_it_and_the_quality_reached_is_said(lippmann, engine, tmp_path, small):
    words = ("--quality", 60, "--max-time", 0.5)
    done = lippmann("render", "teapot", "--display", small, *words, "--json", "-o", tmp_path / "a.png")
    assert done.code == 0
    assert "the time is up before the quality asked for was reached" in done.err
    assert done.json["estimate"]["worst"] < 60
    assert done.json["seconds"]["trace"] < 10


def test_samples_bound_a_quality(lippmann, engine, tmp_path, small):
    words = ("--quality", 60, "--spp", 24)
    done = lippmann("render", "teapot", "--display", small, *words, "--json", "-o", tmp_path / "a.png")
    assert done.json["spp"] == 24
    assert "the samples are spent" in done.err


def test_one_sample_says_why_it_says_nothing(lippmann, engine, tmp_path, small):
    done = lippmann("render", "teapot", "--display", small, "--spp", 1, "--json", "-o", tmp_path / "a.png")
    assert done.json["estimate"] is None
    assert "one sample per pixel does not tell" in done.err


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--quality", "0"), "--quality"),
        (("--quality", "200"), "--quality"),
        (("--quality-mean", "nan"), "--quality-mean"),
        (("--max-time", "0"), "--max-time"),
        (("--max-time", "inf"), "--max-time"),
        (("--quality", "40", "--spp", "1"), "--spp"),
        (("--quality", "40", "--method", "lens-view"), "--quality"),
        (("--quality", "40", "--integrator", "classic", "--pixel-filter", "point"), "--quality"),
        (("--max-time", "9", "--integrator", "normal", "--pixel-filter", "point"), "--max-time"),
    ],
)
def test_goals_that_cannot_be_are_refused(lippmann, engine, tmp_path, words, complaint):
    done = lippmann("render", "teapot", *words, "-o", tmp_path / "a.png")
    assert done.code == 2
    assert done.err.startswith(f"lippmann: {complaint}")
    assert len(done.err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_maps_of_nothing_are_refused(lippmann, engine, tmp_path, small):
    words = ("--spp", 1, "--maps", tmp_path / "maps")
    done = lippmann("render", "teapot", "--display", small, *words, "-o", tmp_path / "a.png")
    assert done.code == 2
    assert "--maps" in done.err
    assert not (tmp_path / "a.png").exists()
