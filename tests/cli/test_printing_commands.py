"""Prints: ``render --display print``, ``lippmann pitch-test``, ``lippmann marks``, and what they say of bad input."""

from __future__ import annotations

import numpy as np
import pytest
import tifffile
from PIL import Image, ImageCms

import lippmann as package
from lippmann.calibration.pitch_strips import PitchTest
from lippmann.display import load_display
from lippmann.display.formats.print_sheet import print_of_texts
from lippmann.image import read_picture
from lippmann.image.read import open_file

SHEET = ("--lpi", "20", "--ppi", "200", "--size", "40x20mm", "--viewing-distance", "30cm")
SHORT = "print:lpi=20,ppi=200,size=40x20mm,viewing-distance=30cm"
QUICK = ("--integrator", "normal", "--spp", "1", "--quiet")


def dpi(path):
    with tifffile.TiffFile(path) as file:
        tags = file.pages[0].tags
        assert tags["ResolutionUnit"].value == 2
        return tags["XResolution"].value, tags["YResolution"].value


@pytest.mark.slow
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


@pytest.mark.slow
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
    sheet = print_of_texts({"lpi": "20", "ppi": "200", "size": "40x20mm", "viewing-distance": "300mm"})
    test = PitchTest(sheet, 5, 0.2)
    assert outcome.json["strips"] == [strip.lpi for strip in test.all_strips]
    assert outcome.json["expected"] == pytest.approx(sheet.pitch_on_print)
    from lippmann.display.panel import PixelWindow

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
    # The crest that focuses best on so thin a sheet has a gap a tenth below thickness / index.
    assert display.gap == pytest.approx(0.9 * 2 / 1.5, rel=0.01)
    assert (display.lens.thickness, display.lens.index) == (2, 1.5)


@pytest.mark.slow
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
        (("--size", "40x20yards"), "--size: unknown unit 'yards'"),
        (("--viewing-distance", "-1mm"), "--viewing-distance: viewing_distance is -1 mm"),
        (("--viewing-distance", "soon"), "--viewing-distance: 'soon' is not a length"),
        (("--thickness", "0mm"), "--thickness: thickness is 0.0; it must be a finite length above zero; sheets"),
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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("render", "teapot", "--display", "print"), "--lpi: lpi, ppi, size are missing; a print needs lpi"),
        (("render", "teapot", "--display", "print", "--ppi", "720", "--size", "9x9cm"), "--lpi: lpi is missing"),
        (("render", "teapot", "--lpi", "60"), "--lpi: does not apply to the display seed-lenticular"),
        (("render", "teapot", "--display", SHORT, "--ppi", "60"), "--ppi: does not apply to the display print:"),
        (("render", "teapot", "--display", "print:lpi=0,ppi=720,size=9x9cm"), "print: lpi: lpi is 0"),
        (("render", "teapot", "--display", SHORT, "--marks", "1mm"), "1 mm is out of range"),
        (("render", "teapot", "--display", SHORT, "--marks", "wide"), "--marks: 'wide' is not a length"),
        (
            ("render", "teapot", "--display", "mla-square", "--marks", "9mm"),
            "--marks: does not apply to the display mla-square; it applies to prints only",
        ),
        (("render", "teapot", "--bleed", "3mm"), "--bleed: does not apply to the display seed-lenticular"),
        (("render", "teapot", "-d", "lkg-portrait", "--mirror"), "--mirror: does not apply to the display"),
        (("render", "teapot", "-d", SHORT, "--icc", "absent.icc"), "absent.icc: no such file"),
        (("render", "teapot", "-d", SHORT, "--bleed", "200mm"), "--bleed: 200 mm is out of range"),
        (("render", "teapot", "-d", SHORT, "--maps", "maps", "--resume"), "--maps: needs the whole picture at once"),
        (("render", "teapot", "-d", SHORT, "--mirror", "--turntable", "2"), "--mirror: does not apply to frames"),
        (("weave", "absent.png", "-d", "lkg-portrait", "--marks", "8mm"), "--marks: does not apply to the display"),
        (("pitch-test", *SHEET, "--strips", "0"), "0 is out of range"),
        (("pitch-test", *SHEET, "--step", "-1"), "-1 is out of range"),
        (("pitch-test",), "--lpi: lpi, ppi, size are missing"),
        (("marks", "absent.tif"), "absent.tif: no such file"),
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


POINT = (*QUICK, "--pixel-filter", "point", "--scale", "4")


def test_a_bleed_goes_on_beyond_the_same_picture(lippmann, engine, tmp_path):
    plain, bled, sheet = (tmp_path / f"{name}.tif" for name in ("plain", "bled", "sheet"))
    assert lippmann("render", "teapot", "-d", SHORT, *POINT, "-o", plain).code == 0
    assert lippmann("render", "teapot", "-d", SHORT, *POINT, "--bleed", "2.54mm", "-o", bled).code == 0
    first, second = read_picture(plain), read_picture(bled)
    assert second.pixels.shape == (157 + 40, 315 + 40, 3)  # 2.54 mm are 20 pixels of 1/200 inch
    np.testing.assert_array_equal(second.pixels[20:-20, 20:-20], first.pixels)
    np.testing.assert_array_equal(second.world_from_display, first.world_from_display)
    assert second.pixels[:20].std() > 0  # more of the scene, no white paper
    everything = ("--bleed", "2.54mm", "--marks", "5mm", "--mirror")
    assert lippmann("render", "teapot", "-d", SHORT, *POINT, *everything, "-o", sheet).code == 0
    mirrored = tifffile.imread(sheet)
    np.testing.assert_array_equal(mirrored[39:-39, 39:-39], tifffile.imread(bled)[:, ::-1])
    assert lippmann("replay", sheet, "-o", tmp_path / "seen.png").code == 0
    place = package.PlacementOptions(scale=4)
    asked = {"integrator": "normal", "spp": 1, "pixel_filter": "point"}
    image = package.render("teapot", SHORT, placement=place, bleed=2.54, **asked)
    assert image.display == second.display
    np.testing.assert_allclose(np.clip(image.pixels, 0, 1), second.pixels, atol=0.01)  # of 8 bits


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a.tif", "a.png"])
def test_a_print_in_tiles_is_finished_as_one_in_memory(lippmann, engine, tmp_path, name):
    profile = tmp_path / "own.icc"
    profile.write_bytes(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    finish = ("--bleed", "2.54mm", "--marks", "5mm", "--mirror", "--icc", profile)
    for folder, more in (("whole", ()), ("tiled", ("--resume",))):
        (tmp_path / folder).mkdir()
        output = tmp_path / folder / name
        done = lippmann("render", "teapot", "-d", SHORT, *POINT, *finish, *more, "-o", output)
        assert done.code == 0, done.err
        assert [path.name for path in output.parent.iterdir()] == [name]
    whole, tiled = (open_file(tmp_path / folder / name) for folder in ("whole", "tiled"))
    assert tiled.metadata.display == whole.metadata.display
    assert tiled.icc == whole.icc == profile.read_bytes()
    first, second = (np.asarray(Image.open(tmp_path / folder / name)).astype(int) for folder in ("whole", "tiled"))
    assert np.abs(first - second).max() <= 1  # tiles are rounded to codes once more


@pytest.mark.slow
def test_zarr_may_be_mirrored(lippmann, engine, tmp_path):
    for name, more in (("plain.zarr", ()), ("mirrored.zarr", ("--mirror",))):
        assert lippmann("render", "teapot", "-d", SHORT, *POINT, *more, "-o", tmp_path / name).code == 0
    plain, mirrored = (open_file(tmp_path / name) for name in ("plain.zarr", "mirrored.zarr"))
    np.testing.assert_array_equal(
        read_picture(tmp_path / "mirrored.zarr").pixels, read_picture(tmp_path / "plain.zarr").pixels
    )
    assert mirrored.metadata.display.sheet.mirrored
    assert not plain.metadata.display.sheet.mirrored


def test_a_woven_print_has_its_trim_whatever_the_bleed(lippmann, tmp_path):
    views = tmp_path / "views"
    views.mkdir()
    rng = np.random.default_rng(8)
    for number in range(4):
        codes = rng.integers(0, 256, (20, 40, 3), dtype=np.uint8)
        Image.fromarray(codes).save(views / f"view_{number}.png")
    plain, bled, sheet = (tmp_path / f"{name}.tif" for name in ("plain", "bled", "sheet"))
    assert lippmann("weave", views, "-d", SHORT, "-o", plain).code == 0
    assert lippmann("weave", views, "-d", SHORT, "--bleed", "2.54mm", "-o", bled).code == 0
    np.testing.assert_array_equal(tifffile.imread(bled)[20:-20, 20:-20], tifffile.imread(plain))
    assert (
        lippmann("weave", views, "-d", SHORT, "--bleed", "2.54mm", "--marks", "5mm", "--mirror", "-o", sheet).code == 0
    )
    np.testing.assert_array_equal(tifffile.imread(sheet)[39:-39, 39:-39], tifffile.imread(bled)[:, ::-1])


def test_a_job_sheet_is_one_page(lippmann, tmp_path, monkeypatch):
    views = tmp_path / "views"
    views.mkdir()
    for number in range(2):
        Image.new("RGB", (40, 20), (90 * number, 80, 70)).save(views / f"view_{number}.png")
    picture, sheet, job = tmp_path / "print.tif", tmp_path / "sheet.tif", tmp_path / "job.pdf"
    assert lippmann("weave", views, "-d", SHORT, "--bleed", "2.54mm", "-o", picture).code == 0
    outcome = lippmann("marks", picture, "-o", sheet, "--job-sheet", job)
    assert outcome.code == 0
    assert "cut to 40.01x19.94 mm" in outcome.out
    assert job.read_bytes().startswith(b"%PDF")
    assert job.read_bytes().count(b"/Type /Page ") == 1
    alone = tmp_path / "alone.pdf"
    assert lippmann("marks", sheet, "--job-sheet", alone, "--json").json["output"] is None
    assert alone.exists()
    monkeypatch.chdir(tmp_path)
    assert lippmann("marks", picture, "--json").json["output"] == "print-marks.tif"
    assert lippmann("pitch-test", *SHEET, "--json").json["output"] == "pitch-test.tif"
    for words, said in (
        ((picture, "--job-sheet", tmp_path / "job.png"), "a job sheet is a .pdf file"),
        ((picture, "-o", sheet, "--bleed", "3mm"), "--bleed: needs --display"),
        ((sheet, "-o", tmp_path / "twice.tif"), "sheet.tif: has a margin with marks already"),
    ):
        outcome = lippmann("marks", *words, "--quiet")
        assert (outcome.code, outcome.err.count("\n"), said in outcome.err) == (2, 1, True), outcome.err


def test_marks_are_told_the_bleed_of_a_picture_without_a_record(lippmann, tmp_path):
    foreign = tmp_path / "foreign.png"
    Image.new("RGB", (315 + 40, 157 + 40), (90, 80, 70)).save(foreign)
    outcome = lippmann("marks", foreign, "-d", SHORT, "--bleed", "2.54mm", "-o", tmp_path / "sheet.tif", "--json")
    assert outcome.json["trim_mm"] == pytest.approx([315 * 0.127, 157 * 0.127])
    assert read_picture(tmp_path / "sheet.tif").display.sheet.bleed == 20
