"""``lippmann interlace``: every lens shows each eye its photograph, by the print's own geometry."""

from __future__ import annotations

import math

import numpy as np
import pytest
import tifffile
from PIL import Image, ImageCms

LPI, PPI, DISTANCE, FIELD, COUNT = 20.0, 400.0, 300.0, 50.0, 4
MONITOR = "monitor:dpi=282,size=400x300,pitch=45.5,slope=-6,center=0"
SHEET = ("--lpi", LPI, "--ppi", PPI, "--viewing-distance", f"{DISTANCE}mm", "--field", FIELD)
LEVELS = (30, 90, 160, 230)


@pytest.fixture
def frames(tmp_path):
    """Photographs of one grey each; their names sort otherwise as text."""
    folder = tmp_path / "frames"
    folder.mkdir()
    for number, level in zip((2, 9, 10, 11), LEVELS, strict=True):
        Image.new("RGB", (60, 40), (level,) * 3).save(folder / f"frame{number}.png")
    return sorted(folder.iterdir())


def seen(codes, fraction):
    """Codes ``(lenses, 3)`` that an eye sees behind the middle of every lens in the middle row of a print.

    ``fraction`` is its place in the field of view, 0 left to 1 right, at the viewing distance. Hand calculation: for a
    field F of micro-images of pitch m, the gap is m / (2 tan(F / 2)), and m is the lens pitch times 1 + gap / D. Lens
    centres lie at whole pitches from the middle or halfway between: at halves for an even number of micro-images only.
    """
    pitch, pixel = 25.4 / LPI, 25.4 / PPI
    parallel = pitch / (2 * math.tan(math.radians(FIELD / 2)))
    gap = parallel / (1 - parallel / DISTANCE)
    eye = (2 * fraction - 1) * DISTANCE * (pitch * (1 + gap / DISTANCE)) / (2 * gap)
    width = codes.shape[1]
    lens = np.arange(-9, 10) * pitch
    # The eye's line through the lens's centre, on to the print.
    x = lens + (lens - eye) * gap / DISTANCE
    column = np.floor(x / pixel + width / 2).astype(int)
    return codes[codes.shape[0] // 2, column]


def interlace(lippmann, frames, path, *options):
    outcome = lippmann("interlace", *frames, *SHEET, "--views", "nearest", "-o", path, *options)
    assert outcome.code == 0, outcome.err
    with Image.open(path) as picture:
        assert picture.info["dpi"] == pytest.approx((PPI, PPI), rel=1e-4)
        return np.asarray(picture)


def test_an_empty_folder_and_a_pattern_without_files_are_named(lippmann, tmp_path):
    (tmp_path / "frames").mkdir()
    for given, said in (
        ("frames", "no photographs are given; at least 2 are interlaced"),
        ("none*.jpg", "none*.jpg: no such file"),
        ("frame", "frame: no such file"),
    ):
        outcome = lippmann("interlace", tmp_path / given, *SHEET, "--size", "30x20mm", "-o", tmp_path / "print.tif")
        assert outcome.code == 2
        assert said in outcome.err


def test_one_photograph_may_be_a_pair_and_monitors_weave_by_themselves(lippmann, tmp_path):
    pair = tmp_path / "pair.png"
    Image.new("RGB", (8, 4)).save(pair)
    for words, said in (
        (("interlace", pair, *SHEET, "--size", "30x20mm"), "one photograph is given; at least 2 are interlaced"),
        (("interlace", pair, *SHEET, "--size", "30x20mm"), "lippmann weave --layout 2x1"),
        (("interlace", pair, pair, "-d", "elf-sr"), "--display: elf-sr takes no native pixels"),
        (("weave", pair, "--layout", "2x1", "-d", "elf-sr"), "--display: elf-sr takes no native pixels"),
    ):
        outcome = lippmann(*words, "-o", tmp_path / "out.tif")
        assert outcome.code == 2
        assert said in outcome.err


@pytest.mark.long_cases("options0-print.tif")
@pytest.mark.slow
@pytest.mark.parametrize("name", ["print.tif", "print.png"])
@pytest.mark.parametrize("options", [(), ("--reverse",)])
def test_each_eye_sees_its_photograph_behind_every_lens(lippmann, frames, tmp_path, name, options):
    codes = interlace(lippmann, frames, tmp_path / name, "--size", "30x20mm", *options)
    assert codes.shape == (315, 472, 3)
    for number, level in enumerate(reversed(LEVELS) if options else LEVELS):
        assert (seen(codes, (number + 0.5) / COUNT) == level).all()


@pytest.mark.slow
def test_lenses_across_show_the_first_photograph_from_above(lippmann, frames, tmp_path):
    codes = interlace(lippmann, frames, tmp_path / "flip.tif", "--size", "20x30mm", "--lenses", "across")
    assert codes.shape == (472, 315, 3)
    for number, level in enumerate(LEVELS):
        # Turned to the left, the print's top is on the left, and so is an eye above it.
        assert (seen(np.rot90(codes), (number + 0.5) / COUNT) == level).all()


def test_a_print_with_lenses_across_is_replayed_turned_to_the_left(lippmann, frames, tmp_path):
    flip = ("interlace", *frames, *SHEET, "--size", "20x30mm", "--lenses", "across", "--views", "nearest")
    assert "a replay of lying lenses needs the file turned" in lippmann(*flip, "-o", tmp_path / "flip.png").err
    with Image.open(tmp_path / "flip.png") as picture:
        picture.transpose(Image.Transpose.ROTATE_90).save(tmp_path / "turned.png")
    sheet = f"print:lpi={LPI},ppi={PPI},size=30x20mm,viewing-distance={DISTANCE}mm,field={FIELD}"
    for x, level in ((-100, LEVELS[0]), (100, LEVELS[-1])):  # from above and from below
        seen_by_eye = ("replay", tmp_path / "turned.png", "-d", sheet, f"--eye={x},0,{DISTANCE}", "--size", "30x20")
        assert lippmann(*seen_by_eye, "-o", tmp_path / "seen.png").code == 0
        assert abs(int(np.asarray(Image.open(tmp_path / "seen.png"))[10, 15, 0]) - level) <= 1


def test_photographs_stand_upright_under_lenses_across(lippmann, tmp_path):
    half = np.zeros((40, 60, 3), dtype=np.uint8)
    half[:20, :30] = 200  # top left
    for number in range(2):
        Image.fromarray(half).save(tmp_path / f"{number}.png")
    codes = interlace(lippmann, sorted(tmp_path.glob("?.png")), tmp_path / "flip.tif", "--size", "30x20mm", "--lenses",
                      "across")  # fmt: skip
    assert (np.abs(codes[:140, :220].astype(int) - 200) <= 3).all()  # resampling overshoots a little
    assert (codes[170:] <= 3).all()
    assert (codes[:, 250:] <= 3).all()


def test_bleed_continues_lenses_and_photographs(lippmann, frames, tmp_path):
    plain = interlace(lippmann, frames, tmp_path / "plain.tif", "--size", "30x20mm")
    bled = interlace(lippmann, frames, tmp_path / "bled.tif", "--size", "30x20mm", "--bleed", "3.175mm")
    assert bled.shape == (plain.shape[0] + 100, plain.shape[1] + 100, 3)
    np.testing.assert_array_equal(bled[50:-50, 50:-50], plain)


def dark(row):
    return np.flatnonzero((row == 0).all(axis=-1))


def test_marks_after_a_bleed_cut_at_the_trim(lippmann, frames, tmp_path):
    """Cutting lines stand a bleed and a margin from the edge: 3.175 and 8 mm, 50 and 126 pixels of 1/400 inch."""
    interlace(lippmann, frames, tmp_path / "bled.png", "--size", "30x20mm", "--bleed", "3.175mm")
    said = lippmann("marks", tmp_path / "bled.png", "--margin", "8mm", "-o", tmp_path / "sheet.png", "--json").json
    codes = np.asarray(Image.open(tmp_path / "sheet.png"))
    plain = 472, 315
    assert codes.shape == (plain[1] + 352, plain[0] + 352, 3)
    assert said["trim_mm"] == pytest.approx([plain[0] * 25.4 / 400, plain[1] * 25.4 / 400])
    top, left = codes[3], codes[:, 3]
    line = round(0.1 / (25.4 / 400))
    expected = [*range(176 - line, 176), *range(176 + plain[0], 176 + plain[0] + line)]
    across = [column for column in dark(top) if not 185 < column < 176 + plain[0] - 9]  # without the word TOP
    assert across == expected
    assert dark(left).tolist() == [*range(176 - line, 176), *range(176 + plain[1], 176 + plain[1] + line)]


def test_info_tells_the_size_and_borders_of_a_print(lippmann, frames, tmp_path):
    finished = ("--bleed", "1.27mm", "--marks", "7mm", "--mirror")
    for options, borders in (((), "\n"), (finished, ", bleed 1.27 mm, margin 6.985 mm, mirrored\n")):
        interlace(lippmann, frames, tmp_path / "a.tif", "--size", "30x20mm", *options)
        told = lippmann("info", tmp_path / "a.tif").out
        assert f"\nprint       20-lpi lenticular print, 30x20 mm at 400 ppi, seen from 300 mm{borders}" in told


def test_a_mirrored_print_is_the_whole_sheet_mirrored_once(lippmann, frames, tmp_path):
    options = ("--size", "30x20mm", "--bleed", "3mm", "--marks", "5mm")
    plain = interlace(lippmann, frames, tmp_path / "plain.tif", *options)
    mirrored = interlace(lippmann, frames, tmp_path / "mirrored.png", *options, "--mirror")
    np.testing.assert_array_equal(mirrored, plain[:, ::-1])
    bled = interlace(lippmann, frames, tmp_path / "bled.tif", *options[:-2], "--mirror")
    np.testing.assert_array_equal(plain[79:-79, 79:-79], bled[:, ::-1])
    # Marks come later to the mirrored file, by a command that is told nothing; and told again it is mirrored no more.
    for again in ((), ("--mirror",)):
        later = tmp_path / "later.tif"
        assert lippmann("marks", tmp_path / "bled.tif", "--margin", "5mm", "-o", later, *again).code == 0
        np.testing.assert_array_equal(np.asarray(Image.open(later)), mirrored)
    across = interlace(lippmann, frames, tmp_path / "a.tif", "--size", "20x30mm", "--lenses", "across")
    turned = interlace(lippmann, frames, tmp_path / "b.tif", "--size", "20x30mm", "--lenses", "across", "--mirror")
    np.testing.assert_array_equal(turned, across[:, ::-1])


def test_profiles_of_prints_and_panels(lippmann, frames, tmp_path):
    from lippmann.codecs.icc import srgb_profile

    def profile(path):
        with Image.open(path) as picture:
            return picture.info.get("icc_profile")

    interlace(lippmann, frames, tmp_path / "print.tif", "--size", "30x20mm")
    assert profile(tmp_path / "print.tif") == srgb_profile()
    own = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    own = own[:24] + bytes(12) + own[36:]  # another one, by its bytes
    (tmp_path / "own.icc").write_bytes(own)
    interlace(lippmann, frames, tmp_path / "own.tif", "--size", "30x20mm", "--icc", tmp_path / "own.icc")
    assert lippmann("marks", tmp_path / "own.tif", "-o", tmp_path / "marked.png").code == 0
    assert profile(tmp_path / "own.tif") == profile(tmp_path / "marked.png") == own
    for path in frames:
        with Image.open(path) as picture:
            picture.save(path, icc_profile=own)
    outcome = lippmann("interlace", *frames, "-d", "lkg-portrait", "-o", tmp_path / "lkg.png")
    assert profile(tmp_path / "lkg.png") is None
    assert "they are converted to sRGB" in outcome.err


def test_profile_is_embedded_and_the_display_is_in_the_file(lippmann, frames, tmp_path):
    data = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    for path in frames:
        with Image.open(path) as picture:
            picture.save(path, icc_profile=data)
    for name in ("print.tif", "print.png"):
        interlace(lippmann, frames, tmp_path / name, "--size", "30x20mm")
        with Image.open(tmp_path / name) as picture:
            assert picture.info["icc_profile"] == data
        values = lippmann("info", tmp_path / name, "--json").json
        assert values["display"]["viewing_distance"] == DISTANCE
    with tifffile.TiffFile(tmp_path / "print.tif") as file:
        assert not file.is_bigtiff


@pytest.mark.slow
def test_a_folder_a_display_and_what_is_said(lippmann, frames, tmp_path):
    result = lippmann("interlace", frames[0].parent, "-d", "lkg-portrait", "-o", tmp_path / "lkg.png", "--json")
    assert result.json["size"] == [1536, 2048]
    assert [path.rpartition("frame")[2] for path in result.json["photos"]] == ["2.png", "9.png", "10.png", "11.png"]
    assert "cover: 50 % of the width of the pictures is cut off" in result.err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--lpi", 20, "--ppi", 400), "--size: size is missing"),
        (("-d", "lkg-portrait", "--bleed", "3mm"), "--bleed: does not apply"),
        (("-d", "lkg-portrait", "--lenses", "across"), "--lenses: does not apply"),
        ((*SHEET, "--size", "30x20mm", "--shift", "3"), "--shift: '3'; must be a number with its unit"),
        ((*SHEET, "--size", "30x20mm", "--bleed=-1mm"), "--bleed: -1 mm is out of range"),
        ((*SHEET, "--size", "30x20mm", "--lenses", "across", "--marks", "8mm"), "--marks: marks are for upright"),
        ((*SHEET, "--size", "30x20mm", "--icc", "absent.icc"), "absent.icc: no such file"),
        (("-d", "lkg-portrait", "--marks", "8mm"), "--marks: does not apply"),
        (("-d", "lkg-portrait", "--mirror"), "--mirror: does not apply"),
        (("-d", "lkg-portrait", "--icc", "a.icc"), "--icc: does not apply"),
    ],
)
def test_errors_name_the_option(lippmann, frames, tmp_path, options, message):
    outcome = lippmann("interlace", *frames, *options, "-o", tmp_path / "print.tif")
    assert outcome.code == 2
    assert message in outcome.err
    assert not (tmp_path / "print.tif").exists()


def test_the_display_may_be_called_a_print(lippmann, frames, tmp_path):
    for number, options in enumerate(((), ("--display", "print"))):
        lippmann("interlace", *frames, *SHEET, "--size", "30x20mm", *options, "-o", tmp_path / f"{number}.png")
    assert (tmp_path / "0.png").read_bytes() == (tmp_path / "1.png").read_bytes()


def test_other_formats_are_refused(lippmann, frames, tmp_path):
    outcome = lippmann("interlace", *frames, *SHEET, "--size", "30x20mm", "-o", tmp_path / "print.exr")
    assert (outcome.code, "a print is a .png or .tif file" in outcome.err) == (2, True)


def test_outputs_are_named_after_the_input(lippmann, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "shots").mkdir()
    for number in range(2):
        Image.new("RGB", (256, 192), (90 * number, 20, 40)).save(tmp_path / "shots" / f"{number}.png")
    Image.new("RGB", (512, 256)).save(tmp_path / "a_qs2x1a1.png")
    for command, made in (
        (("interlace", "shots", *SHEET, "--size", "30x20mm"), "shots-native.tif"),
        (("interlace", "shots", "-d", MONITOR), "shots-native.png"),
        (("quilt", "unpack", "a_qs2x1a1.png"), "a_qs2x1a1-views"),
        (("quilt", "pack", "shots"), "shots_qs1x2a1.33333.png"),
    ):
        outcome = lippmann(*command)
        assert outcome.code == 0, outcome.err
        assert (tmp_path / made).exists()
    assert set(np.unique(np.asarray(Image.open("shots-native.tif"))[..., 0])) == {0, 90}  # a pair is not mixed
