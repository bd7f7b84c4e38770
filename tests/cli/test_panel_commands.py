"""``lippmann quilt`` and ``lippmann weave``, and what they say of bad input."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

from lippmann.image import read_picture

NAME = "x_qs8x6a0.75.png"


@pytest.fixture
def views(tmp_path):
    """48 views of 48x64 pixels, each of its own grey."""
    folder = tmp_path / "views"
    folder.mkdir()
    for number in range(48):
        Image.new("RGB", (48, 64), (number * 5,) * 3).save(folder / f"view_{number:02}.png")
    return folder


@pytest.fixture
def calibration(tmp_path):
    """A small panel as a calibration file."""
    numbers = {
        "pitch": 52.58,
        "slope": -7.145,
        "center": 0.42,
        "viewCone": 40,
        "invView": 1,
        "DPI": 324,
        "screenW": 150,
        "screenH": 200,
    }
    path = tmp_path / "visual.json"
    path.write_text(json.dumps({key: {"value": value} for key, value in numbers.items()} | {"serial": "LKG-P1"}))
    return path


def test_pack_and_unpack(lippmann, views, tmp_path):
    packed = lippmann("quilt", "pack", views, "-o", tmp_path / NAME, "--json")
    assert packed.json == {"output": str(tmp_path / NAME), "size": [384, 384], "views": 48}
    unpacked = lippmann("quilt", "unpack", tmp_path / NAME, "-o", tmp_path / "again", "--json")
    assert unpacked.json == {"output": str(tmp_path / "again"), "size": [48, 64], "views": 48}
    for path in sorted(views.iterdir()):
        np.testing.assert_array_equal(Image.open(tmp_path / "again" / path.name), Image.open(path))


def test_sizes(lippmann):
    assert "looking-glass-portrait           3360x3360  48 views  _qs8x6a0.75\n" in lippmann("quilt", "sizes").out
    assert "odyssey-3d                       3840x2160   2 views  _half_2x1\n" in lippmann("quilt", "sizes").out
    assert len(lippmann("quilt", "sizes", "--json").json["quilts"]) == 20


@pytest.mark.parametrize("choice", ["nearest", "linear"])
def test_a_quilt_and_its_views_weave_alike(lippmann, views, calibration, tmp_path, choice):
    assert lippmann("quilt", "pack", views, "-o", tmp_path / NAME).code == 0
    pictures = []
    for number, source in enumerate((tmp_path / NAME, views)):
        path = tmp_path / f"native{number}.png"
        outcome = lippmann("weave", source, "--display", calibration, "--views", choice, "-o", path, "--json")
        assert outcome.json["size"] == [150, 200]
        assert outcome.json["views"] == 48
        pictures.append(read_picture(path))
    np.testing.assert_array_equal(pictures[0].pixels, pictures[1].pixels)
    assert pictures[0].display.name == "LKG-P1"
    assert pictures[0].provenance.subpixels
    if choice == "nearest":
        assert set(np.unique(np.asarray(Image.open(tmp_path / "native0.png")))) <= set(range(0, 240, 5))


def disc(width, height):
    """A white disc in the middle of a black picture, half as wide as its shorter side."""
    x, y = np.meshgrid(np.arange(width) + 0.5 - width / 2, np.arange(height) + 0.5 - height / 2)
    return Image.fromarray(np.where(np.hypot(x, y) < min(width, height) / 4, 255, 0).astype(np.uint8)).convert("RGB")


@pytest.mark.parametrize(
    ("fit", "diameter", "said"),
    [
        ((), 100, "cover: 62 % of the width of the pictures is cut off"),
        (("--fit", "cover"), 100, "cover: 62 % of the width"),
        (("--fit", "contain"), 38, ""),
        (("--fit", "stretch"), None, "stretched"),
    ],
)
def test_views_of_another_shape_keep_their_proportions(lippmann, calibration, tmp_path, fit, diameter, said):
    folder, woven = tmp_path / "views", tmp_path / "woven.png"
    folder.mkdir()
    for number in range(3):
        disc(320, 160).save(folder / f"{number}.png")
    outcome = lippmann("weave", folder, "-d", calibration, "-o", woven, *fit)
    assert outcome.code == 0
    assert said in outcome.err
    codes = np.asarray(Image.open(woven))[..., 1] > 127
    if fit == ("--fit", "contain"):
        assert codes[:40].all()  # paper above and below
        assert codes[-40:].all()
        codes = codes[70:130]
    across, down = np.ptp(np.nonzero(codes.any(axis=0))) + 1, np.ptp(np.nonzero(codes.any(axis=1))) + 1
    # A lens is 6 pixels wide.
    assert across == pytest.approx(diameter or 38, abs=8)
    assert down == pytest.approx(diameter or 100, abs=4)


def test_a_quilt_of_another_shape_is_fitted_on_request(lippmann, views, calibration, tmp_path):
    wide = tmp_path / "x_qs8x6a1.6.png"
    assert lippmann("quilt", "pack", views, "-o", wide).code == 0
    refused = lippmann("weave", wide, "-d", calibration, "-o", tmp_path / "native.png")
    assert refused.code == 2
    assert "--fit cover" in refused.err
    assert lippmann("weave", wide, "-d", calibration, "-o", tmp_path / "native.png", "--fit", "cover").code == 0


def test_a_replay_of_another_shape_is_framed(lippmann, views, calibration, tmp_path):
    native, seen = tmp_path / "native.png", tmp_path / "seen.png"
    assert lippmann("weave", views, "-d", calibration, "-o", native).code == 0
    outcome = lippmann("replay", native, "--size", "200x120", "-o", seen)
    assert "it fills 90x120 in the middle" in outcome.err
    lit = np.asarray(Image.open(seen)).any(axis=(0, 2))
    assert lit.shape == (200,)
    assert (lit == (np.abs(np.arange(200) + 0.5 - 100) < 45)).all()
    assert "in the middle" not in lippmann("replay", native, "--size", "90x120", "-o", seen).err
    assert lippmann("refocus", native, "--plane", "0", "--size", "90x160", "-o", seen).code == 0
    lit = np.asarray(Image.open(seen)).any(axis=(1, 2))
    assert (lit == (np.abs(np.arange(160) + 0.5 - 80) < 60)).all()


def test_the_woven_picture_is_replayed(lippmann, views, calibration, tmp_path):
    path, seen = tmp_path / "native.png", tmp_path / "seen.png"
    assert lippmann("weave", views, "-d", calibration, "-o", path).code == 0
    levels = []
    for x in (-18, 0, 18):
        eye = f"{x},0,{read_picture(path).display.viewing_distance}"
        assert lippmann("replay", path, f"--eye={eye}", "-o", seen).code == 0
        levels.append(np.asarray(Image.open(seen))[20:-20, 20:-20].mean())
    # Views brighten to the right; the cone is 46 mm wide.
    assert levels[0] < 40
    assert 105 < levels[1] < 130
    assert levels[2] > 200


@pytest.mark.slow
def test_bad_input_is_one_line_and_code_2(lippmann, views, calibration, tmp_path):
    def refused(*words):
        outcome = lippmann(*words)
        assert outcome.code == 2
        assert outcome.out == ""
        assert outcome.err.startswith("lippmann: ")
        assert outcome.err.count("\n") == 1
        return outcome.err

    native = tmp_path / "native.png"
    unnamed = refused("quilt", "pack", views, "-o", native)
    assert "does not say how many views" in unnamed
    assert "of 8 columns and 6 rows: native_qs8x6a0.75.png" in unnamed
    assert "it holds 48 views; 5x9 views are 45" in refused("quilt", "pack", views, "-o", tmp_path / "x_qs5x9a1.6.png")
    assert "no such file" in refused("quilt", "pack", tmp_path / "no", "-o", tmp_path / NAME)
    assert "no such file" in refused("quilt", "pack", tmp_path / "no")
    assert "no such file" in refused("quilt", "unpack", tmp_path / NAME, "-o", tmp_path / "out")
    assert "--display" in refused("weave", views, "-o", native)
    assert "unknown display" in refused("weave", views, "-d", "lkg", "-o", native)
    for command in ("weave", "interlace"):
        message = refused(command, views, "-d", "mla-square", "-o", native)
        assert ("square lenses" in message, "cut off" in message) == (True, False)
    assert "--views: unknown value 'cubic'" in refused(
        "weave", views, "-d", calibration, "-o", native, "--views=cubic", "-q"
    )
    assert "unknown ending '.jpg'" in refused("weave", views, "-d", calibration, "-o", tmp_path / "native.jpg")
    broken = calibration.read_text().replace('{"value": 52.58}', "52.58")
    calibration.write_text(broken)
    assert "pitch is 52.58; it must be wrapped" in refused("weave", views, "-d", calibration, "-o", native)
    (views / "view_03.png").unlink()
    assert "view 3 is missing" in refused("weave", views, "-d", "looking-glass-portrait", "-o", native, "-q")
    assert not native.exists()
