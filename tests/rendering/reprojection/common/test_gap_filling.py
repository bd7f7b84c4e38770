"""What is traced of missed stretches, and how the rest of them is bridged."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytestmark = pytest.mark.usefixtures("engine")

GAP = 0.5


class LineTracer:
    """Traces a picture that is known: ``shown`` is its point image."""

    def __init__(self, shown):
        self.shown = shown
        self.lists = []

    def trace(self, numbers, points):
        from lippmann.rendering.reprojection.common.point_image import TRACED

        self.lists.append(np.array(numbers))
        assert len(np.unique(numbers)) == len(numbers)
        for kept, true in zip(points[:3], self.shown[:3], strict=True):
            kept.reshape(-1, *kept.shape[2:])[numbers] = true.reshape(-1, *true.shape[2:])[numbers]
        points.status.ravel()[numbers] = TRACED


def the_rules(**others):
    from lippmann.rendering.reprojection.common.thresholds import Rules

    return Rules(True, 0.06, False, probe_rows=4, probe_stride=16, longest_gap=3, overhang=0)._replace(**others)


def shown(colors, disparities):
    from lippmann.rendering.reprojection.common.point_image import PointImage

    points = PointImage.empty(1, len(colors))
    points.color[0] = np.asarray(colors)[:, None]
    points.disparity[0] = disparities
    return points


def fill(truth, rules, edges, known=()):
    """The picture after filling all runs, and the tracer that was asked."""
    from lippmann.rendering.reprojection.common.gap_filling import Gaps
    from lippmann.rendering.reprojection.common.lens_map import LensField
    from lippmann.rendering.reprojection.common.point_image import PointImage
    from lippmann.runtime.row_threads import Bands

    points = PointImage.empty(*truth.status.shape)
    tracer = LineTracer(truth)
    counts = []
    bands = Bands(1)
    field = LensField(np.zeros(truth.status.shape, np.int32), np.zeros((1, 2)), np.array([edges], dtype=np.int64), 1)
    gaps = Gaps(points, field, tracer, bands, rules, counts.append)
    tracer.trace(np.array(known, dtype=np.uint32), points)
    gaps.unsettled[:] = True
    gaps.trace_samples()
    gaps.fill()
    assert sum(counts) == sum(map(len, tracer.lists)) - len(known)
    assert not gaps.unsettled.any()
    return points, tracer


@pytest.mark.slow
@settings(deadline=None, max_examples=40)
@given(st.lists(st.integers(1, 12), min_size=1, max_size=6), st.data())
def test_no_pixel_stays_missed_and_traced_ones_are_true(widths, data):
    edges, width = np.cumsum([0, *widths]), sum(widths)
    values = data.draw(st.lists(st.sampled_from([0.1, 0.5, 0.9]), min_size=width, max_size=width))
    truth = shown(values, np.full(width, GAP))
    careful = data.draw(st.booleans())
    rules = the_rules(careful=careful, longest_gap=3 if careful else 5, overhang=0 if careful else 1)
    points, tracer = fill(truth, rules, edges)
    assert np.all(points.status >= 0)
    traced = np.concatenate(tracer.lists)
    assert np.array_equal(points.color[0, traced], truth.color[0, traced])
    assert set(np.unique(points.color)) <= set(np.unique(truth.color))
    for begin, end in pairwise(edges.tolist()):
        assert np.any((traced >= begin) & (traced < end))  # each run shows something of its own


def test_one_surface_in_one_color_is_bridged():
    ramp = np.linspace(0.2, 0.3, 12)
    truth = shown(ramp, np.linspace(0.5, 0.55, 12))
    points, _ = fill(truth, the_rules(), [0, 12])
    assert np.allclose(points.color[0, :, 0], ramp, atol=1e-6)
    assert np.allclose(points.disparity, truth.disparity, atol=1e-6)
    assert 0 < points.share(1) < 1


@pytest.mark.parametrize("what", ["color", "disparity", "fragile"])
def test_care_traces_the_whole_gap_between_different_things(what):
    truth = shown(np.full(12, 0.2), np.full(12, GAP))
    if what == "color":
        truth.color[0, 6:] = 0.5
    elif what == "disparity":
        truth.disparity[0, 6:] = 0.1
    else:
        truth.fragile[0, 6:] = True
    points, tracer = fill(truth, the_rules(), [0, 12])
    assert len(tracer.lists[-1]) > 0
    assert {5, 6} <= set(np.concatenate(tracer.lists).tolist())
    assert np.array_equal(points.color, truth.color)
    assert np.array_equal(points.fragile, truth.fragile)


def test_without_care_the_middle_is_traced_and_each_side_takes_its_part():
    truth = shown([0.2] * 6 + [0.9] * 6, [GAP] * 6 + [0.1] * 6)
    points, tracer = fill(truth, the_rules(careful=False, longest_gap=5, overhang=1), [0, 12])
    assert sum(len(part) > 0 for part in tracer.lists) == 2
    wrong = np.flatnonzero(points.color[0, :, 0] != truth.color[0, :, 0])
    assert len(wrong) <= 1
    assert np.all(np.abs(wrong - 5.5) <= 2)


@pytest.mark.parametrize(("missed", "overhang", "extrapolated"), [(1, 0, False), (1, 1, True), (2, 1, False)])
@pytest.mark.parametrize("at_end", [False, True])
def test_no_more_than_the_overhang_is_extrapolated(missed, overhang, extrapolated, at_end):
    from lippmann.rendering.reprojection.common import gap_kernels
    from lippmann.rendering.reprojection.common.point_image import MISSED, REPROJECTED, TRACED, WANTED

    points = shown(np.full(8, 0.2), np.full(8, GAP))
    columns = np.arange(8)[-missed:] if at_end else np.arange(missed)
    points.status[0] = TRACED
    points.status[0, columns] = MISSED
    arguments = np.array([[0, 8]]), np.ones((1, 1), np.bool_)
    gap_kernels.bridge(0, 1, points, *arguments, the_rules(overhang=overhang), gap_kernels.TRACE_ALL)
    assert np.all(points.status[0, columns] == (REPROJECTED if extrapolated else WANTED))


def test_runs_do_not_lend_to_each_other():
    truth = shown([0.2] * 6 + [0.21] * 6, np.full(12, GAP))
    points, _ = fill(truth, the_rules(careful=False, longest_gap=5, overhang=1), [0, 6, 12])
    assert np.array_equal(points.color, truth.color)


def test_through_the_lens_plane_disparity_keeps_its_signs():
    z = np.linspace(-0.4, 0.5, 9)
    truth = shown(np.full(9, 0.2), 1 / z)
    points, _ = fill(truth, the_rules(), [0, 9])
    assert np.array_equal(points.disparity[0, [0, 1, 7, 8]] > 0, z[[0, 1, 7, 8]] > 0)
    assert np.all(np.isfinite(points.disparity))


def mean_of(left, right, rules, fragile=False):
    from lippmann.rendering.reprojection.common import gap_kernels
    from lippmann.rendering.reprojection.common.point_image import MISSED

    points = shown([0.2, 0.0, 0.3], [GAP, 0.0, GAP])
    points.status[0] = [0, MISSED, 0]
    points.fragile[0, 2] = fragile
    gap_kernels.average(0, 1, points, np.array([1], np.uint32), np.array([left]), np.array([right]), rules)
    # Where it shows something, that is as far away as what the neighbours show.
    assert points.disparity[0, 1] == pytest.approx(0.0 if points.status[0, 1] == MISSED else GAP)
    return points.color[0, 1, 0], points.status[0, 1]


@pytest.mark.parametrize(
    ("left", "right", "careful", "expected"),
    [
        (0, 2, False, 0.25),
        (0, -1, False, 0.2),  # the last lens has one neighbour
        (-1, 2, False, 0.3),
        (-1, -1, False, None),  # stays missed, and is traced
        (0, 2, True, None),  # they differ by more than the tolerance
        (0, -1, True, None),
    ],
)
def test_the_mean_of_corresponding_pixels(left, right, careful, expected):
    from lippmann.rendering.reprojection.common.point_image import INTERPOLATED, MISSED

    color, status = mean_of(left, right, the_rules(careful=careful))
    assert status == (MISSED if expected is None else INTERPOLATED)
    if expected is not None:
        assert color == pytest.approx(expected)


def test_with_care_neighbors_of_a_mean_agree_to_half_the_tolerance():
    from lippmann.rendering.reprojection.common.point_image import INTERPOLATED, MISSED

    for tolerance, expected in ((0.19, MISSED), (0.21, INTERPOLATED)):  # they are 0.1 apart
        assert mean_of(0, 2, the_rules(tolerance=tolerance))[1] == expected


def test_care_takes_no_mean_of_mirrors():
    from lippmann.rendering.reprojection.common.point_image import INTERPOLATED, MISSED

    assert mean_of(0, 2, the_rules(tolerance=0.5))[1] == INTERPOLATED
    assert mean_of(0, 2, the_rules(tolerance=0.5), fragile=True)[1] == MISSED
