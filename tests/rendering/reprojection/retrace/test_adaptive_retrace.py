"""The search for what reprojection has falsified."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("engine")

HEIGHT, LENSES, WIDE = 32, 6, 8


class KnownTracer:
    def __init__(self, truth):
        self.truth, self.traced = truth, 0

    def trace(self, numbers, points):
        row, column = np.divmod(np.asarray(numbers, dtype=int), LENSES * WIDE)
        assert not np.any(points.status[row, column] == 0), "traced twice"
        points.color[row, column] = self.truth[row, column]
        points.status[row, column] = 0
        self.traced += len(numbers)


def found(truth, taken, at_edges=(), follow=lambda *_: None):
    from lippmann.rendering.reprojection.common.point_image import REPROJECTED, PointImage
    from lippmann.rendering.reprojection.common.thresholds import Rules
    from lippmann.rendering.reprojection.retrace.adaptive_retrace import Look, Looks, search
    from lippmann.runtime.row_threads import Bands

    points = PointImage.empty(HEIGHT, LENSES * WIDE)
    points.color[:], points.disparity[:], points.status[:] = taken, -0.1, REPROJECTED
    rules = Rules(True, 0.06, False, probe_rows=4, longest_gap=3, overhang=0)
    lens = np.broadcast_to(np.repeat(np.arange(LENSES, dtype=np.int32), WIDE), points.status.shape)
    tracer, counts = KnownTracer(truth), []
    bands = Bands(1)
    looks = Looks(tuple(Look(*look) for look in at_edges), (Look(6, 8),))
    search(points, lens, WIDE, looks, tracer, bands, rules, follow, counts.append)
    assert sum(counts) == tracer.traced
    return points


def picture(value=0.2):
    return np.full((HEIGHT, LENSES * WIDE, 3), value, np.float32)


def test_a_smooth_picture_is_left_alone():
    ramp = picture() + np.linspace(0, 1, LENSES * WIDE, dtype=np.float32)[:, None]
    assert np.all(found(ramp, ramp).status == 1)


def test_edges_between_lenses_are_none():
    stripes = picture()
    stripes[:, WIDE : 2 * WIDE] = 0.9
    assert np.all(found(stripes, stripes).status == 1)


def test_an_edge_that_is_right_ends_the_search():
    halves = picture()
    halves[:, 4:WIDE] = 0.9
    points = found(halves, halves)
    assert np.all(points.status[:, 3:5] == 0)
    assert np.count_nonzero(points.status == 0) == 2 * HEIGHT


def test_a_thing_is_found_whole_from_one_wrong_edge():
    truth, taken = picture(), picture()
    truth[10:22, WIDE + 1 : WIDE + 7] = 0.9
    taken[12, WIDE + 3] = 0.9
    points = found(truth, taken)
    assert np.array_equal(points.color, truth)
    assert np.count_nonzero(points.status == 0) < 0.3 * points.status.size


@pytest.mark.parametrize("at_edges", [(), ((6, 4),)])
def test_what_begins_under_the_next_lens_is_looked_for(at_edges):
    truth = picture()
    truth[10:16, 2 * WIDE + 4 : 3 * WIDE] = 0.9
    taken = truth.copy()
    truth[11:14, 3 * WIDE : 3 * WIDE + 6] = 0.9  # goes on under the next lens, where no source saw it
    points = found(truth, taken, at_edges)
    assert np.array_equal(points.color, truth) == (len(at_edges) > 0)


def test_surprises_are_followed_and_looked_around():
    truth, taken = picture(), picture()
    truth[10:14, WIDE + 1 : WIDE + 7] = 0.9
    truth[18:20, WIDE + 1 : 2 * WIDE] = 0.9  # apart from the first, and within the six rows of the wider look
    taken[11, WIDE + 3] = 0.9
    followed = []
    points = found(truth, taken, follow=lambda surprised, lens, wanted: followed.extend(surprised.tolist()))
    assert np.array_equal(points.color, truth)
    row, column = np.divmod(np.array(followed), LENSES * WIDE)
    assert set(row) == {10, 11, 12, 13, 18, 19}
    assert np.all(truth[row, column] != taken[row, column])


def test_an_outline_before_the_background_is_an_edge():
    from lippmann.rendering.reprojection.common.point_image import BACKGROUND, REPROJECTED, PointImage
    from lippmann.rendering.reprojection.retrace.region_growing import mark_edges

    points = PointImage.empty(2, 8)
    points.status[:] = REPROJECTED
    points.disparity[:] = -0.1
    points.disparity[:, 5:] = BACKGROUND
    wanted = np.zeros((2, 8), dtype=np.bool_)
    mark_edges(0, 2, points, np.zeros((2, 8), np.int32), 0.06, False, wanted)
    assert np.array_equal(np.flatnonzero(wanted[0]), [4, 5])


def test_surprising_points_are_followed_to_the_neighbouring_lenses():
    from lippmann.rendering.reprojection.common.epipolar_rows import Rows
    from lippmann.rendering.reprojection.common.point_image import REPROJECTED, PointImage
    from lippmann.rendering.reprojection.retrace.region_growing import follow_across

    first = np.arange(4, dtype=np.int64) * WIDE
    offset = np.full(3, -3.5)
    rows = Rows(first, offset, first[:-1] - offset)
    points = PointImage.empty(1, 24)
    points.status[:] = REPROJECTED
    points.disparity[:] = -0.05
    points.disparity[0, 12] = -0.125  # nearer; one lens on it is seen one pixel further back
    lens = np.repeat(np.arange(3, dtype=np.int32), WIDE)[None]
    wanted = np.zeros((1, 24), dtype=np.bool_)
    follow_across(points, rows, np.array([12], np.uint32), lens, wanted)
    assert {5, 19} <= set(np.flatnonzero(wanted[0]).tolist()) <= {5, 6, 19, 20}
    # What lies nearer there already hides it.
    points.disparity[0, :8], points.disparity[0, 16:] = -0.01, -0.01
    wanted[:] = False
    points.disparity[0, 12] = -0.02
    points.disparity[0, 0:8], points.disparity[0, 16:24] = 0.1, 0.1
    follow_across(points, rows, np.array([12], np.uint32), lens, wanted)
    assert not wanted.any()


def test_arrays_are_looked_through_more_closely_than_few_and_many_cylinders():
    from lippmann.display import load_display
    from lippmann.rendering.reprojection.retrace.adaptive_retrace import Look, choose_looks

    few = load_display("seed-lenticular")
    assert choose_looks(few, 8).at_edges == (Look(6, 3),)
    # Many lenses: rays are dearer than rounds.
    assert choose_looks(few.resized(3840, 2160), 8).at_edges == ()
    for name in ("mla-square", "mla-hexagonal"):
        looks = choose_looks(load_display(name), 15)
        assert looks.at_edges == (Look(1, 1),)
        assert looks.at_surprises == (Look(4, 1), Look(15, 3))


@pytest.mark.parametrize("share", [2, 3, 4, 8])
def test_a_look_comes_to_every_row_and_column(share):
    from lippmann.rendering.reprojection.common.point_image import REPROJECTED, PointImage
    from lippmann.rendering.reprojection.retrace.region_growing import look_around

    points = PointImage.empty(HEIGHT, LENSES * WIDE)
    points.status[:] = REPROJECTED
    wanted = np.zeros(points.status.shape, dtype=np.bool_)
    look_around(points, WIDE, 8, share, np.array([16 * LENSES * WIDE + 3 * WIDE]), wanted)
    row, column = np.nonzero(wanted)
    assert set(row) == set(range(8, 25))
    assert set(column) == set(range(2 * WIDE, 5 * WIDE))
    assert wanted.sum() == pytest.approx(17 * 3 * WIDE / share, abs=17)
