"""Prints: ``render --display print``, ``lippmann pitch-test``, ``lippmann marks``, and what they say of bad input."""

from __future__ import annotations

import numpy as np
import pytest
import tifffile
from PIL import Image

from lippmann.calibration.pitch_strips import PitchTest
from lippmann.display import load_display
from lippmann.display.formats.print_sheet import print_of_texts
from lippmann.image import read_picture

SHEET = ("--lpi", "20", "--ppi", "200", "--size", "40x20mm", "--viewing-distance", "30cm")
SHORT = "print:lpi=20,ppi=200,size=40x20mm,viewing-distance=30cm"
QUICK = ("--integrator", "normal", "--spp", "1", "--quiet")


def dpi(path):
    with tifffile.TiffFile(path) as file:
        tags = file.pages[0].tags
        assert tags["ResolutionUnit"].value == 2
        return tags["XResolution"].value, tags["YResolution"].value


def test_a_print_is_rendered_at_its_true_size(lippmann, engine, tmp_path):
    path = tmp_path / "print.tif"
    assert lippmann("render", "teapot", "--display", "print", *SHEET, *QUICK, "-o", path).code == 0
    image = read_picture(path)
    assert image.display == load_display(SHORT)
    assert image.pixels.shape == (157, 315, 3)
    assert image.display.viewing_distance == 300
    assert dpi(path) == ((200, 1), (200, 1))
    with Image.open(path) as picture:
        assert picture.info["dpi"] == (200, 200)
        assert picture.mode == "RGB"


def test_marks_are_added_by_render_and_afterwards_alike(lippmann, engine, tmp_path):
    plain, marked, later = (tmp_path / f"{name}.tif" for name in ("plain", "marked", "later"))
    assert lippmann("render", "teapot", "--display", SHORT, *QUICK, "-o", plain).code == 0
    assert lippmann("render", "teapot", "-d", "print", *SHEET, "--marks", "0.5cm", *QUICK, "-o", marked).code == 0
    outcome = lippmann("marks", plain, "--margin", "5mm", "-o", later, "--json")
    assert outcome.json["size"] == [393, 235]
    assert outcome.json["size_mm"] == pytest.approx([49.911, 29.845])
    first, second = read_picture(marked), read_picture(later)
    np.testing.assert_array_equal(first.pixels, second.pixels)
    assert first.display == second.display
    np.testing.assert_array_equal(first.pixels[39:-39, 39:-39], read_picture(plain).pixels)
    assert dpi(later) == ((200, 1), (200, 1))
    assert "49.91x29.84 mm" in lippmann("marks", plain, "--margin", "5mm", "-o", later).out
    assert lippmann("replay", marked, "-o", tmp_path / "seen.png").code == 0


def test_a_pitch_test(lippmann, tmp_path):
    path = tmp_path / "test.tif"
    outcome = lippmann("pitch-test", *SHEET, "--strips", "5", "--step", "0.2", "-o", path, "--json")
    sheet = print_of_texts({"lpi": "20", "ppi": "200", "size": "40x20mm", "viewing-distance": "300"})
    test = PitchTest(sheet, 5, 0.2)
    assert outcome.json["strips"] == [strip.lpi for strip in test.all_strips]
    assert outcome.json["expected"] == pytest.approx(sheet.pitch_on_print)
    from lippmann.display.pixel_window import PixelWindow

    np.testing.assert_array_equal(tifffile.imread(path), test.draw(PixelWindow(0, 0, 315, 157)))
    assert dpi(path) == ((200, 1), (200, 1))
    said = lippmann("pitch-test", *SHEET, "-o", path)
    assert said.code == 0
    assert "21 strips from" in said.out
    assert "315x157 pixels at 200 ppi" in said.out


def test_the_pitch_that_was_found_is_rendered(lippmann, engine, tmp_path):
    path = tmp_path / "print.tif"
    sheet = ("--print-lpi", "19.83", "--ppi", "200", "--size", "40x20mm", "--thickness", "2mm", "--index", "1.5")
    assert lippmann("render", "teapot", "--display", "print", *sheet, *QUICK, "-o", path).code == 0
    display = read_picture(path).display
    assert 25.4 / display.micro_image_pitch == pytest.approx(19.83)
    assert display.gap == pytest.approx(2 / 1.5)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--lpi", "0"), "--lpi: lpi is 0; it must lie between 1 and 1000 lenses per inch"),
        (("--lpi", "-60"), "--lpi: lpi is -60"),
        (("--lpi", "many"), "--lpi: 'many' is not a number"),
        (("--ppi", "0"), "--ppi: ppi is 0"),
        (("--ppi", "30"), "--ppi: a lens covers 1.506 pixels"),
        (("--size", "0x20mm"), "--size: a side of 0 mm"),
        (("--size", "40mm"), "--size: '40mm' is not a size"),
        (("--size", "40x20yards"), "--size: '40x20yards' has the unknown unit 'yards'"),
        (("--viewing-distance", "-1"), "--viewing-distance: viewing_distance is -1 mm"),
        (("--viewing-distance", "soon"), "--viewing-distance: 'soon' is not a length"),
        (("--thickness", "0"), "--thickness: thickness is 0 mm"),
        (("--index", "1.5"), "--index: index is given without a thickness"),
        (("--field", "0"), "--field: field is 0"),
    ],
)
def test_bad_prints_are_one_line_and_code_2(lippmann, tmp_path, words, said):
    for command in (("render", "teapot", "--display", "print"), ("pitch-test",)):
        path = tmp_path / "print.tif"
        outcome = lippmann(*command, *SHEET, *words, "-o", path, "--quiet")
        assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)
        assert said in outcome.err
        assert not path.exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("render", "teapot", "--display", "print"), "--ppi: ppi is missing; a print needs lpi"),
        (("render", "teapot", "--display", "print", "--ppi", "720", "--size", "9x9cm"), "--lpi: lpi is missing"),
        (("render", "teapot", "--lpi", "60"), "--lpi: does not apply to the display seed-lenticular"),
        (("render", "teapot", "--display", SHORT, "--ppi", "60"), "--ppi: does not apply to the display print:"),
        (("render", "teapot", "--display", "print:lpi=0,ppi=720,size=9x9cm"), "print: lpi: lpi is 0"),
        (("render", "teapot", "--display", SHORT, "--marks", "1mm"), "1 mm is out of range"),
        (("render", "teapot", "--display", SHORT, "--marks", "wide"), "--marks: 'wide' is not a length"),
        (("render", "teapot", "--display", "mla-square", "--marks", "9mm"), "mla-square has square lenses"),
        (("pitch-test", *SHEET, "--strips", "0"), "0 is out of range"),
        (("pitch-test", *SHEET, "--step", "-1"), "-1 is out of range"),
        (("pitch-test",), "--ppi: ppi is missing"),
        (("marks", "absent.tif"), "absent.tif: is not there"),
    ],
)
def test_bad_input_is_one_line_and_code_2(lippmann, tmp_path, words, said):
    path = tmp_path / "print.tif"
    outcome = lippmann(*words, "-o", path, "--quiet")
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)
    assert said in outcome.err
    assert not path.exists()


def test_a_pitch_test_is_a_tiff(lippmann, tmp_path):
    outcome = lippmann("pitch-test", *SHEET, "-o", tmp_path / "test.png")
    assert outcome.code == 2
    assert "a pitch test is a TIFF file" in outcome.err
