"""Displays as files, and what is said of bad ones."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from lippmann.display import covers_whole_pixels, list_displays, load_display
from lippmann.errors import DisplayError

GOOD = """\
title = "A panel"
gap = "0.68 cm"
viewing_distance = "0.5 m"
aperture_distance = "0.25 in"

[panel]
width = 512
height = 256
pixel_pitch = "96 dpi"
subpixel_offsets = "bgr"

[lens_array]
layout = "lenticular"
pitch = "12 lpi"
slant = 5
offset = ["1 px", "500 um"]
"""


@pytest.fixture
def write(tmp_path):
    def written(text, name="own.toml"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return written


# ---- Presets ---------------------------------------------------------------------------------------------------------


def test_presets():
    names = [display.name for display in list_displays()]
    devices = [name for name in names if name.startswith("looking-glass-")]
    expected = ["mla-hexagonal", "mla-square", "panel-4k", "panel-8k", "print-60lpi", "seed-lenticular"]
    monitors = [display.name for display in list_displays() if display.stereo is not None]
    assert monitors == ["displayxr", "elf-sr", "lume-pad", "odyssey-3d", "spatiallabs"]
    assert names == sorted(expected + devices + monitors)
    assert len(devices) == 14
    assert [load_display(name) for name in names] == list_displays()
    assert all(display.title for display in list_displays())


def test_presets_are_what_they_say():
    square, hexagonal, print_ = map(load_display, ("mla-square", "mla-hexagonal", "print-60lpi"))
    assert square.pixels_per_lens == pytest.approx((15, 15))
    assert (square.lens_grid.columns, square.lens_grid.rows) == (34, 34)
    assert hexagonal.pixels_per_lens == pytest.approx((15, 13))
    for name, diagonal in (("panel-4k", 15.6), ("panel-8k", 32)):
        panel = load_display(name)
        assert math.hypot(*panel.size_mm) / 25.4 == pytest.approx(diagonal, rel=1e-3)
        assert 6.2 < panel.pixels_per_lens[0] < 6.4
        assert panel.field_of_view == pytest.approx(35, abs=0.1)
    assert print_.size_mm == pytest.approx((200, 150), abs=0.02)
    # Seen from 50 cm there are 60 D / (D + g) lenses per inch.
    assert 25.4 / print_.micro_image_pitch == pytest.approx(60 * 500 / (500 + print_.gap))
    # A crest at best focus is nearer to its pinhole than thickness / index, 0.42 mm.
    assert print_.gap == pytest.approx(0.3825, abs=1e-4)
    assert [display.name for display in list_displays() if display.lens is not None] == ["print-60lpi"]
    assert {d.name for d in list_displays() if covers_whole_pixels(d) and d.stereo is None} == {
        "mla-hexagonal",
        "mla-square",
        "seed-lenticular",
    }


@pytest.mark.parametrize("name", [d.name for d in list_displays() if d.name.startswith("looking-glass-")])
def test_presets_of_devices_are_nominal_and_say_so(name):
    display = load_display(name)
    assert "nominal calibration" in display.title
    assert 6.2 < display.pixels_per_lens[0] < 6.4
    assert display.field_of_view == pytest.approx(35, abs=0.1)
    assert math.degrees(2 * math.atan(display.size_mm[1] / 2 / display.viewing_distance)) == pytest.approx(14, abs=0.1)


# ---- Own files -------------------------------------------------------------------------------------------------------


def test_own_file_with_units(write):
    display = load_display(write(GOOD))
    assert display.name == "own"
    assert display.title == "A panel"
    assert display.gap == pytest.approx(6.8)
    assert display.viewing_distance == pytest.approx(500)
    assert display.aperture_distance == pytest.approx(6.35)
    assert display.panel.pixel_pitch == 25.4 / 96
    assert display.panel.subpixel_offsets == ((1 / 3, 0), (0, 0), (-1 / 3, 0))
    assert display.lens_array.pitch == 25.4 / 12
    assert display.lens_array.offset == pytest.approx((25.4 / 96, 0.5))


def test_the_documented_example_is_a_display(write):
    page = (Path(__file__).parents[3] / "docs" / "reference" / "displays.md").read_text(encoding="utf-8")
    example = page.split("```toml\n")[1].split("```")[0]
    assert load_display(write(example)).lens_array.offset == pytest.approx((1.5 * 25.4 / 282.4, 0))


def test_the_page_of_presets_says_their_field_and_depth():
    page = (Path(__file__).parents[3] / "docs" / "reference" / "displays.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([\w-]+)` \|.*?\| ([\d.]+) deg \| ±(\d+) mm \|", page, re.MULTILINE)
    shown = {name: (load_display(name).field_of_view, load_display(name).resolvable_depth[0]) for name, *_ in rows}
    assert len(shown) == 6
    assert {name: (f"{field:.1f}", f"{depth:.0f}") for name, (field, depth) in shown.items()} == {
        name: (field, depth) for name, field, depth in rows
    }


def test_numbers_are_millimetres_and_infinity_has_two_spellings(write):
    text = GOOD.replace('"0.68 cm"', "6.8").replace('"0.5 m"', '"infinite"')
    assert load_display(write(text)).gap == 6.8
    assert math.isinf(load_display(write(text)).viewing_distance)
    assert load_display(str(write(text.replace('"infinite"', "inf")))) == load_display(write(text))


def test_without_subpixels(write):
    display = load_display(write(GOOD.replace('"bgr"', '"none"')))
    assert display.panel.subpixel_offsets == ((0, 0),) * 3
    display = load_display(write(GOOD.replace('"bgr"', "[[0, 0.5], [0.25, -1], [0, 0]]")))
    assert display.panel.subpixel_offsets == ((0, 0.5), (0.25, -1), (0, 0))


@pytest.mark.parametrize(
    ("good", "bad", "line", "said"),
    [
        ('"0.68 cm"', "0", 2, "gap is 0; it must be a finite length above zero"),
        ('"0.68 cm"', "-1.5", 2, "gap is -1.5"),
        ('"0.68 cm"', "nan", 2, "gap is nan"),
        ('"0.68 cm"', '"6.8 parsec"', 2, "unknown unit 'parsec'"),
        ('"0.68 cm"', '"6.8 mmm"', 2, "did you mean 'mm'?"),
        ('"0.68 cm"', '"6.8 px"', 2, "unknown unit 'px'"),
        ('"0.68 cm"', '"six"', 2, "'six' is not a length"),
        ('"0.68 cm"', '"1e999 mm"', 2, "gap is inf"),
        ('"0.5 m"', '"infinit"', 3, "'infinit' is not a length"),
        ('"0.25 in"', '"2 m"', 4, "below the viewing distance"),
        ("512", "0", 7, "width is 0"),
        ("256", "-3", 8, "height is -3"),
        ("256", "2.5", 8, "height is 2.5"),
        ('"96 dpi"', '"0 dpi"', 9, "'0 dpi' is no length; dpi must be above zero"),
        (
            '"96 dpi"',
            '"96 lpi"',
            9,
            "unknown unit 'lpi', did you mean 'ppi' or 'dpi'?; known are um, µm, mm, cm, m, mil, in, inch, dpi, ppi",
        ),
        ('"bgr"', '"rgbw"', 10, "subpixel_offsets is 'rgbw'"),
        ('"lenticular"', '"lentil"', 13, "the layouts are lenticular, square, hexagonal"),
        ('"12 lpi"', '"-12 lpi"', 14, "'-12 lpi' is no length; lpi must be above zero"),
        ('"12 lpi"', '"600 px"', 14, "a lens covers 6"),
        ("slant", "slnat", 15, "unknown key 'slnat'"),
        ("slant = 5", "slant = 80", 15, "slant is 80"),
        ("slant = 5", "slant = '5 deg'", 15, "slant is '5 deg'"),
        ("slant = 5", "row_pitch = 2", 15, "only a hexagonal array"),
        ('["1 px", "500 um"]', '["1 px"]', 16, "two finite lengths"),
        ("[panel]", "[pannel]", 6, "did you mean 'panel'?"),
        ("[panel]", "[panel]\ngap = 1", 7, "unknown key 'gap'"),
        ("pixel_pitch", "pixel_pich", 9, "did you mean 'pixel_pitch'?"),
    ],
)
def test_bad_values_are_named_with_their_line(write, good, bad, line, said):
    path = write(GOOD.replace(good, bad, 1))
    with pytest.raises(DisplayError) as caught:
        load_display(path)
    message = str(caught.value)
    assert caught.value.where == f"{path}:{line}"
    assert said in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"", "the key 'panel' is missing"),
        (GOOD.replace("layout", "# layout").encode(), ":12: the key 'layout' is missing"),
        (b"gap = = 3", "not valid TOML"),
        (b"gap = " + b"1" * 5000, "not valid TOML"),
        (b"\x89PNG\xff\xfe", "not a text file"),
        (b"#" * 1_000_001, "too large"),
        (b"panel = 3\ngap = 1\nlens_array = 4", "must be a table"),
    ],
)
def test_broken_files(write, text, said):
    path = write(text)
    with pytest.raises(DisplayError) as caught:
        load_display(path)
    assert said in str(caught.value)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize("nothing", [None, 5, {}])
def test_values_that_are_no_display(nothing):
    with pytest.raises(DisplayError, match=f"^display: {nothing} is no display; it must be a name"):
        load_display(nothing)


def test_unreadable_places(tmp_path):
    with pytest.raises(DisplayError, match="no such file"):
        load_display(tmp_path / "absent.toml")
    with pytest.raises(DisplayError, match=r"is a folder, no file; .*; name a file in it$"):
        load_display(tmp_path)


@pytest.mark.parametrize(
    ("called", "name"),
    [
        ("Looking Glass Go", "looking-glass-go"),
        ("looking glass portrait", "looking-glass-portrait"),
        ("LKG Portrait", "looking-glass-portrait"),
        ("65 inch", "looking-glass-65"),
        ('27" landscape', "looking-glass-27-landscape"),
        ("32 inch portrait, third generation", "looking-glass-32-gen3-portrait"),
    ],
)
def test_devices_by_what_they_are_called(called, name):
    assert load_display(called).name == name


def test_a_name_of_several_devices_is_answered_by_theirs():
    known = "looking-glass-16-gen2, looking-glass-16-gen3-landscape, looking-glass-16-gen3-portrait"
    with pytest.raises(DisplayError, match=f"'16 inch' is the name of 3 displays; say which: {known}"):
        load_display("16 inch")


def test_unknown_names_get_near_ones():
    with pytest.raises(
        DisplayError, match=r"unknown display 'panel4k', did you mean 'panel-4k' .*; 'lippmann displays' lists"
    ):
        load_display("panel4k")
    with pytest.raises(DisplayError, match=r"a \.toml file, or a Looking Glass's visual\.json, is one, too$"):
        load_display("zzz")
