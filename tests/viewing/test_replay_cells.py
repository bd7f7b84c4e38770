"""What an eye sees of panels whose pixels are of several kinds."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.display import NUMPY, Display, LensArray, Panel
from lippmann.image import IntegralImage
from lippmann.viewing.replay import lens_plane_points, replay, replay_points

NEAR = (((-0.31, 0.26), (0.27, 0.21), (0.05, -0.25)), ((-0.29, -0.22), (0.33, -0.2), (-0.04, 0.24)))
FAR_OUT = (((-0.9, 0.26), (0.27, 0.7), (0.05, -0.25)), ((-0.29, -0.22), (0.8, -0.2), (-0.04, 0.94)))


def sheet(cells):
    panel = Panel(40, 24, 0.1, subpixel_cells=cells)
    return Display("cells", panel, LensArray("lenticular", 0.62, slant=9.0), gap=1.0, viewing_distance=300.0)


@pytest.mark.parametrize("cells", [(NEAR,), ((NEAR[0],), (NEAR[1],)), (FAR_OUT,)], ids=["columns", "rows", "far"])
def test_the_nearest_subpixel_is_seen(cells):
    display = sheet(cells)
    values = np.random.default_rng(1).uniform(size=(24, 40, 3)).astype(np.float32)
    seen = replay_points(IntegralImage(values, display), (10, 5, 280), (33, 21), subpixels=True)
    column, row = np.meshgrid(np.arange(40), np.arange(24))
    for rows, x, y in lens_plane_points(display, 33, 21):
        panel_x, panel_y = display.visible_panel_point(10, 5, 280, x, y, NUMPY)
        for c in range(3):
            centers = display.subpixel_point(column + 0.5, row + 0.5, c, NUMPY)
            distance = np.hypot(panel_x[..., None, None] - centers[0], panel_y[..., None, None] - centers[1])
            found = distance.reshape(*x.shape, -1).argmin(axis=-1)
            u, v = display.pixel_coordinates(panel_x, panel_y)
            inner = (u > 2) & (u < 38) & (v > 2) & (v < 22)
            np.testing.assert_array_equal(seen[rows][..., c][inner], values[..., c].ravel()[found][inner])


def test_cells_all_alike_are_seen_as_a_plain_panel():
    values = np.random.default_rng(2).uniform(size=(24, 40, 3)).astype(np.float32)
    offsets = ((-0.31, 0.26), (0.27, 0.21), (0.05, -0.25))
    cells = sheet(((offsets, offsets), (offsets, offsets)))
    plain = Display("plain", Panel(40, 24, 0.1, offsets), cells.lens_array, gap=1.0, viewing_distance=300.0)
    for kind in ("nearest", "linear"):
        options = {"size": (33, 21), "subpixels": True, "filter": kind}
        here = replay(IntegralImage(values, cells), (10, 5, 280), **options)
        there = replay(IntegralImage(values, plain), (10, 5, 280), **options)
        np.testing.assert_allclose(here[2:-2, 2:-2], there[2:-2, 2:-2], atol=1e-6)
