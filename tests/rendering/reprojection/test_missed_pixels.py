"""Where reuse need not be careful, a few pixels of each run of missed ones are traced, and the others bridge them."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")

#: Lenses of a row of pixels: two micro-images of 9 and 3 pixels.
LENS = np.repeat([0, 1], [9, 3])


def thinned(row, known=()):
    """A picture whose given row holds wanted pixels, thinned out; ``known`` ones have been traced."""
    from lippmann.rendering.reprojection.missed_pixels import thin_out
    from lippmann.rendering.reprojection.point_image import QUEUED, TRACED, PointImage
    from lippmann.rendering.reprojection.rules import choose_rules

    points = PointImage.empty(row + 1, len(LENS))
    points.status[row] = QUEUED
    points.status[row, list(known)] = TRACED
    lens = np.tile(LENS, (len(points.status), 1))
    thin_out(row, row + 1, points, lens, choose_rules(careful=False, coded=False))
    return points, lens


def wanted(row, known=()):
    from lippmann.rendering.reprojection.point_image import QUEUED

    return np.flatnonzero(thinned(row, known)[0].status[row] == QUEUED).tolist()


def test_the_first_pixel_of_each_run_and_one_in_four_are_traced():
    assert wanted(0) == [0, 4, 8, 9]
    assert wanted(1) == [0, 3, 7, 9]
    assert wanted(0, known=[5, 10]) == [0, 4, 6, 9, 11]


@pytest.mark.parametrize(("far", "expected"), [(0.5, [0.25, 0.5, 0.75]), (0.05, [0.0, 0.0, 1.0])])
def test_the_others_are_blended_on_one_surface_and_copied_between_two(far, expected):
    from lippmann.rendering.reprojection.missed_pixels import bridge
    from lippmann.rendering.reprojection.point_image import REPROJECTED, TRACED
    from lippmann.rendering.reprojection.rules import choose_rules

    points, lens = thinned(0)
    traced = points.status[0] == -2
    points.status[0, traced] = TRACED
    points.disparity[0, traced] = 0.5
    points.color[0, 4], points.disparity[0, 4] = 1.0, far
    bridge(0, 1, points, lens, choose_rules(careful=False, coded=False))
    assert np.all(points.status[0] == np.where(traced, TRACED, REPROJECTED))
    assert points.color[0, 1:4, 0] == pytest.approx(expected)
    # Under the second lens only one pixel is known.
    assert points.color[0, 9:, 0].tolist() == [0, 0, 0]
    assert points.disparity[0, 10:].tolist() == [0.5, 0.5]
