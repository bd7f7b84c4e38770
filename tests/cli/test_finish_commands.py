"""Denoising and layers as options of a render."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.image import read_picture


@pytest.mark.long
def test_layers_go_into_the_file_with_the_picture(lippmann, engine, tmp_path):
    plain, layered = tmp_path / "plain.exr", tmp_path / "layered.exr"
    words = ("render", "teapot", "--integrator", "direct", "--spp", 1, "-q")
    assert lippmann(*words, "-o", plain).code == 0
    done = lippmann(*words, "--layers", "--json", "-o", layered)
    assert done.code == 0
    image = read_picture(layered)
    assert set(image.maps) - {"error", "samples"} == {"depth", "position", "normal", "albedo", "shape"}
    assert np.array_equal(image.pixels, read_picture(plain).pixels)
    back, front = image.provenance.options["depth_range"]
    depth = image.maps["depth"][np.isfinite(image.maps["depth"])]
    assert depth.size > 0.2 * image.maps["depth"].size
    assert back - 1e-3 <= depth.min() < depth.max() <= front + 1e-3
    assert done.json["seconds"]["layers"] > 0


def test_layers_need_a_file_that_holds_them(lippmann, tmp_path):
    done = lippmann("render", "teapot", "--layers", "-o", tmp_path / "a.png")
    assert done.code == 2
    assert "--layers: a.png cannot hold layers" in done.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_denoising_brings_a_picture_nearer_to_a_long_one(lippmann, engine, tmp_path):
    for name, words in {"noisy": ("--denoise", "none"), "denoised": ("--denoise", "oidn")}.items():
        done = lippmann("render", "teapot", "--spp", 2, *words, "--json", "-o", tmp_path / f"{name}.exr")
        assert done.code == 0, done.err
    assert done.json["options"]["denoise"] == "oidn"
    assert done.json["options"]["denoise_effort"] == "fast"
    assert done.json["seconds"]["denoise"] > 0
    assert (
        lippmann(
            "render", "teapot", "--method", "full", "--spp", 32, "--seed", 5, "-q", "-o", tmp_path / "long.exr"
        ).code
        == 0
    )
    found = {
        name: lippmann("compare", tmp_path / "long.exr", tmp_path / f"{name}.exr", "--json").json["psnr"]
        for name in ("noisy", "denoised")
    }
    assert found["denoised"] > found["noisy"] + 5


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--denoise", "median"), "--denoise: unknown value 'median'"),
        (("--denoise", "oidn", "--integrator", "normal"), "--denoise: normal has no noise"),
    ],
)
def test_what_cannot_be_denoised_is_refused(lippmann, tmp_path, words, complaint):
    done = lippmann("render", "teapot", *words, "-o", tmp_path / "a.png")
    assert done.code == 2
    assert complaint in done.err


def test_a_missing_denoiser_is_said_before_anything_is_rendered(lippmann, engine, tmp_path, monkeypatch):
    import sys

    from lippmann.runtime import open_image_denoise

    monkeypatch.setitem(sys.modules, "pyoidn", None)
    monkeypatch.setattr(open_image_denoise, "load", open_image_denoise.load.__wrapped__)  # another test has loaded it
    done = lippmann("render", "teapot", "--denoise", "oidn", "-o", tmp_path / "a.png")
    assert done.code == 2
    assert 'pip install "pyoidn>=2.5"' in done.err
    assert "trace" not in done.err


def test_without_a_denoiser_the_default_says_what_is_rendered_instead(lippmann, engine, tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "pyoidn", None)
    small = ["--display", "monitor:size=64x48,dpi=100,pitch=8,slope=5,center=0", "--threads", "1"]
    for more in ([], ["--effort", "draft"]):
        done = lippmann("render", "teapot", *small, *more, "-o", tmp_path / "a.png")
        assert (done.code, done.err.count("no denoiser")) == (0, 1), done.err
        assert "auto: full: no denoiser is installed (Linux on ARM has no package of it), so noise stays" in done.err
