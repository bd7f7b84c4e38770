"""Light tables: compiled and readable ones agree, light is neither made nor lost, and what is bad input."""

from __future__ import annotations

import numpy as np
import pytest
from readable_twins import readable_light_table

from lippmann.display import load_display
from lippmann.display.lens_array import LensArray
from lippmann.display.lens_profile import LensProfile
from lippmann.errors import DisplayError
from lippmann.optics.lens import Lens
from lippmann.optics.light_table import light_table
from lippmann.optics.trace import trace

PITCH = 0.5
SLOPES = np.tan(np.radians(np.array([-75.0, -40.0, -10.0, 0.0, 5.0, 30.0, 60.0])))
CYLINDERS = {
    "circle": Lens(LensProfile(0.27, 0.65, 1.57), LensArray("lenticular", PITCH)),
    "ellipse": Lens(LensProfile(0.32, 0.8, 1.5, conic=-0.44), LensArray("lenticular", PITCH)),
    "gaps": Lens(LensProfile(0.3, 0.75, 1.57, diameter=0.4), LensArray("lenticular", PITCH)),
}
MICRO_LENSES = {
    "square": Lens(LensProfile(0.4, 1.0, 1.57), LensArray("square", PITCH)),
    "hexagonal": Lens(LensProfile(0.4, 1.0, 1.57, diameter=0.45), LensArray("hexagonal", PITCH)),
}


@pytest.mark.parametrize("along", [0.0, 0.6])
@pytest.mark.parametrize("lens", CYLINDERS.values(), ids=CYLINDERS)
def test_both_tables_of_a_cylinder_are_one(lens, along):
    fast, readable = (make(lens, SLOPES, along) for make in (light_table, readable_light_table))
    np.testing.assert_allclose(fast.shares, readable.shares, rtol=0, atol=1e-10)
    assert np.array_equal(fast.edges, readable.edges)


@pytest.mark.parametrize("lens", MICRO_LENSES.values(), ids=MICRO_LENSES)
def test_both_tables_of_a_micro_lens_are_one(lens):
    fast, readable = (make(lens, SLOPES[2:4], 0.3, places_per_lens=24) for make in (light_table, readable_light_table))
    np.testing.assert_allclose(fast.squares, readable.squares, rtol=0, atol=1e-12)
    assert fast.shares == pytest.approx(fast.squares.sum(axis=1))


@pytest.mark.parametrize("lens", [*CYLINDERS.values(), *MICRO_LENSES.values()], ids=[*CYLINDERS, *MICRO_LENSES])
def test_all_light_that_passes_comes_from_somewhere(lens):
    """Light in is light out and Fresnel's loss: over places enough, a row holds the mean transmission."""
    slopes = np.array([0.0, 0.2, 0.35])
    table = light_table(lens, slopes, neighbours=3)
    nodes = 513
    x = np.linspace(-0.5, 0.5, nodes) * PITCH if lens.is_cylinder else None
    for light, slope in zip(table.light, slopes, strict=True):
        if lens.is_cylinder:
            rays = trace(lens, x, x * 0, slope)
            weights = np.full(nodes, 1.0)
            weights[[0, -1]] = 0.5
        else:
            rays = trace(lens, *lens.samples(96), slope)
            weights = None
        assert light == pytest.approx(np.average(rays.area * rays.transmission, weights=weights), abs=1e-6)
        # Both flanks of a crest together are lit as a flat sheet is.
        assert np.average(rays.area, weights=weights) == pytest.approx(1.0, abs=1e-6)


def test_left_and_right_are_alike():
    table = light_table(CYLINDERS["circle"], [-0.4, 0.4])
    assert table.shares[0] == pytest.approx(table.shares[1][::-1], abs=1e-9)
    assert table.mean_places[0] > 0 > table.mean_places[1]  # an eye on the left sees places on the right


def test_a_paraxial_lens_is_a_pinhole_at_thickness_over_index():
    """A narrow crest with its focus on the panel: light of a direction comes from the place behind its chief ray."""
    thickness, index = 1.0, 1.5
    lens = Lens(LensProfile(thickness * (index - 1) / index, thickness, index), LensArray("lenticular", 0.02))
    table = light_table(lens, [0.0, 0.01], neighbours=2)
    assert table.mean_places[1] == pytest.approx(-0.01 * thickness / index, abs=0.02 / 96)
    assert table.widths()[0] < 0.02 / 24


def test_a_wide_table_has_the_neighbours():
    thick = Lens(LensProfile(0.6, 2.0, 1.57), LensArray("lenticular", PITCH))
    near, far = (light_table(thick, [0.9], neighbours=count) for count in (1, 4))
    assert near.light[0] < 0.3 < 0.9 < far.light[0] < 0.96


def test_a_display_without_a_lens_is_named():
    with pytest.raises(DisplayError, match="seed-lenticular: gives no lens; its gap stands for a pinhole"):
        Lens.of(load_display("seed-lenticular"))
    assert Lens.of(load_display("print-60lpi")).profile.thickness == pytest.approx(0.6604)
