"""``lippmann interlace``: every lens shows each eye its photograph, by the print's own geometry."""

from __future__ import annotations

import math

import numpy as np
import pytest
import tifffile
from PIL import Image, ImageCms

LPI, PPI, DISTANCE, FIELD, COUNT = 20.0, 400.0, 300.0, 50.0, 4
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


@pytest.mark.parametrize("name", ["print.tif", "print.png"])
@pytest.mark.parametrize("options", [(), ("--reverse",)])
def test_each_eye_sees_its_photograph_behind_every_lens(lippmann, frames, tmp_path, name, options):
    codes = interlace(lippmann, frames, tmp_path / name, "--size", "30x20mm", *options)
    assert codes.shape == (315, 472, 3)
    for number, level in enumerate(reversed(LEVELS) if options else LEVELS):
        assert (seen(codes, (number + 0.5) / COUNT) == level).all()


def test_lenses_across_show_the_first_photograph_from_above(lippmann, frames, tmp_path):
    codes = interlace(lippmann, frames, tmp_path / "flip.tif", "--size", "20x30mm", "--lenses", "across")
    assert codes.shape == (472, 315, 3)
    for number, level in enumerate(LEVELS):
        # Turned to the left, the print's top is on the left, and so is an eye above it.
        assert (seen(np.rot90(codes), (number + 0.5) / COUNT) == level).all()


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


def test_a_folder_a_display_and_what_is_said(lippmann, frames, tmp_path):
    result = lippmann("interlace", frames[0].parent, "-d", "lkg-portrait", "-o", tmp_path / "lkg.png", "--json")
    assert result.json["size"] == [1536, 2048]
    assert [path.rpartition("frame")[2] for path in result.json["photos"]] == ["2.png", "9.png", "10.png", "11.png"]
    assert "cover: 50% of the width of the pictures is cut off" in result.err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--lpi", 20, "--ppi", 400), "--size: size is missing"),
        (("-d", "lkg-portrait", "--bleed", "3mm"), "--bleed: does not apply"),
        (("-d", "lkg-portrait", "--lenses", "across"), "--lenses: does not apply"),
        ((*SHEET, "--size", "30x20mm", "--shift", "3"), "--shift: '3' will not do"),
        ((*SHEET, "--size", "30x20mm", "--bleed=-1mm"), "--bleed: -1 mm is out of range"),
    ],
)
def test_errors_name_the_option(lippmann, frames, tmp_path, options, message):
    outcome = lippmann("interlace", *frames, *options, "-o", tmp_path / "print.tif")
    assert outcome.code == 2
    assert message in outcome.err
    assert not (tmp_path / "print.tif").exists()


def test_other_formats_are_refused(lippmann, frames, tmp_path):
    outcome = lippmann("interlace", *frames, *SHEET, "--size", "30x20mm", "-o", tmp_path / "print.exr")
    assert (outcome.code, "a print is a .png or .tif file" in outcome.err) == (2, True)
