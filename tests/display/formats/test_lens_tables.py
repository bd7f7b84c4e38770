"""Tables [lens] and [pixel] of display files."""

from __future__ import annotations

import math

import pytest

from lippmann.display import Display, load_display
from lippmann.errors import DisplayError
from lippmann.optics.directions import distortion_of
from lippmann.optics.first_order import extreme_ray_field

SHEET = """
viewing_distance = "infinite"
[panel]
width = 400
height = 100
pixel_pitch = "720 ppi"
subpixel_offsets = "none"
[lens_array]
layout = "lenticular"
pitch = "60 lpi"
"""
MONITOR = """
[monitor]
width = 400
height = 100
pixel_pitch = "282.4 dpi"
pitch = 45.5
slope = -6.0
center = 0.37
viewing_distance = 600
"""


@pytest.fixture
def load(tmp_path):
    def loaded(text):
        path = tmp_path / "own.toml"
        path.write_text(text)
        return load_display(path)

    return loaded


def test_thickness_and_index_make_a_lens_at_best_focus(load):
    display = load(SHEET + '[lens]\nthickness = "26 mil"\nindex = 1.57')
    assert display.lens.radius == pytest.approx(0.2656, abs=1e-4)
    assert display.gap == pytest.approx(0.3825, abs=1e-4)
    assert Display.from_dict(display.to_dict()) == display


def test_a_stated_radius_and_conic_are_taken(load):
    display = load(SHEET + '[lens]\nthickness = "0.66 mm"\nradius = "240 um"\nconic = -0.4\ndiameter = 0.4')
    lens = display.lens
    assert (lens.radius, lens.conic, lens.thickness, lens.index) == pytest.approx((0.24, -0.4, 0.66, 1.57))
    assert lens.diameter == 0.4


def test_a_viewing_angle_makes_the_radius(load):
    display = load(SHEET + '[lens]\nthickness = "0.66 mm"\nfield = 54')
    assert extreme_ray_field(display.lens, display.lens_array.pitch) == pytest.approx(54)


def test_the_lens_of_a_monitor_makes_its_cone(load):
    display = load(MONITOR + "[lens]\nthickness = 1.5\nradius = 0.5")
    assert display.micro_image_pitch == pytest.approx(25.4 / 45.5)
    assert display.gap == pytest.approx(1.5 / 1.57, rel=0.03)
    assert display.lens.radius == 0.5
    pinhole = load(MONITOR)
    assert display.lens_array.slant == pinhole.lens_array.slant


def test_a_pixels_aperture_may_be_in_pixels(load):
    pixel = 25.4 / 282.4
    display = load(MONITOR + '[pixel]\nwidth = "0.3 px"\nblack_matrix = "5 um"\nblur = 0.002')
    assert display.pixel.width == pytest.approx(0.3 * pixel)
    assert display.pixel.black_matrix == pytest.approx(0.005)
    assert display.pixel.lit_size(display.panel) == pytest.approx((0.3 * pixel - 0.005, pixel - 0.005))
    sheet = load(SHEET + '[pixel]\nblur = "0.5 px"\n[lens]\nthickness = 0.66')
    assert sheet.pixel.blur == pytest.approx(0.5 * 25.4 / 720)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (SHEET, "the key 'gap' is missing"),
        (
            "gap = 0.4" + SHEET + "[lens]\nthickness = 0.66",
            "own.toml:1: gap and lens are both given",
        ),
        (SHEET + "[lens]\nindex = 1.5", "own.toml:11: the key 'thickness' is missing"),
        (SHEET + "[lens]\nthickness = 0.66\nradios = 1", "own.toml:13: unknown key 'radios', did you mean 'radius'?"),
        (SHEET + "[lens]\nthickness = 0.66\nradius = 0.2", "own.toml:13: radius is 0.2 mm; lenses 0.4233 mm wide need"),
        (SHEET + "[lens]\nthickness = 0.66\nindex = 1", "own.toml:13: index is 1; it must lie between 1.3 and 2"),
        (
            SHEET + "[lens]\nthickness = nan",
            "own.toml:12: thickness is nan; it must be a finite length above zero; sheets",
        ),
        (SHEET + '[lens]\nthickness = "26 px"', "unknown unit 'px'"),
        ("lens = 3" + SHEET, "own.toml:1: lens is 3; it must be a table of keys"),
        ("gap = 1" + SHEET + "[pixel]\nwidht = 1", "unknown key 'widht', did you mean 'width'?"),
        ("gap = 1" + SHEET + "[pixel]\nwidth = 1", "width is 1 mm; a pixel is 0.03528 mm wide"),
        ("pixel = true\ngap = 1" + SHEET, "pixel is True"),
        (MONITOR + "view_cone = 35\n[lens]\nthickness = 1.5", "view_cone and lens are both given"),
        (MONITOR + "[lens]\nthickness = 0.1", "thickness is 0.1 mm; the crest alone is"),
    ],
)
def test_nonsense_is_refused_in_one_line(load, text, said):
    with pytest.raises(DisplayError) as caught:
        load(text)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("layout", "value"), [("lenticular", "nan"), ("square", "-1"), ("hexagonal", "'thick'"), ("hexagonal", "inf")]
)
@pytest.mark.parametrize(
    ("table", "key"), [("lens", "thickness"), ("lens", "radius"), ("pixel", "width"), ("pixel", "blur")]
)
def test_lengths_that_are_none_are_refused_under_all_lenses(load, layout, value, table, key):
    tables = {"lens": {"thickness": 0.66}, "pixel": {}}
    tables[table][key] = value
    text = "".join(f"\n[{name}]\n" + "\n".join(f"{k} = {v}" for k, v in keys.items()) for name, keys in tables.items())
    with pytest.raises(DisplayError, match=rf"own.toml:\d+: .*(length|{key} is)"):
        load(SHEET.replace("lenticular", layout) + text)


def test_infinite_numbers_of_a_lens_are_refused(load):
    for key in ("thickness", "radius", "index", "conic", "diameter", "field"):
        values = {"thickness": 0.66, key: math.inf}
        lines = "\n".join(f"{name} = {value}" for name, value in values.items())
        with pytest.raises(DisplayError, match=key):
            load(f"{SHEET}[lens]\n{lines}")


def test_a_display_is_loaded_again_after_its_directions_were_inverted():
    display = load_display("print-60lpi")
    shared = distortion_of(display.lens, display.lens_array, display.gap)
    assert shared.inverse_factors[0] == pytest.approx(1.0 / shared.factors[0], rel=0.01)
    assert load_display("print-60lpi") == display
