"""What an eye sees through real lenses: the weights of the light table, and nothing else."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from lippmann.display import NUMPY, load_display
from lippmann.display.lens_profile import LensProfile
from lippmann.display.pixel_aperture import PixelAperture
from lippmann.errors import DisplayError, UsageError
from lippmann.image import IntegralImage
from lippmann.optics.crosstalk import crosstalk
from lippmann.optics.lens import Lens
from lippmann.optics.light_table import light_table
from lippmann.viewing.optical_replay import replay_optics

PRINT = load_display("print:lpi=60,ppi=720,size=20x10mm,thickness=0.6604mm,index=1.57,blur=9um")
SLANTED = replace(
    load_display("panel-4k").resized(160, 90),
    lens=LensProfile(radius=1.9, thickness=4.6, index=1.57),
    # Of which a twelfth of a pixel is dark, so that the sum over dense points meets its edges.
    pixel=PixelAperture(black_matrix=load_display("panel-4k").panel.pixel_pitch / 12),
)
ROUND = replace(load_display("mla-square").resized(160, 128), lens=LensProfile(radius=2.3, thickness=6.0, index=1.5))


#: Whole pixels that shine: no dark gaps that an eye might see.
WHOLE = replace(ROUND, panel=replace(ROUND.panel, subpixel_offsets=((0.0, 0.0),) * 3))


def even(display):
    return IntegralImage(np.ones((display.panel.height, display.panel.width, 3), np.float32), display)


def noise(display):
    shape = display.panel.height, display.panel.width, 3
    return IntegralImage(np.random.default_rng(4).random(shape).astype(np.float32), display)


@pytest.mark.long_cases("round")
@pytest.mark.parametrize("display", [PRINT, WHOLE], ids=["print", "round"])
def test_an_even_panel_is_white_straight_ahead_and_darker_aside(display):
    ahead, aside = (replay_optics(even(display), (x, 0.0, 900.0), size=(40, 20)) for x in (0.0, 160.0))
    middle = ahead[8:12, 15:25]
    assert middle.mean() == pytest.approx(1.0, abs=5e-3)
    light = light_table(Lens.of(display), [0.0, 160.0 / 900.0], neighbours=2).light
    assert aside[8:12, 15:25].mean() == pytest.approx(light[1] / light[0], abs=5e-3)


def test_a_slanted_panel_is_white_on_average():
    seen = replay_optics(even(SLANTED), (0.0, 0.0, 600.0))
    assert seen[20:-20, 40:-40].mean() == pytest.approx(1.0, abs=0.01)


def test_what_other_strips_send_is_the_crosstalk():
    """A lit strip, the one over which a lens has its axis, seen from straight ahead."""
    panel = PRINT.panel
    pixels = np.zeros((panel.height, panel.width, 3), np.float32)
    pixels[:, panel.width // 2] = 1.0
    seen = replay_optics(IntegralImage(pixels, PRINT), (0.0, 0.0, 500.0), size=(panel.width, 20), pupil=0.0)
    assert PRINT.lattice.origin_x % PRINT.lattice.pitch == pytest.approx(0.0, abs=1e-9)
    assert 1.0 - seen[10].max() == pytest.approx(crosstalk(PRINT, 0.0), abs=0.01)


@pytest.mark.long_cases("round")
@pytest.mark.parametrize("display", [SLANTED, ROUND], ids=["slanted", "round"])
def test_light_is_gathered_from_the_places_of_the_light_table(display):
    """Against a sum over dense points of the panel, lit or dark, of which each lens shows an eye its share."""
    image, eye = noise(display), (37.0, -20.0, 420.0)
    size = display.panel.width, display.panel.height
    seen = replay_optics(image, eye, size=size, pupil=0.0)
    for row, column in ((30, 50), (45, 80), (50, 110)):
        expected = brute_force(image, eye, column + 0.5, row + 0.5)
        assert seen[row, column] == pytest.approx(expected, rel=0.06, abs=0.03)


def brute_force(image, eye, u, v, fine=24):
    """Light of the lens at a place of the panel's pixels, from points of the panel ``fine`` to a pixel each way."""
    display, panel = image.display, image.display.panel
    lens, lattice = Lens.of(display), display.lattice
    x, y = display.panel_point(np.float64(u), np.float64(v))
    center = lattice.center(*lattice.lens_at(x, y, NUMPY), x, y, NUMPY)
    right, up = ((e - c) / eye[2] for e, c in zip(eye[:2], center, strict=True))
    step = panel.pixel_pitch / fine
    columns = (np.arange(panel.width * fine) + 0.5) / fine
    rows = (np.arange(panel.height * fine) + 0.5) / fine
    if lens.is_cylinder:
        _, seen = display.pixel_coordinates(*display.visible_panel_point(*eye, x, y, NUMPY))
        pixel_rows = np.floor(rows)  # a row counts as a whole, by how much of it a pixel of the picture covers
        covered = np.clip(np.minimum(pixel_rows + 1, seen + 0.5) - np.maximum(pixel_rows, seen - 0.5), 0.0, 1.0)
        rows, covered = rows[covered > 0.0], covered[covered > 0.0] / fine
        right, up = lattice.across(right, up), lattice.along(right, up)
    table, ahead = (light_table(lens, slope, up, places_per_lens=192, neighbours=2) for slope in (right, 0.0))
    ahead = light_table(lens, 0.0, places_per_lens=192, neighbours=2).light[0]
    place_x, place_y = display.panel_point(*np.meshgrid(columns, rows))
    width = table.edges[1] - table.edges[0]
    if lens.is_cylinder:
        away = lattice.across(place_x, place_y) - lattice.across(*center)
        share = np.interp(away, table.places, table.shares[0], left=0, right=0) / width
        share *= step * math.cos(math.radians(display.lens_array.slant)) * covered[:, None]
    else:
        at = [
            np.rint((p - c - table.places[0]) / width).astype(int)
            for p, c in zip((place_x, place_y), center, strict=True)
        ]
        is_in = np.logical_and.reduce([(a >= 0) & (a < len(table.places)) for a in at])
        share = np.where(is_in, table.squares[0][np.where(is_in, at[1], 0), np.where(is_in, at[0], 0)], 0.0)
        share *= (step / width) ** 2
    wide, high = (display.pixel or PixelAperture()).lit_size(panel)
    total = []
    for channel in range(3):
        offset = panel.subpixel_offsets[channel]
        light = np.zeros(place_x.shape)
        for shift in (-1, 0, 1):  # a sub-pixel may reach over its pixel's border
            column = np.floor(columns).astype(int) + shift
            inside = (column >= 0) & (column < panel.width)
            lit_x = np.abs(columns - (column + 0.5 + offset[0])) * panel.pixel_pitch < 0.5 * wide
            line = np.floor(rows).astype(int)
            lit_y = np.abs(rows - (line + 0.5 + offset[1])) * panel.pixel_pitch < 0.5 * high
            values = image.pixels[line[:, None], np.where(inside, column, 0)[None], channel]
            light += values * (lit_x & inside)[None] * lit_y[:, None]
        brightness = panel.pixel_pitch**2 / (wide * high)
        total.append(float((share * light).sum()) * brightness / ahead)
    return total


def test_a_pupil_blurs_what_lies_off_the_lenses():
    image = noise(PRINT)
    sharp, wide = (replay_optics(image, (0.0, 0.0, 60.0), size=(60, 30), pupil=pupil) for pupil in (0.0, 12.0))
    assert wide[10:-10, 20:-20].std() < 0.8 * sharp[10:-10, 20:-20].std()


def test_bad_input():
    with pytest.raises(DisplayError, match="gives no lens"):
        replay_optics(even(load_display("seed-lenticular").resized(16, 8)))
    with pytest.raises(UsageError, match=r"pupil: .* 0 to 20 mm"):
        replay_optics(even(PRINT), pupil=-1.0)
    with pytest.raises(UsageError, match="in front of the lens plane"):
        replay_optics(even(PRINT), (0.0, 0.0, -5.0))
    with pytest.raises(UsageError, match="filter: given beside optics"):
        even(PRINT).replay(optics=True, filter="linear")


def test_the_call_of_a_picture_is_the_same():
    image = noise(PRINT)
    found = image.replay((0.0, 0.0, 300.0), size=(30, 15), optics=True)
    assert np.array_equal(found, replay_optics(image, (0.0, 0.0, 300.0), size=(30, 15)))
