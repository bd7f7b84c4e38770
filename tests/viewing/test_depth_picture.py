"""Depth that eyes can read: shades that keep the order of heights, and a legend."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel
from lippmann.image import IntegralImage
from lippmann.viewing.depth_picture import legend, shades_of_depth

DISPLAY = Display("test", Panel(80, 60, 0.5), LensArray("lenticular", 4.0), 3.0, "", 300.0)


def test_shades_keep_the_order_of_heights_and_black_is_nothing():
    depth = np.zeros((60, 80, 3), np.float32)
    depth[:, 20:40], depth[:, 40:60] = -12.5, 7.5
    shades, heights = shades_of_depth(IntegralImage(depth, DISPLAY))
    assert heights == (-12.5, 7.5)
    assert shades.pixels[0, [10, 30, 50], 0].tolist() == [0.0, pytest.approx(0.15), 1.0]
    assert shades.provenance.options["depth_shades"] == [-12.5, 7.5]
    assert shades.srgb()[0, 50].tolist() == [255, 255, 255]
    beside = legend(shades, heights)
    assert beside.shape[2] == 3
    bar = beside[:, shades.replay().shape[1] + 12, 0]
    assert bar.max() == pytest.approx(1, abs=0.01)
    assert (np.diff(bar[bar > 0]) <= 1e-6).all()  # nearest on top


def test_nothing_seen_and_one_height():
    empty = IntegralImage(np.zeros((60, 80, 3), np.float32), DISPLAY)
    assert shades_of_depth(empty) == (empty, (0.0, 0.0))
    flat = IntegralImage(np.full((60, 80, 3), 4.0, np.float32), DISPLAY)
    assert (shades_of_depth(flat)[0].pixels == 1).all()
