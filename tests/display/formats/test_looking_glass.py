"""Calibrations of Looking Glass devices: the display agrees with the view numbers that the file prescribes."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from lippmann.display import NUMPY, Display, load_display
from lippmann.errors import DisplayError

from .published_calibrations import PUBLISHED, VENDOR_PITCH_AND_TILT

#: A portrait panel of the second generation.
PORTRAIT = {
    "configVersion": "1.0",
    "serial": "LKG-P00001",
    "pitch": {"value": 52.58},
    "slope": {"value": -7.145},
    "center": {"value": 0.42},
    "fringe": {"value": 0.0},
    "viewCone": {"value": 40.0},
    "invView": {"value": 1.0},
    "verticalAngle": {"value": 0.0},
    "DPI": {"value": 324.0},
    "screenW": {"value": 1536.0},
    "screenH": {"value": 2048.0},
    "flipImageX": {"value": 0.0},
    "flipImageY": {"value": 0.0},
    "flipSubp": {"value": 0.0},
}


def cell(*offsets):
    keys = ("ROffsetX", "ROffsetY", "GOffsetX", "GOffsetY", "BOffsetX", "BOffsetY")
    return dict(zip(keys, offsets, strict=True))


#: Four kinds of pixels; no number appears twice.
CELLS = [
    cell(-0.31, 0.26, 0.27, 0.21, 0.05, -0.25),
    cell(-0.29, -0.22, 0.33, -0.2, -0.04, 0.24),
    cell(-0.11, 0.17, 0.16, 0.12, 0.31, -0.13),
    cell(-0.18, -0.14, 0.19, -0.15, -0.34, 0.1),
]


def calibration(**changed):
    """The portrait panel with other values; numbers are wrapped, None leaves a key out."""
    values = dict(PORTRAIT)
    for key, value in changed.items():
        if value is None:
            del values[key]
        else:
            is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
            values[key] = {"value": value} if is_number else value
    return values


@pytest.fixture
def load(tmp_path):
    def loaded(values) -> Display:
        path = tmp_path / "visual.json"
        path.write_text(values if isinstance(values, str) else json.dumps(values))
        return load_display(path)

    return loaded


def prescribed_view(values, column, row, c):
    """View fraction by the formulas of the file, transcribed: x, y in [0, 1], y up, at pixel centres."""
    width, height = values["screenW"]["value"], values["screenH"]["value"]
    slope, flip = values["slope"]["value"], values["flipImageX"]["value"]
    pitch = values["pitch"]["value"] * (width / values["DPI"]["value"]) * math.cos(math.atan(1 / slope))
    tilt = height / (width * slope) * (-1 if flip else 1)
    sub = 1 / (3 * width) * (-1 if flip else 1)
    x, y = (column + 0.5) / width, (height - row - 0.5) / height
    index = 2 - c if values.get("flipSubp", {"value": 0})["value"] else c
    if values.get("subpixelCells"):
        py = int(height) - 1 - row
        mode = int(values["CellPatternMode"]["value"])
        number = [0, (column ^ py) & 1, column % 2, (py + 2 * (column % 2)) % 4, py % 2][mode]
        offsets = values["subpixelCells"][number]
        name = "RGB"[index]
        x, y = x + offsets[f"{name}OffsetX"] / width, y + offsets[f"{name}OffsetY"] / height
        phase = (x + y * tilt) * pitch - values["center"]["value"]
    else:
        phase = (x + index * sub + y * tilt) * pitch - values["center"]["value"]
    return 1 - phase % 1


def shown_view(display, column, row, c):
    """View fraction by the display's geometry: where at the viewing distance the sub-pixel's light arrives."""
    x, y = display.subpixel_point(np.array([column + 0.5]), np.array([row + 0.5]), c, NUMPY)
    (ox, oy, oz), (dx, dy, dz) = display.light_ray(x, y, NUMPY)
    t = (display.viewing_distance - oz) / dz
    across = display.lattice.across(ox + t * dx, oy + t * dy)
    half = display.viewing_distance * math.tan(math.radians(display.field_of_view / 2))
    return float(0.5 + 0.5 * across[0] / half)


VARIANTS = {
    "portrait": calibration(),
    "positive slope": calibration(slope=5.5, center=-3.7),
    "mirrored": calibration(flipImageX=1),
    "swapped": calibration(flipSubp=1),
    "mirrored and swapped": calibration(flipImageX=1, flipSubp=1, center=0.83),
    **{f"cells {mode}": calibration(subpixelCells=CELLS, CellPatternMode=mode) for mode in range(5)},
    "cells, odd height": calibration(subpixelCells=CELLS, CellPatternMode=3, screenH=2045),
    "cells, mirrored and swapped": calibration(subpixelCells=CELLS, CellPatternMode=1, flipImageX=1, flipSubp=1),
}


PUBLISHED_BY_NAME = {f"{number} {values['serial']}": values for number, values in enumerate(PUBLISHED)}


@pytest.mark.slow
@pytest.mark.parametrize(
    "values", [*VARIANTS.values(), *PUBLISHED], ids=[*VARIANTS.keys(), *(name for name in PUBLISHED_BY_NAME)]
)
def test_every_subpixel_shows_the_view_that_the_calibration_prescribes(values, load):
    display = load(values)
    rng = np.random.default_rng(7)
    width, height = display.panel.width, display.panel.height
    for column, row, c in zip(
        rng.integers(0, width, 200).tolist(),
        rng.integers(0, height, 200).tolist(),
        rng.integers(0, 3, 200).tolist(),
        strict=True,
    ):
        difference = shown_view(display, column, row, c) - prescribed_view(values, column, row, c)
        # Views 0 and 1 are neighbours. A ten-thousandth of one of 48 views.
        assert abs(difference - round(difference)) < 2e-6, (column, row, c)


@pytest.mark.parametrize("serial", VENDOR_PITCH_AND_TILT)
def test_lenses_across_the_panel_are_those_of_the_vendor_s_own_software(serial, load):
    display = load(next(values for values in PUBLISHED if values["serial"] == serial))
    pitch, tilt = VENDOR_PITCH_AND_TILT[serial]
    width, height = display.size_mm
    slant = math.radians(display.lens_array.slant)
    assert width * math.cos(slant) / display.micro_image_pitch == pytest.approx(pitch, rel=1e-5)
    # The lenses move by so much of the width over the height; positive slants lean to the right.
    assert -height * math.tan(slant) / width == pytest.approx(tilt, rel=1e-5)


def test_panels_of_one_kind_with_and_without_invview_are_read_alike(load):
    values = next(dict(one) for one in PUBLISHED if one["serial"] == "LKG-J00133")
    assert values["invView"]["value"] == 0
    display = load(values)
    values["invView"] = {"value": 1.0}
    assert load(values) == display
    del values["invView"]
    assert load(values) == display
    values["configVersion"] = "1.0"
    with pytest.raises(DisplayError, match="invView is missing"):
        load(values)


def test_either_spelling_of_the_cells_pattern_is_read(load):
    values = calibration(subpixelCells=CELLS, CellPatternMode=3)
    display = load(values)
    values["cellPatternMode"] = values.pop("CellPatternMode")
    assert load(values) == display
    values["cellPatternMode"] = {"value": 7}
    with pytest.raises(DisplayError, match="cellPatternMode is 7"):
        load(values)


def test_what_the_file_does_not_say_is_the_documented_camera_s(load):
    display = load(calibration())
    assert display.name == "LKG-P00001"
    # From one flip to the next, moving sideways.
    sideways = display.micro_image_pitch / math.cos(math.radians(display.lens_array.slant)) / display.gap
    assert math.degrees(2 * math.atan(sideways / 2)) == pytest.approx(40)
    assert display.lens_array.slant == pytest.approx(math.degrees(math.atan(1 / 7.145)))
    assert math.degrees(2 * math.atan(display.size_mm[1] / 2 / display.viewing_distance)) == pytest.approx(14)
    assert 25.4 / display.micro_image_pitch == pytest.approx(52.58)
    assert display.panel.pixel_pitch == pytest.approx(25.4 / 324)
    assert 6.1 < display.pixels_per_lens[0] < 6.4


def test_a_plain_stripe_lies_where_it_lies(load):
    assert load(calibration()).panel.subpixel_offsets == ((-1 / 3, 0), (0, 0), (1 / 3, 0))
    assert load(calibration(flipSubp=1)).panel.subpixel_offsets == ((1 / 3, 0), (0, 0), (-1 / 3, 0))
    assert load(calibration(subpixelCells=[])).panel.subpixel_cells is None


def test_the_display_is_kept_in_full(load):
    display = load(calibration(subpixelCells=CELLS, CellPatternMode=3))
    assert Display.from_dict(json.loads(json.dumps(display.to_dict()))) == display
    assert display != load(calibration(subpixelCells=CELLS, CellPatternMode=1))
    assert "subpixel_cells" not in load(calibration()).to_dict()["panel"]


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"pitch": None}, r"\[pitch\]: pitch is missing"),
        ({"pitch": 0}, r"pitch is 0; it must lie between 1 and 1000"),
        ({"pitch": {"v": 3}}, r"it must be wrapped"),
        ({"pitch": [52.5]}, r"pitch is \[52\.5\]; it must be wrapped"),
        ({"pitch": {"value": "52"}}, r"\[pitch\]: pitch is '52'; it must be a finite number"),
        ({"pitch": math.nan}, r"pitch is nan"),
        ({"slope": 0}, r"slope is 0; it must be at least 0\.18"),
        ({"DPI": -324}, r"DPI is -324"),
        ({"viewCone": 0}, r"viewCone is 0"),
        ({"viewCone": 180}, r"viewCone is 180"),
        ({"center": None}, r"center is missing"),
        ({"center": math.inf}, r"center is inf"),
        ({"screenW": 0}, r"screenW is 0"),
        ({"screenH": 2047.5}, r"screenH is 2047\.5; it must be a whole number"),
        ({"screenW": 2}, r"a lens covers"),
        ({"invView": 0}, r"invView is 0"),
        ({"invView": None}, r"invView is missing"),
        ({"flipImageX": 2}, r"flipImageX is 2; it must be 0 or 1"),
        ({"flipImageY": 1}, r"flipImageY is 1"),
        ({"serial": ["P"]}, r"serial is \['P'\]"),
        ({"serial": "LKG-J00001"}, r"subpixelCells is missing"),
        ({"subpixelCells": {}, "CellPatternMode": 2}, r"it must be a list of cells"),
        ({"subpixelCells": [3], "CellPatternMode": 2}, r"\[subpixelCells\[0\]\]: a cell is 3"),
        ({"subpixelCells": [{}], "CellPatternMode": 2}, r"ROffsetX is missing"),
        ({"subpixelCells": [cell(*"abcdef")], "CellPatternMode": 2}, r"ROffsetX is 'a'"),
        ({"subpixelCells": [cell(9, 0, 0, 0, 0, 0)], "CellPatternMode": 2}, r"each number between -1 and 1"),
        ({"subpixelCells": CELLS}, r"CellPatternMode is missing"),
        ({"subpixelCells": CELLS, "CellPatternMode": 5}, r"CellPatternMode is 5; it must be 0, 1, 2, 3 or 4"),
    ],
)
def test_bad_values_are_refused_in_one_line(changed, said, load):
    with pytest.raises(DisplayError, match=said) as caught:
        load(calibration(**changed))
    assert "visual.json" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


def test_unwrapped_numbers_are_refused(load):
    values = dict(calibration(), pitch=52.58)
    with pytest.raises(DisplayError, match=r"pitch is 52\.58; it must be wrapped: \{\"value\": number\}"):
        load(values)


@pytest.mark.parametrize("text", ["{", '{"pitch": }', "{" * 5000])
def test_what_is_no_json_is_refused(text, load):
    with pytest.raises(DisplayError, match="not valid JSON"):
        load(text)


def test_a_missing_file_is_said(tmp_path):
    with pytest.raises(DisplayError, match="no such file"):
        load_display(tmp_path / "visual.json")
