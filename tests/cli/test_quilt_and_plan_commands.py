"""``lippmann quilt render`` and ``lippmann plan``."""

from __future__ import annotations

import json

import pytest
from PIL import Image

from lippmann.image import read_picture
from lippmann.quilts.files import read_quilt

ENDING = "_qs8x6a0.75.png"
SMALL = ("--size", "384x384", "--spp", "2", "--integrator", "direct")


@pytest.fixture
def calibration(tmp_path):
    """A small panel of a kind whose quilt is known by its serial."""
    numbers = {"pitch": 52.58, "slope": -7.145, "center": 0.42, "viewCone": 40, "invView": 1, "DPI": 324}
    numbers |= {"screenW": 150, "screenH": 200}
    path = tmp_path / "visual.json"
    path.write_text(json.dumps({"serial": "LKG-P1"} | {key: {"value": value} for key, value in numbers.items()}))
    return path


@pytest.mark.long
@pytest.mark.usefixtures("engine")
def test_a_quilt_gets_its_name_from_scene_and_device(lippmann, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    outcome = lippmann("quilt", "render", "teapot", *SMALL, "--json")
    assert outcome.code == 0, outcome.err
    assert outcome.json["output"] == f"teapot{ENDING}"
    assert (outcome.json["size"], outcome.json["views"]) == ([384, 384], 48)
    assert outcome.json["display"] == "looking-glass-portrait"
    assert outcome.json["estimate"]["worst"] > 5
    assert "worst view" in outcome.err
    quilt = read_quilt(tmp_path / f"teapot{ENDING}")
    assert quilt.view_size == (48, 64)
    assert quilt.pixels.max() > 0.2


@pytest.mark.slow
@pytest.mark.usefixtures("engine")
def test_views_share_their_light_where_that_is_asked_for(lippmann, tmp_path):
    words = ("quilt", "render", "teapot", *SMALL, "--method", "pooled", "--json", "-o", tmp_path / f"x{ENDING}")
    outcome = lippmann(*words, "--denoise", "oidn-fast")
    assert outcome.code == 0, outcome.err
    assert outcome.json["method"] == "pooled"
    assert outcome.json["estimate"]["worst"] > 5


@pytest.mark.long
@pytest.mark.usefixtures("engine")
def test_a_calibration_names_its_quilt_and_takes_it_back(lippmann, calibration, tmp_path):
    quilt, native = tmp_path / f"x{ENDING}", tmp_path / "native.png"
    plain = tmp_path / "x.png"  # gets the ending of its kind
    made = lippmann("quilt", "render", "teapot", "-d", calibration, *SMALL, "-o", plain, "--quiet")
    assert (made.code, made.out, made.err) == (0, "", "")
    assert quilt.exists()
    assert lippmann("weave", quilt, "-d", calibration, "-o", native, "--quiet").code == 0
    assert read_picture(native).pixels.shape == (200, 150, 3)


@pytest.mark.usefixtures("engine", "short_probe")
def test_plan_says_what_to_expect(lippmann, calibration):
    words = (
        "plan",
        "teapot",
        "-d",
        calibration,
        "--subpixels",
        "--spp",
        "4",
        "--integrator",
        "direct",
        "--method",
        "full",
        "--shift",
        "0,0,-8",
    )
    outcome = lippmann(*words)
    assert outcome.code == 0, outcome.err
    starts = [line.split()[0] for line in outcome.out.splitlines()]
    assert starts[:8] == ["picture", "scene", "resolved", "comfort", "blur", "rays", "memory", "time"]
    assert set(starts[8:]) >= {"integrator", "method", "samples", "tone_map", "window", "wavefronts"}
    assert "150x200 pixels, a ray for every sub-pixel" in outcome.out
    assert "0.4 M from pixels (4 samples each)" in outcome.out
    assert "what lies beyond is blurred" in outcome.err
    found = lippmann(*words, "--json").json
    assert found["rays"]["primary"] == 150 * 200 * 3 * 4
    assert found["size"] == [150, 200]
    assert found["seconds"]["total"] > 0
    assert found["memory"]["expected"] > 0


@pytest.mark.usefixtures("engine", "short_probe")
def test_plan_foresees_a_turn(lippmann):
    words = ("plan", "teapot", "--integrator", "direct", "--method", "full", "--spp", "2", "--json")
    still, turn = lippmann(*words).json, lippmann(*words, "--turntable", "12").json
    assert (still["frames"], turn["frames"]) == (1, 12)
    assert turn["rays"]["primary"] == 12 * still["rays"]["primary"]
    stages = turn["seconds"]
    assert stages["total"] == pytest.approx(sum(spent for stage, spent in stages.items() if stage != "total"))
    assert stages["trace"] > still["seconds"]["trace"]
    told = lippmann(*words[:-1], "--turntable", "12", "--swing", "40")
    assert "12 frames" in told.out.splitlines()[0]
    refused = lippmann(*words, "--turntable", "1")
    assert (refused.code, refused.err.count("\n")) == (2, 1)


@pytest.mark.slow
def test_bad_input_is_one_line_and_code_2(lippmann, tmp_path):
    def refused(*words):
        outcome = lippmann(*words)
        assert outcome.code == 2, outcome.err
        assert outcome.out == ""
        assert outcome.err.startswith("lippmann: ")
        assert outcome.err.count("\n") == 1
        return outcome.err

    render = ("quilt", "render", "teapot")
    assert "the name says another quilt; the quilt's ends in _qs8x6a0.75.png" in refused(
        *render, "-o", tmp_path / "x_qs5x9a0.75.png"
    )
    assert "q: no ending; known are .png" in refused(*render, "-o", tmp_path / "q")
    assert "unknown ending '.jpg'" in refused(*render, "-o", tmp_path / "x_qs8x6a0.75.jpg")
    assert "unknown display" in refused(*render, "-d", "portrai")
    assert "no quilt is known" in refused(*render, "-d", "panel-4k")
    assert "columns x rows, such as 8x6" in refused(*render, "--views", "48")
    assert "such as 512x512" in refused(*render, "--size", "3360")
    assert "no multiple of 8" in refused(*render, "--size", "3361x3360")
    assert "pooled shares denoised light" in refused(*render, "--method", "pooled", "--denoise", "none")
    for words in (render, ("plan", "teapot")):
        line = "--method: unknown value 'lens-view'; known are auto, full, pooled"
        assert line in refused(*words, "--method", "lens-view")
    out = tmp_path / "x_qs4x4a1.png"
    square = refused(*render, "-d", "mla-square", "--views", "4x4", "--size", "400x400", "-o", out, "--quiet")
    assert "square lenses" in square
    assert "no such file" in refused("plan", tmp_path / "no.glb", "--quiet")
    assert "unknown display" in refused("plan", "teapot", "-d", "lkg", "--quiet")
    for amount in ("much", "4"):
        assert "no amount of memory" in refused("plan", "teapot", "--memory", amount, "--quiet")
    assert not list(tmp_path.iterdir())


def test_a_zarr_quilt_is_replaced_as_other_files_are(lippmann, tmp_path):
    views, output = tmp_path / "views", tmp_path / "a_qs2x1.zarr"
    views.mkdir()
    for number in range(2):
        Image.new("RGB", (128, 256), (number, 0, 255)).save(views / f"{number}.png")
    for _ in range(2):
        packed = lippmann("quilt", "pack", views, "-o", output)
        assert packed.code == 0, packed.err
    assert output.is_dir()
