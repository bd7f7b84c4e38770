"""Asking for a quality or a time, and what a picture says of its own error."""

from __future__ import annotations

import os
import time

import numpy as np
import pytest

from lippmann.image import open_file, read_picture

#: Bundled scenes that were made for the classic light models.
CLASSIC = ("gears", "primitives", "room", "small-balls", "tree")


@pytest.fixture
def small(cut_display):
    return cut_display(128, 48)


@pytest.mark.slow
def test_a_quality_is_worked_for_and_stated(lippmann, engine, tmp_path, small):
    out = tmp_path / "a.png"
    done = lippmann("render", "teapot", "--display", small, "--quality-worst", 30, "--json", "-o", out)
    assert done.code == 0, done.err
    stated = done.json["estimate"]
    assert stated["worst"] >= 30
    assert stated["worst_low"] < stated["worst"] < stated["worst_high"]
    assert stated["psnr"] > stated["worst"]
    assert done.json["spp"] >= 16
    assert open_file(out).metadata.provenance.estimate == stated
    assert f"estimated   {stated['psnr']:.1f} dB" in lippmann("info", out).out
    assert "estimated PSNR" in done.err
    more = lippmann("render", "teapot", "--display", small, "--quality", 36, "--json", "-o", out)
    assert more.json["estimate"]["psnr"] >= 36


@pytest.mark.long_cases(but=["--quality-worst-primitives", "--quality-worst-teapot"])
@pytest.mark.slow
@pytest.mark.parametrize("scene", ["gears", "primitives", "room", "small-balls", "teapot", "tree"])
@pytest.mark.parametrize(
    "goal", [("--quality-worst", 20), ("--quality", 20), ("--max-time", 1)], ids=lambda goal: goal[0]
)
def test_every_bundled_scene_has_a_goal_with_the_light_it_was_made_for(lippmann, engine, tmp_path, small, scene, goal):
    """Some were made for classic light, which is not pooled."""
    done = lippmann("render", scene, "--display", small, *goal, "--json", "-o", tmp_path / "a.png")
    assert done.code == 0, done.err
    classic = done.json["integrator"] == "classic"
    assert classic == (scene in CLASSIC)
    assert (done.json["options"]["auto"] == "full: the light of classic is not pooled") == classic
    # In a second there may be time for a single sample.
    assert goal[0] == "--max-time" or done.json["estimate"]["psnr"] > 19


@pytest.mark.slow
def test_samples_alone_are_judged_too_and_the_error_is_a_layer(lippmann, engine, tmp_path, small):
    out = tmp_path / "a.exr"
    done = lippmann("render", "teapot", "--display", small, "--spp", 4, "--maps", tmp_path / "maps", "-o", out)
    assert done.code == 0
    assert "estimated PSNR" in done.err
    assert sorted(path.name for path in (tmp_path / "maps").glob("*.png")) == ["error.png", "samples.png"]
    image = read_picture(out)
    assert image.maps["error"].mean() > 0
    assert set(np.unique(image.maps["samples"])) == {4}


@pytest.mark.long
def test_time_ends_it_and_the_quality_reached_is_said(lippmann, engine, tmp_path, small):
    words = ("--quality-worst", 60, "--max-time", 4, "--denoise", "none")
    started = time.process_time()
    done = lippmann("render", "teapot", "--display", small, *words, "--json", "-o", tmp_path / "a.png")
    assert done.code == 0
    assert "the time is up before the quality asked for was reached" in done.err
    assert done.json["estimate"]["worst"] < 60
    # By the clock it takes longer where the machine is busy.
    assert time.process_time() - started < 10 * os.cpu_count()


def test_samples_bound_a_quality(lippmann, engine, tmp_path, small):
    words = ("--quality-worst", 60, "--spp", 24)
    done = lippmann("render", "teapot", "--display", small, *words, "--json", "-o", tmp_path / "a.png")
    assert done.json["spp"] == 24
    assert "the samples are spent" in done.err


@pytest.mark.slow
def test_one_sample_says_why_it_says_nothing(lippmann, engine, tmp_path, small):
    done = lippmann("render", "teapot", "--display", small, "--spp", 1, "--json", "-o", tmp_path / "a.png")
    assert done.json["estimate"] is None
    assert "no estimate of the error: it needs two samples per pixel or more (--spp 2)" in done.err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--quality-worst", "0"), "--quality-worst"),
        (("--quality-worst", "200"), "--quality-worst"),
        (("--quality", "nan"), "--quality"),
        (("--max-time", "0"), "--max-time"),
        (("--max-time", "inf"), "--max-time"),
        (("--quality-worst", "40", "--spp", "1"), "--spp"),
        (("--quality-worst", "40", "--method", "lens-view"), "--quality-worst"),
        (("--quality-worst", "40", "--integrator", "classic", "--pixel-filter", "point"), "--quality-worst"),
        (("--max-time", "9", "--integrator", "normal", "--pixel-filter", "point"), "--max-time"),
    ],
)
def test_goals_that_cannot_be_are_refused(lippmann, engine, tmp_path, words, complaint):
    done = lippmann("render", "teapot", *words, "-o", tmp_path / "a.png")
    assert done.code == 2
    assert done.err.startswith(f"lippmann: {complaint}")
    assert len(done.err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


# ---- auto -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_auto_is_the_default_and_says_what_it_took(lippmann, engine, tmp_path, small):
    out = tmp_path / "a.png"
    done = lippmann("render", "teapot", "--display", small, "--spp", 2, "--json", "-o", out)
    assert done.json["method"] == "pooled"
    assert "auto: pooled: " in done.err
    assert done.json["options"]["auto"].startswith("pooled: ")
    assert done.json["options"]["denoise"] == "oidn"
    assert "auto        pooled: " in lippmann("info", out).out
    plain = tmp_path / "b.png"
    named = lippmann("render", "teapot", "--display", small, "--spp", 2, "--method", "pooled", "--json", "-o", plain)
    assert "auto" not in named.json["options"]
    assert np.array_equal(read_picture(out).pixels, read_picture(plain).pixels)


def test_a_time_too_short_for_two_samples_gives_one_and_says_so(lippmann, engine, tmp_path, small):
    words = ("--max-time", 0.001, "--denoise", "none", "--json", "-o", tmp_path / "a.png")
    done = lippmann("render", "teapot", "--display", small, *words)
    assert done.code == 0
    assert (done.json["spp"], done.json["estimate"]) == (1, None)
    assert "there was time for one sample per pixel only" in done.err
    assert "s instead of --max-time 0.001: a picture of 1 sample per pixel takes that long" in done.err
    in_time = lippmann("render", "teapot", "--display", small, "--max-time", 600, "--quality", 5, *words[2:])
    assert (in_time.code, "instead of" in in_time.err) == (0, False)


@pytest.mark.slow
def test_a_draft_and_a_modest_quality_take_no_more_samples_than_nothing_asked(lippmann, engine, tmp_path, cut_display):
    """What a picture has anyway is assessed after the fewest samples, however cheap more of them are."""
    small, out = cut_display(512, 160), tmp_path / "a.png"

    def rendered(*options):
        done = lippmann("render", "teapot", "--display", small, "--json", "-o", out, *options)
        assert done.code == 0, done.err
        return done.json

    usual = rendered()
    draft = rendered("--effort", "draft")
    assert (draft["spp"], draft["method"], draft["options"]["denoise_effort"]) == (1, "full", "fast")
    assert sum(draft["rays"].values()) < sum(usual["rays"].values()) / 2
    modest = rendered("--quality", 30)
    assert (modest["spp"], modest["method"]) == (4, "pooled")
    assert modest["spp"] < usual["spp"]
    assert 30 <= modest["estimate"]["psnr"] < usual["estimate"]["psnr"]


@pytest.mark.slow
def test_a_final_picture_says_that_it_is_good(lippmann, engine, tmp_path, small):
    done = lippmann("render", "teapot", "--display", small, "--effort", "final", "--json", "-o", tmp_path / "a.png")
    assert done.code == 0, done.err
    assert done.json["estimate"]["psnr"] >= 40
    assert done.json["spp"] <= 256
    assert "quality: 40 (a final picture)" in done.json["options"]["plan"]
    refused = lippmann("render", "teapot", "--effort", "final", "--spp", 4, "-o", tmp_path / "b.png")
    assert refused.code == 2
    assert refused.err.startswith("lippmann: --spp: 4 beside a final picture; it works until it is good by itself;")


@pytest.mark.parametrize("option", ["--quality", "--quality-worst", "--spp", "--max-time"])
@pytest.mark.parametrize("command", [("render",), ("quilt", "render")])
def test_a_draft_beside_another_goal_is_refused(lippmann, tmp_path, command, option):
    done = lippmann(*command, "teapot", "--effort", "draft", option, 4, "-o", tmp_path / "a_qs8x6a0.75.png")
    assert done.code == 2
    assert done.err.strip() == (
        f"lippmann: {option}: 4 beside a draft; a draft has one sample a pixel; leave it out, or use --effort normal"
    )
