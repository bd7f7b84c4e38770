"""Rendering with points reused: what the command says and writes."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from lippmann.image import read_picture


@pytest.mark.slow
@pytest.mark.parametrize("method", ["lens-view", "interpolated"])
@pytest.mark.parametrize("way", [(), ("--no-respect-gloss",), ("--order", "paper")], ids=["gloss", "plain", "paper"])
def test_it_says_how_the_pixels_came_about(lippmann, engine, tmp_path, cut_display, method, way):
    out, display = tmp_path / "a.exr", cut_display(256, 96)
    done = lippmann("render", "small-balls", "-d", display, "--method", method, *way, "--json", "-o", out)
    assert done.code == 0, done.err
    values = done.json
    shares = values["pixel_shares"]
    assert set(shares) == {"traced", "reprojected", "interpolated"}
    assert sum(shares.values()) == pytest.approx(1)
    assert shares["traced"] == pytest.approx(values["traced_fraction"])
    assert values["rays"]["primary"] == round(values["traced_fraction"] * 256 * 96)
    assert 0 < shares["traced"] < 0.9
    assert shares["reprojected"] > 0
    assert (shares["interpolated"] > 0) == (method == "interpolated")
    assert values["options"]["order"] == ("paper" if "paper" in way else "default")
    assert values["options"]["respect_gloss"] is (way == ())
    maps = read_picture(out).maps
    status = maps["status"]
    assert np.array_equal(maps["samples"] > 0, status == 0)  # what was carried over has had none
    for value, name in enumerate(("traced", "reprojected", "interpolated")):
        assert np.mean(status == value) == pytest.approx(shares[name])


def test_maps_show_parts_of_the_frame(lippmann, engine, tmp_path):
    out, maps = tmp_path / "a.png", tmp_path / "maps"
    done = lippmann(
        "render", "teapot", "--integrator", "classic", "--method", "interpolated", "--maps", maps, "-o", out
    )
    assert done.code == 0, done.err
    assert "% traced" in done.out
    assert sorted(path.name for path in maps.glob("*.png")) == [
        "interpolated.png",
        "missed.png",
        "reprojected.png",
        "samples.png",
        "traced.png",
    ]
    frame = np.asarray(Image.open(out).convert("RGB"))
    parts = [np.asarray(Image.open(maps / f"{name}.png")) for name in ("traced", "reprojected", "interpolated")]
    shown = [np.all(part == frame, axis=-1) for part in parts]
    # Each pixel is shown by one of them; the odd one may have the very colour of what is left out.
    assert np.mean(shown[0] | shown[1] | shown[2]) == 1
    assert np.mean(sum(s.astype(int) for s in shown) == 1) > 0.99
    light = np.asarray(Image.open(maps / "missed.png")).max(axis=-1) > 128
    assert light.mean() == pytest.approx((shown[0] | shown[2]).mean(), abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--order", "paper"), "--order"),
        (("--respect-gloss",), "--respect-gloss"),
        (("--method", "lens-view", "--order", "paper", "--respect-gloss"), "--respect-gloss"),
        (("--method", "lens-view", "--subpixels"), "--subpixels"),
        (("--method", "lens-view", "--integrator", "depth"), "--integrator"),
        (("--method", "reproject"), "--method"),
    ],
)
def test_options_that_would_do_nothing_are_refused(lippmann, engine, tmp_path, monkeypatch, words, complaint):
    monkeypatch.chdir(tmp_path)
    done = lippmann("render", "teapot", *words, "-o", "a.png")
    assert done.code == 2
    assert complaint in done.err
    assert len(done.err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_folder_of_other_things_is_not_replaced_by_maps(lippmann, engine, tmp_path):
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps" / "thesis.txt").write_text("years of work")
    words = ("--method", "lens-view", "--maps", tmp_path / "maps", "-o", tmp_path / "a.png")
    done = lippmann("render", "small-balls", *words)
    assert done.code == 2
    assert "thesis.txt" in done.err
    assert not (tmp_path / "a.png").exists()
