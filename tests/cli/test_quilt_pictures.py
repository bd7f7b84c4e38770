"""Quilts as pictures: what they say of themselves, ``info``, ``replay``, ``refocus``, and layouts that were lost."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from PIL import Image

from lippmann.display import load_display
from lippmann.image.metadata import Provenance
from lippmann.quilts.files import read_quilt, write_quilt
from lippmann.quilts.quilt import Quilt, QuiltLayout

LAYOUT = QuiltLayout(8, 6, 0.75)


@pytest.fixture(params=[".png", ".exr", ".tif"])
def quilt(request, tmp_path):
    values = np.repeat((np.arange(48) / 47).astype(np.float32), 3).reshape(48, 3)
    made = Quilt(np.empty((384, 384, 3), dtype=np.float32), LAYOUT, display=load_display("looking-glass-portrait"))
    for number in range(48):
        made.view(number)[...] = values[number]
    path = tmp_path / f"a_qs8x6a0.75{request.param}"
    write_quilt(made, path)
    return path


@pytest.mark.slow
def test_a_renamed_quilt_knows_what_it_is(lippmann, quilt):
    lost = quilt.rename(quilt.with_stem("lost"))
    found = read_quilt(lost)
    assert found.layout == LAYOUT
    assert found.display == load_display("looking-glass-portrait")
    values = lippmann("info", lost, "--json").json
    assert values["quilt"] == {"columns": 8, "rows": 6, "aspect": 0.75}
    assert "views       8x6 of 48x64 pixels, aspect 0.75" in lippmann("info", lost).out
    seen = lost.with_name("seen.exr")
    assert lippmann("replay", lost, "--size", "30x40", "-o", seen, "--filter", "linear").code == 0
    assert lippmann("refocus", lost, "--plane", "0", "--size", "30x40", "-o", lost.with_name("focused.png")).code == 0
    assert (
        lippmann("refocus", lost, "--planes", "0:9:2", "--size", "30x40", "-o", lost.with_name("stack.tif")).code == 0
    )
    assert lippmann("replay", lost, "--sweep", "--frames", "2", "-o", lost.with_name("moving.png")).code == 0
    with Image.open(lost.with_name("focused.png")) as picture:
        assert picture.size == (30, 40)


def test_of_another_program_s_quilt_no_provenance_is_said(lippmann, tmp_path):
    path = tmp_path / "city_qs8x6a0.75 (1).webp"
    Image.new("RGB", (384, 384), (90, 90, 90)).save(path)
    assert lippmann("info", path).out.splitlines() == [
        f"{path}: quilt, 384x384, uint8",
        "views       8x6 of 48x64 pixels, aspect 0.75",
    ]


def test_what_a_quilt_says_is_to_be_read(lippmann, tmp_path):
    bounds = {"psnr_low": 30.9, "psnr_high": 36.3, "worst_low": 25.8, "worst_high": 33.2}
    estimate = {"psnr": 33.1, "worst": 28.8, "worst_lens": [0, 0], **bounds}
    made = Provenance(estimate=estimate, options={"depth_range": [-23.669759999999997, 11.8], "denoise": "oidn"})
    quilt = Quilt(np.zeros((256, 256, 3), np.uint8), QuiltLayout(4, 2, 0.75), provenance=made)
    said = lippmann("info", quilt.save(tmp_path / "a.png")).out
    assert "worst view 28.8 dB" in said
    assert "depth_range -23.6698, 11.8\ndenoise     oidn\n" in said


def test_an_estimate_of_other_figures_is_told_as_it_is(lippmann, tmp_path):
    made = Provenance(estimate={"psnr": 31.25, "judged_by": "hand"})
    quilt = Quilt(np.zeros((256, 256, 3), np.uint8), QuiltLayout(4, 2, 0.75), provenance=made)
    assert "estimated   psnr 31.25, judged_by hand\n" in lippmann("info", quilt.save(tmp_path / "a.png")).out


@pytest.mark.long
def test_a_lost_layout_is_given_back(lippmann, tmp_path):
    path = tmp_path / "quilt.jpg"
    Image.new("RGB", (384, 384), (90, 90, 90)).save(path)
    outcome = lippmann("weave", path, "-d", "looking-glass-portrait", "-o", tmp_path / "woven.png")
    assert (outcome.code, "does not say how many views" in outcome.err) == (2, True)
    given = ("--layout", "8x6", "--aspect", "0.75")
    assert lippmann("weave", path, *given, "-d", "looking-glass-portrait", "-o", tmp_path / "woven.png").code == 0
    assert lippmann("quilt", "unpack", path, *given, "-o", tmp_path / "views").code == 0
    outcome = lippmann("replay", path, *given, "-o", tmp_path / "seen.png")
    assert (outcome.code, "say --display" in outcome.err) == (2, True)
    assert lippmann("replay", path, *given, "-d", "portrait", "-o", tmp_path / "seen.png").code == 0
    wrong = lippmann("weave", path, "--layout", "8x6", "--aspect", "1.6", "-d", "looking-glass-portrait", "-o",
                     tmp_path / "woven.png")  # fmt: skip
    assert "the quilt has the aspect 1.6" in wrong.err
    assert "--aspect: applies to --layout only" in lippmann("info", path, "--aspect", "1").err


def test_the_page_shows_a_quilt_as_its_display_does(lippmann, tmp_path):
    display = tmp_path / "print.toml"
    display.write_text(
        "gap = 2.0\nviewing_distance = 300\naperture_distance = 0\n[panel]\nwidth = 96\nheight = 128\n"
        'pixel_pitch = "200 dpi"\n[lens_array]\nlayout = "lenticular"\npitch = "20 lpi"\n'
    )
    Image.new("RGB", (384, 384), (90, 90, 90)).save(tmp_path / "plain.png")
    page = tmp_path / "page.html"
    words = ("view", tmp_path / "plain.png", "--layout", "8x6", "--export", page)
    assert "say --display" in lippmann(*words).err
    outcome = lippmann(*words, "--display", display)
    assert outcome.code == 0, outcome.err
    assert str(tmp_path / "plain.png") in outcome.out
    assert page.stat().st_size > 10_000


def test_a_quilt_is_no_picture_of_a_panel(lippmann, quilt, tmp_path):
    lost = shutil.copy(quilt, tmp_path / f"copy{quilt.suffix}")
    outcome = lippmann("views", lost, "-o", tmp_path / "views")
    assert outcome.code == 2
    assert "is a quilt" in outcome.err


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        ('{"columns":0,"rows":6,"aspect":1}', "0 columns"),
        ('{"columns":"8","rows":6,"aspect":1}', "says the layout"),
        ("[]", "says the layout"),
    ],
)
def test_metadata_that_makes_no_sense(lippmann, tmp_path, layout, message):
    from PIL.PngImagePlugin import PngInfo

    info = PngInfo()
    info.add_itxt("lippmann", f'{{"lippmann":1,"quilt":{layout},"display":null,"provenance":{{}}}}')
    Image.new("RGB", (384, 384)).save(tmp_path / "a.png", pnginfo=info)
    outcome = lippmann("info", tmp_path / "a.png")
    assert outcome.code == 2
    assert message in outcome.err
