"""Pooled light as a method of ``lippmann render``."""

from __future__ import annotations

import pytest

from lippmann.image import read_picture


def test_it_comes_nearer_to_a_long_picture_with_as_many_paths(lippmann, engine, tmp_path):
    words = ("render", "teapot", "--display", "mla-square")
    for name, more in {"long": ("--spp", 64, "--seed", 9), "full": ("--spp", 2), "pooled": ("--spp", 2)}.items():
        method = ("--method", "pooled") if name == "pooled" else ()
        done = lippmann(*words, *more, *method, "--json", "--maps", tmp_path / name, "-o", tmp_path / f"{name}.exr")
        assert done.code == 0, done.err
    assert done.json["method"] == "pooled"
    assert done.json["estimate"] is None
    assert "not proven" in done.err
    assert done.json["rays"]["primary"] == 2 * 510 * 510
    found = {
        name: lippmann("compare", tmp_path / "long.exr", tmp_path / f"{name}.exr", "--json").json["psnr"]
        for name in ("full", "pooled")
    }
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
        (("--quality", "30"), "--quality"),
        (("--order", "paper"), "--order"),
    ],
)
def test_what_cannot_be_pooled_is_refused(lippmann, engine, tmp_path, words, complaint):
    done = lippmann("render", "teapot", "--method", "pooled", *words, "-o", tmp_path / "a.png")
    assert done.code == 2
    assert done.err.startswith(f"lippmann: {complaint}")
