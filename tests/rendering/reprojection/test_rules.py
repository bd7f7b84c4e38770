"""What counts as alike, and which rules a display gets."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytestmark = pytest.mark.usefixtures("engine")

# The first call compiles.
COMPILING = settings(deadline=None)
HEIGHTS = st.floats(-1e4, 1e4).filter(lambda z: abs(z) > 1e-3)


@COMPILING
@given(HEIGHTS, HEIGHTS)
def test_the_nearer_point_is_the_higher_one(z, other):
    from lippmann.rendering.reprojection.rules import nearer

    assert nearer(7 / z, 7 / other) == (7 / z != 7 / other and z > other)


@COMPILING
@given(HEIGHTS)
def test_the_background_is_behind_all(z):
    from lippmann.rendering.reprojection.point_image import BACKGROUND
    from lippmann.rendering.reprojection.rules import nearer

    assert nearer(7 / z, BACKGROUND)
    assert not nearer(BACKGROUND, 7 / z)


def test_alike_is_a_part_of_the_larger():
    from lippmann.rendering.reprojection.rules import alike

    assert alike(1.0, 0.81, 0.2)
    assert not alike(1.0, 0.79, 0.2)
    assert not alike(0.1, -0.1, 0.2)


def test_colors_differ_by_their_largest_channel_as_they_are_coded():
    from lippmann.rendering.reprojection.rules import color_difference

    color = np.array([[[0.25, 0.5, 0.0], [0.25, 0.36, 0.01], [9.0, 0.5, -1.0]]], np.float32)
    assert color_difference(color, 0, 0, 0, 1, False) == pytest.approx(0.14)
    assert color_difference(color, 0, 0, 0, 1, True) == pytest.approx(np.sqrt(0.5) - 0.6)
    assert color_difference(color, 0, 0, 0, 2, False) == pytest.approx(0.75)  # codes end at 0 and 1


def test_care_tolerates_less_and_probes_more():
    from lippmann.rendering.reprojection.rules import choose_rules

    careful, quick = choose_rules(careful=True, coded=True), choose_rules(careful=False, coded=False)
    assert careful.careful
    assert careful.coded
    assert not quick.careful
    assert not quick.coded
    assert careful.tolerance < quick.tolerance
    assert careful.probe_rows < quick.probe_rows
