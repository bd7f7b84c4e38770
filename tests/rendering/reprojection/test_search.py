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


def the_field():
    from lippmann.display.lens_field import LensField

    edges = np.arange(LENSES + 1) * WIDE
    lens = np.tile(np.repeat(np.arange(LENSES, dtype=np.int32), WIDE), (HEIGHT, 1))
    center = np.stack([edges[:-1] + (WIDE - 1) / 2, np.zeros(LENSES)], axis=1)
    return LensField(lens, center, LENSES)


def found(truth, taken, of_edges=(), disparity=1.5):
    """The picture ``taken`` after the search; things at the usual disparity are seen through one lens only."""
    from lippmann.rendering.reprojection.point_image import REPROJECTED, PointImage
    from lippmann.rendering.reprojection.rules import Rules
    from lippmann.rendering.reprojection.search import Neighborhoods, Surroundings, search
    from lippmann.runtime.row_threads import Bands

    points = PointImage.empty(HEIGHT, LENSES * WIDE)
    points.color[:], points.disparity[:], points.status[:] = taken, disparity, REPROJECTED
    rules = Rules(True, 0.06, False, probe_rows=4, probe_stride=16, run_step=3)
    tracer = KnownTracer(truth)
    neighborhoods = Neighborhoods(tuple(Surroundings(*each) for each in of_edges), (Surroundings(6, 8),))
    search(points, the_field(), neighborhoods, tracer, Bands(1), rules)
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


@pytest.mark.parametrize("of_edges", [(), ((6, 4),)])
def test_what_begins_under_the_next_lens_is_looked_for(of_edges):
    truth = picture()
    truth[10:16, 2 * WIDE + 4 : 3 * WIDE] = 0.9
    taken = truth.copy()
    truth[11:14, 3 * WIDE : 3 * WIDE + 6] = 0.9  # goes on under the next lens, where no source saw it
    points = found(truth, taken, of_edges)
    assert np.array_equal(points.color, truth) == (len(of_edges) > 0)


def test_the_search_goes_on_around_wrong_predictions():
    truth, taken = picture(), picture()
    truth[10:14, WIDE + 1 : WIDE + 7] = 0.9
    truth[18:20, WIDE + 1 : 2 * WIDE] = 0.9  # apart from the first, and within six rows of it
    taken[11, WIDE + 3] = 0.9
    assert np.array_equal(found(truth, taken).color, truth)


def test_points_that_were_wrongly_predicted_are_traced_under_the_neighbouring_lenses():
    truth, taken = picture(), picture()
    truth[16, WIDE + 3] = taken[16, WIDE + 4] = 0.9
    untraced = np.count_nonzero(found(truth, taken).status[16, 2 * WIDE :] == 1)
    # At a disparity of -1/8 the next lens shows the point one pixel back, so seven pixels on.
    points = found(truth, taken, disparity=-0.125)
    assert points.status[16, WIDE + 10] == 0
    assert np.count_nonzero(points.status[16, 2 * WIDE :] == 1) < untraced


def test_an_outline_before_the_background_is_an_edge():
    from lippmann.rendering.reprojection.point_image import BACKGROUND, REPROJECTED, PointImage
    from lippmann.rendering.reprojection.search import mark_edges

    points = PointImage.empty(2, 8)
    points.status[:] = REPROJECTED
    points.disparity[:] = -0.1
    points.disparity[:, 5:] = BACKGROUND
    wanted = np.zeros((2, 8), dtype=np.bool_)
    mark_edges(0, 2, points, np.zeros((2, 8), np.int32), 0.06, False, wanted)
    assert np.array_equal(np.flatnonzero(wanted[0]), [4, 5])


def test_arrays_are_searched_more_closely_than_cylinders():
    from lippmann.display import load_display
    from lippmann.rendering.reprojection.search import Surroundings, choose_neighborhoods

    straight = choose_neighborhoods(load_display("seed-lenticular"), 8)
    for name in ("mla-square", "mla-hexagonal"):
        array = choose_neighborhoods(load_display(name), 15)
        assert array.of_edges[0].share < straight.of_edges[0].share
        assert array.of_wrong == (Surroundings(4, 1), Surroundings(15, 3))


@pytest.mark.parametrize("share", [2, 3, 4, 8])
def test_surroundings_come_to_every_row_and_column(share):
    from lippmann.rendering.reprojection.point_image import REPROJECTED, PointImage
    from lippmann.rendering.reprojection.search import mark_surroundings

    points = PointImage.empty(HEIGHT, LENSES * WIDE)
    points.status[:] = REPROJECTED
    wanted = np.zeros(points.status.shape, dtype=np.bool_)
    mark_surroundings(points, WIDE, 8, share, np.array([16 * LENSES * WIDE + 3 * WIDE]), wanted)
    row, column = np.nonzero(wanted)
    assert set(row) == set(range(8, 25))
    assert set(column) == set(range(2 * WIDE, 5 * WIDE))
    assert wanted.sum() == pytest.approx(17 * 3 * WIDE / share, abs=17)
