"""Native pictures from views: which view each sub-pixel takes, from where in it, and what an eye then sees."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import lippmann.quilts.weave as weave_module
from lippmann.display import NUMPY, Display, LensArray, Panel, load_display
from lippmann.errors import DisplayError, PictureError, UsageError
from lippmann.quilts.quilt import Quilt, QuiltLayout
from lippmann.quilts.weave import weave, weave_to_file
from lippmann.viewing.replay import replay

WIDTH, HEIGHT, DPI, PITCH, SLOPE, CENTER = 90, 70, 300.0, 48.3, -6.4, 0.37
CELLS = [
    {"ROffsetX": -0.3, "ROffsetY": 0.25, "GOffsetX": 0.3, "GOffsetY": 0.2, "BOffsetX": 0.0, "BOffsetY": -0.25},
    {"ROffsetX": 0.3, "ROffsetY": -0.2, "GOffsetX": -0.3, "GOffsetY": -0.25, "BOffsetX": 0.05, "BOffsetY": 0.2},
]


@pytest.fixture(params=["plain", "cells"])
def calibrated(request, tmp_path):
    numbers = {"pitch": PITCH, "slope": SLOPE, "center": CENTER, "viewCone": 40.0, "invView": 1, "DPI": DPI}
    numbers |= {"screenW": WIDTH, "screenH": HEIGHT, "CellPatternMode": 2}
    values = {key: {"value": value} for key, value in numbers.items()}
    if request.param == "cells":
        values["subpixelCells"] = CELLS
    path = tmp_path / "visual.json"
    path.write_text(json.dumps(values))
    return load_display(path), request.param == "cells"


def prescribed_fractions(has_cells):
    """``(HEIGHT, WIDTH, 3)`` view fractions by the calibration's own formulas."""
    lenses = PITCH * (WIDTH / DPI) * math.cos(math.atan(1 / SLOPE))
    tilt = HEIGHT / (WIDTH * SLOPE)
    column, row, c = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT), np.arange(3))
    x, y = (column + 0.5) / WIDTH, (HEIGHT - row - 0.5) / HEIGHT
    if has_cells:
        right = np.array([[cell[f"{name}OffsetX"] for name in "RGB"] for cell in CELLS])[column % 2, c]
        up = np.array([[cell[f"{name}OffsetY"] for name in "RGB"] for cell in CELLS])[column % 2, c]
        x, y = x + right / WIDTH, y + up / HEIGHT
    else:
        x = x + c / (3 * WIDTH)
    return 1 - ((x + y * tilt) * lenses - CENTER) % 1


def solid(levels, columns, rows):
    """A quilt whose view k is all ``levels[k]``, in every colour."""
    quilt = Quilt(np.empty((rows * 12, columns * 10, 3), dtype=np.float32), QuiltLayout(columns, rows, None))
    for number, level in enumerate(levels):
        quilt.view(number)[...] = level
    return quilt


def test_solid_views_are_shown_by_exactly_their_subpixels(calibrated):
    display, has_cells = calibrated
    fractions = prescribed_fractions(has_cells)
    woven = weave(solid(np.arange(24.0), 6, 4), display, choice="nearest")
    wanted = np.floor(fractions * 24)
    # Where a fraction is next to a step rounding decides.
    clear = np.abs(fractions * 24 - np.round(fractions * 24)) > 1e-6
    assert clear.mean() > 0.99
    np.testing.assert_array_equal(woven.pixels[clear], wanted[clear])
    assert set(np.unique(woven.pixels)) == set(range(24))


def test_linear_choice_mixes_the_two_next_views(calibrated):
    display, has_cells = calibrated
    woven = weave(solid(np.arange(24.0), 6, 4), display)
    wanted = np.clip(prescribed_fractions(has_cells) * 24 - 0.5, 0, 23)
    apart = np.abs(woven.pixels - wanted)
    assert apart[wanted % 23 > 0].max() < 1e-4


SHEETS = [
    Display("slanted", Panel(96, 60, 0.1), LensArray("lenticular", 0.62, slant=9.46), 0.9, viewing_distance=300.0),
    Display("straight", Panel(96, 60, 0.1), LensArray("lenticular", 0.8), 0.9, viewing_distance=300.0),
]


def eye_at(display, fraction):
    """The place at the viewing distance from where that part of the cone is seen, on the line across the lenses."""
    half = display.viewing_distance * math.tan(math.radians(display.field_of_view / 2))
    x, y = display.lattice.from_axes((2 * fraction - 1) * half, 0.0)
    return x, y, display.viewing_distance


@pytest.mark.parametrize("display", SHEETS, ids=lambda display: display.name)
def test_an_eye_in_the_middle_of_a_view_sees_that_view_alone(display):
    levels = [0.1, 0.4, 0.6, 0.9]
    image = weave(solid(levels, 2, 2), display, choice="nearest")
    for number, level in enumerate(levels):
        seen = replay(image, eye_at(display, (number + 0.5) / 4), size=(96, 60))
        np.testing.assert_array_equal(seen[3:-3, 9:-9], np.float32(level))


def pattern(x, y):
    """Smooth colours of a plane, alike in no direction."""
    return np.stack([0.5 + 0.4 * np.sin(1.1 * x + 0.4 * y), 0.5 + 0.4 * np.sin(0.9 * y), 0.5 + 0.03 * (x - y)], axis=-1)


@pytest.mark.parametrize("depth", [-9.0, 0.0, 6.0])
@pytest.mark.parametrize("display", SHEETS, ids=lambda display: display.name)
def test_many_views_show_what_the_display_s_own_rays_see(display, depth):
    count, size = 64, (192, 120)
    width, height = display.size_mm
    x, y = np.meshgrid((np.arange(size[0]) + 0.5) / size[0] - 0.5, 0.5 - (np.arange(size[1]) + 0.5) / size[1])
    x, y = x * width, y * height
    quilt = Quilt(np.empty((size[1], size[0] * count, 3), dtype=np.float32), QuiltLayout(count, 1, None))
    for number in range(count):
        eye = eye_at(display, (number + 0.5) / count)
        t = 1 - depth / eye[2]
        quilt.view(number)[...] = pattern(eye[0] + (x - eye[0]) * t, eye[1] + (y - eye[1]) * t)
    woven = weave(quilt, display).pixels
    u, v = np.meshgrid(np.arange(96) + 0.5, np.arange(60) + 0.5)
    for c in range(3):
        (ox, oy, oz), (dx, dy, dz) = display.light_ray(*display.subpixel_point(u, v, c, NUMPY), NUMPY)
        t = (depth - oz) / dz
        wanted = pattern(ox + t * dx, oy + t * dy)[..., c]
        # Beyond the outermost cameras, on the last half of a view's part of the cone, their pictures are all there is.
        np.testing.assert_allclose(woven[1:-1, 4:-4, c], wanted[1:-1, 4:-4], atol=0.02)
        assert np.abs(woven[1:-1, 4:-4, c] - wanted[1:-1, 4:-4]).mean() < 0.001


def test_neighbouring_tiles_do_not_leak_in():
    display = SHEETS[1]
    quilt = solid([0.0] * 9, 3, 3)
    quilt.view(4)[...] = 1.0
    assert set(np.unique(weave(quilt, display, choice="nearest").pixels)) == {0.0, 1.0}


@pytest.mark.parametrize("offsets", ["none", "rgb-stripe"])
@pytest.mark.parametrize("slant", [0.0, 7.0])
@pytest.mark.parametrize("distance", [math.inf, 300.0])
def test_what_holds_for_all_rows_or_channels_is_found_once(offsets, slant, distance):
    panel = Panel(61, 40, 0.25) if offsets == "rgb-stripe" else Panel(61, 40, 0.25, ((0.0, 0.0),) * 3)
    lenses = LensArray("lenticular", 1.3, slant=slant)
    display = Display("d", panel, lenses, gap=6.8, viewing_distance=distance, aperture_distance=5.0)
    quilt = solid(np.linspace(0, 1, 6), 3, 2)
    u, v = np.meshgrid(np.arange(61) + 0.5, np.arange(9, 20) + 0.5)
    for channel, found in enumerate(weave_module._samples_of_window(quilt, display, "linear", (9, 20), (0, 61))):
        expected = weave_module._samples_at(quilt, display, "linear", channel, u, v)
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_array_equal(np.broadcast_to(one, u.shape), other)


def test_the_picture_says_what_it_is(tmp_path):
    image = weave(solid([0.2, 0.7], 2, 1), SHEETS[0], scene="pair")
    assert image.display == SHEETS[0]
    made = image.provenance
    assert (made.method, made.scene, made.subpixels) == ("weave", "pair", True)
    assert made.options == {"views": 2, "view_choice": "nearest", "direction": "even in the tangent"}
    assert set(np.unique(image.pixels)) == set(np.float32([0.2, 0.7]))  # no eye sees a pair double


def test_blocks_of_rows_change_nothing(monkeypatch):
    quilt = solid(np.linspace(0, 1, 6), 3, 2)
    whole = weave(quilt, SHEETS[0]).pixels
    monkeypatch.setattr("lippmann.quilts.weave._BLOCK", 7 * 96)
    steps = []
    np.testing.assert_array_equal(weave(quilt, SHEETS[0], progress=steps.append).pixels, whole)
    assert [step.done for step in steps] == [7, 14, 21, 28, 35, 42, 49, 56, 60]
    # The quilt has 720 pixels for 60 rows of the panel: 24 for two.
    monkeypatch.setattr("lippmann.quilts.weave._VIEW_BLOCK", 24)
    steps.clear()
    np.testing.assert_array_equal(weave(quilt, SHEETS[0], progress=steps.append).pixels, whole)
    assert [step.done for step in steps] == list(range(2, 61, 2))


def test_what_cannot_be_woven_is_refused():
    quilt = solid([0, 1], 2, 1)
    with pytest.raises(PictureError, match="has square lenses"):
        weave(quilt, Display("mla", Panel(20, 20, 0.1), LensArray("square", 0.5), 1.0))
    with pytest.raises(UsageError, match="unknown choice of views 'cubic'; known are nearest, linear"):
        weave(quilt, SHEETS[0], choice="cubic")
    with pytest.raises(DisplayError, match="elf-sr takes no native pixels"):
        weave(quilt, load_display("elf-sr"))
    other = Quilt(quilt.pixels, QuiltLayout(2, 1, 0.75))
    with pytest.raises(PictureError, match=r"the aspect 0\.75; the display straight has 1\.6"):
        weave(other, SHEETS[1])
    weave(Quilt(quilt.pixels, QuiltLayout(2, 1, 1.61)), SHEETS[1])


def test_a_file_woven_in_bands_holds_the_same(calibrated, tmp_path, monkeypatch):
    from lippmann.codecs import tiff
    from lippmann.image import read_picture

    monkeypatch.setattr(tiff, "TILE", 16)
    display, _ = calibrated
    quilt = solid(np.linspace(0, 1, 6), 3, 2)
    weave_to_file(quilt, display, tmp_path / "a.tif", bits=32, scene="x")
    written, whole = read_picture(tmp_path / "a.tif"), weave(quilt, display, scene="x")
    assert np.array_equal(written.pixels, whole.pixels)
    assert (written.provenance, written.display) == (whole.provenance, whole.display)
    with pytest.raises(UsageError, match="unknown choice of views 'best'"):
        weave_to_file(quilt, display, tmp_path / "b.tif", choice="best")


def test_views_are_woven_for_the_lens_that_is_there():
    sheet = load_display("print:lpi=60,ppi=720,size=20x4mm,thickness=26mil,radius=0.2877mm")
    rng = np.random.default_rng(3)
    pixels = np.repeat(rng.random((16, 1, 24)), 4, axis=1)[..., None].repeat(3, axis=3).astype(np.float32)
    quilt = Quilt(np.concatenate([np.concatenate(pixels[k : k + 8], axis=1) for k in (8, 0)]), QuiltLayout(8, 2, 5.0))
    plain, corrected = (weave(quilt, sheet, correct=correct) for correct in ("none", "lens"))
    assert plain.provenance.notes == ()
    assert "correct" not in plain.provenance.options
    options = corrected.provenance.options
    assert options["correct"] == "lens"
    assert options["correction_gain_exact"] > 0.3
    assert "dB in the directions solved for" in corrected.provenance.notes[0]
    assert 0.005 < np.abs(plain.pixels - corrected.pixels).mean() < 0.1
    with pytest.raises(DisplayError, match="gives no lens"):
        weave(solid([0, 1], 2, 1), SHEETS[0], correct="lens")


def test_the_views_reach_from_edge_to_edge_of_a_real_lens():
    """Behind a real lens the outermost views are less far apart than behind a pinhole at the gap."""
    display = load_display("print:lpi=60,ppi=720,size=40x10mm,thickness=26mil")
    assert display.edge_factor < 0.98
    axis = (display.lattice.origin_x + 12 * display.lattice.pitch) * display.magnification
    x = axis + np.array([-0.49999, 0.0, 0.49999]) * display.micro_image_pitch
    assert weave_module.view_fraction(display, x, np.zeros(3)) == pytest.approx([1, 0.5, 0], abs=1e-4)


def test_views_sampled_a_pixel_beside_are_those_of_the_next_pixel():
    display = load_display("seed-lenticular").resized(24, 8)
    quilt = Quilt(np.random.default_rng(3).random((20, 90, 3), np.float32), QuiltLayout(3, 1, None))
    here, beside = (weave_module.weave_window(quilt, display, "linear", (0, 8), None, by) for by in (0.0, 1.0))
    np.testing.assert_allclose(beside[:, :-1], here[:, 1:], atol=1e-6)
    assert not np.allclose(beside, here, atol=0.01)
