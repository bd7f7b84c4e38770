"""Which pixels of a panel an eye sees."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel, load_display
from lippmann.display.visible_pixels import EyeMap
from lippmann.image import IntegralImage
from lippmann.viewing.replay import replay


@pytest.mark.parametrize("name", ["displayxr", "odyssey-3d", "lume-pad"])
@pytest.mark.parametrize("side", [-1, 1])
def test_each_eye_of_a_tracked_monitor_sees_a_whole_picture_of_its_own(name, side):
    """No column past the panel is seen as black, and columns at its edges are the same eye's as all others."""
    display = load_display(name)
    eye = (side * 0.5 * display.stereo.eyes, 0.0, display.viewing_distance)
    seen = EyeMap(display, display.panel.size_inside(512, 512), subpixels=False).pixels_for_eye(eye)
    assert (seen.number >= 0).all()
    assert set(seen.column % 2) == {0 if side > 0 else 1}


@pytest.mark.parametrize("eye", [(0.0, 0.0, 200.0), (-60.0, 30.0, 150.0)])
def test_with_pixels_of_several_kinds_it_is_what_replay_shows_to_the_panel_s_edge(eye):
    cells = np.random.default_rng(1).uniform(-0.4, 0.4, (2, 2, 3, 2))
    display = Display("d", Panel(40, 30, 0.1, subpixel_cells=cells.tolist()), LensArray("lenticular", 0.7, 9.0), 1.0)
    image = IntegralImage(np.random.default_rng(2).random((30, 40, 3), np.float32), display)
    seen = EyeMap(display, (40, 30), subpixels=True).pixels_for_eye(eye)
    replayed = replay(image, eye, subpixels=True)
    assert (replayed == 0.0).any()
    np.testing.assert_array_equal(seen.arrange(image.pixels[seen.row, seen.column]), replayed)
