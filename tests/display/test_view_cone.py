"""The cone of views, and what a narrower one would resolve."""

import math
from dataclasses import replace

import pytest

from lippmann.display import Display, LensArray, Panel
from lippmann.display.view_cone import FUSED_CONE, depth_gain_of_fused_cone, view_cone


def sheet(cone):
    """Upright lenses of 2 mm, whose gap gives a cone for an eye far away."""
    gap = 1.0 / math.tan(math.radians(cone) / 2.0)
    return Display("sheet", Panel(240, 160, 0.25), LensArray("lenticular", 2.0), gap, aperture_distance=15.0)


@pytest.mark.parametrize("cone", [20.0, 35.0, 50.0])
def test_the_cone_is_that_of_the_outermost_views(cone):
    assert view_cone(sheet(cone)) == pytest.approx(cone)
    assert view_cone(replace(sheet(cone), viewing_distance=500.0)) > cone  # micro-images grow towards a near eye


def test_a_narrower_cone_resolves_more():
    own, narrow = sheet(50.0), sheet(FUSED_CONE)
    assert depth_gain_of_fused_cone(own) == pytest.approx(narrow.resolvable_depth[0] / own.resolvable_depth[0])
    assert depth_gain_of_fused_cone(own) == pytest.approx(math.tan(math.radians(25)) / math.tan(math.radians(17.5)))
