"""Denoising and layers as options of a render."""

from __future__ import annotations

import pytest


def test_layers_need_a_file_that_holds_them(lippmann, tmp_path):
    done = lippmann("render", "teapot", "--layers", "-o", tmp_path / "a.png")
    assert done.code == 2
    assert "--layers: a.png cannot hold layers" in done.err
    assert list(tmp_path.iterdir()) == []


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
