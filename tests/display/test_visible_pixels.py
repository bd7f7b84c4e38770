"""Which pixels of a panel an eye sees."""

from __future__ import annotations

import pytest

from lippmann.display import load_display
from lippmann.display.visible_pixels import EyeMap


@pytest.mark.parametrize("name", ["displayxr", "odyssey-3d", "lume-pad"])
@pytest.mark.parametrize("side", [-1, 1])
def test_each_eye_of_a_tracked_monitor_sees_a_whole_picture_of_its_own(name, side):
    """No column past the panel is seen as black, and columns at its edges are the same eye's as all others."""
    display = load_display(name)
    eye = (side * 0.5 * display.stereo.eyes, 0.0, display.viewing_distance)
    seen = EyeMap(display, display.panel.size_inside(512, 512), subpixels=False).pixels_for_eye(eye)
    assert (seen.number >= 0).all()
    assert set(seen.column % 2) == {0 if side > 0 else 1}
