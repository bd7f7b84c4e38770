"""Light through real lenses: the pixels that an eye sees under each lens."""

from __future__ import annotations

import numpy as np
import pytest
from eyes import lenses_seen_by

from lippmann.display import load_display
from lippmann.errors import DisplayError
from lippmann.optics.lens import Lens
from lippmann.optics.light_table import light_table
from lippmann.optics.pixel_shares import pixel_shares

SHEET = load_display("print:lpi=60,ppi=720,size=40x10mm,thickness=26mil")
LENSES = np.arange(8.0, SHEET.lens_grid.columns - 8)


def test_a_bright_panel_is_seen_bright_from_everywhere():
    rows = np.ones((2, SHEET.panel.width))
    for eye in ((0.0, 0.0, 500.0), (180.0, 0.0, 400.0), (-900.0, 0.0, 300.0)):
        np.testing.assert_allclose(lenses_seen_by(SHEET, eye, LENSES).gather(rows), 1.0, atol=1e-12)


def test_shares_are_those_of_the_light_table_in_the_pixels_width():
    """By another way: a table of fine places, summed up over each pixel."""
    slope, pixel = 0.21, SHEET.panel.pixel_pitch
    table = light_table(Lens.of(SHEET), slope, places_per_lens=1920, neighbours=2)
    sums = np.concatenate([[0.0], np.cumsum(table.shares[0])])
    shares = pixel_shares(SHEET, LENSES[:5], np.full(5, slope))
    for n, lens in enumerate(LENSES[:5]):
        axis = SHEET.lattice.origin_x + lens * SHEET.lattice.pitch
        left = (shares.first[n] + np.arange(shares.shares.shape[1] + 1) - 0.5 * SHEET.panel.width) * pixel - axis
        expected = np.diff(np.interp(left, table.edges, sums)) / sums[-1]
        np.testing.assert_allclose(shares.shares[n], expected, atol=0.01)


def test_a_lens_shows_the_pixel_of_its_direction():
    place = np.full(len(LENSES), 2.0) * SHEET.panel.pixel_pitch
    seen = pixel_shares(SHEET, LENSES, -SHEET.pinhole_place(place) / SHEET.gap).gather(
        np.arange(SHEET.panel.width, dtype=float)[None]
    )
    axis = SHEET.lattice.origin_x + LENSES * SHEET.lattice.pitch
    expected = (axis + place) / SHEET.panel.pixel_pitch + 0.5 * SHEET.panel.width - 0.5
    np.testing.assert_allclose(seen[0], expected, atol=0.35)


def test_a_sub_pixel_to_the_right_is_seen_that_much_sooner():
    columns = np.arange(SHEET.panel.width, dtype=float)[None]
    slopes = np.full(len(LENSES), 0.1)
    middle, third, whole = (pixel_shares(SHEET, LENSES, slopes, offset) for offset in (0.0, 1 / 3, 1.0))
    np.testing.assert_array_equal(whole.first, middle.first - 1)
    np.testing.assert_allclose(whole.shares, middle.shares, atol=1e-9)
    np.testing.assert_allclose(middle.gather(columns) - third.gather(columns), 1 / 3, atol=0.1)


@pytest.mark.parametrize("name", ["seed-lenticular", "mla-square"])
def test_displays_without_such_a_lens_are_named(name):
    with pytest.raises(DisplayError, match="gives no lens"):
        pixel_shares(load_display(name), np.zeros(1), np.zeros(1))
