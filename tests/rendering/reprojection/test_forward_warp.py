"""Drawing rows of micro-images into others: planes at any height and slope, and what hides what."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

pytestmark = pytest.mark.usefixtures("engine")

WIDTH, LENSES = 8, 5
QUICK = settings(max_examples=60, deadline=None)


def the_rows():
    from lippmann.rendering.reprojection.forward_warp import Rows

    first = np.arange(LENSES + 1, dtype=np.int64) * WIDTH
    return Rows(first, first[:-1] + (WIDTH - 1) / 2)


def the_rules(**others):
    from lippmann.rendering.reprojection.rules import Rules

    return Rules(True, 0.5, False, probe_rows=100, probe_stride=16, run_step=3)._replace(**others)


def plane(rows, level, slope, color, height=2):
    """Points of the plane on which disparity is ``level + slope * x * disparity`` at the lateral position x."""
    from lippmann.rendering.reprojection.point_image import TRACED, PointImage

    points = PointImage.empty(height, WIDTH * LENSES)
    for lens in range(LENSES):
        o = np.arange(WIDTH) - (WIDTH - 1) / 2
        # The lens at c shows at its place o the point at x = c - o / s, all in pixels.
        s = (level - slope * o) / (1 - slope * rows.center[lens])
        x = rows.center[lens] - o / s
        columns = slice(rows.first[lens], rows.first[lens + 1])
        points.disparity[:, columns] = s
        points.color[:, columns] = color(x, s)
        points.status[:, columns] = TRACED
    return points


def forget(points, rows, lenses):
    from lippmann.rendering.reprojection.point_image import BACKGROUND, MISSED

    for lens in lenses:
        columns = slice(rows.first[lens], rows.first[lens + 1])
        points.status[:, columns] = MISSED
        points.color[:, columns] = 0.0
        points.disparity[:, columns] = BACKGROUND


def draw(points, rows, targets, sources, rules):
    from lippmann.rendering.reprojection.forward_warp import receive

    height = len(points.status)
    targets, sources = np.array(targets, dtype=np.int64), np.array(sources, dtype=np.int64)
    receive(0, height, points, rows, targets, sources, rules)


@pytest.mark.long
@QUICK
@given(
    st.floats(-0.9, 0.9).filter(lambda s: abs(s) > 0.02),
    st.floats(-0.01, 0.01),
    st.booleans(),
    st.floats(-0.4, 0.4),
)
def test_a_plane_is_reprojected_exactly(level, slope, careful, tilt):
    """Colours that are linear along the plane's line of sight come out as they are, wherever a source reaches."""
    from lippmann.rendering.reprojection.point_image import QUEUED, REPROJECTED

    rows = the_rows()
    slope *= abs(level)

    def color(x, s):
        # Linear in the pixel for every lens, as perspective images of linear ramps of s are.
        return np.stack([0.5 + 0.3 * s, 0.5 - 0.2 * s, 0.4 + 0.1 * tilt * s], axis=-1)

    truth = plane(rows, level, slope, color)
    assume(np.all(np.sign(truth.disparity) == np.sign(level)))
    points = plane(rows, level, slope, color)
    forget(points, rows, [1, 2, 3])
    rules = the_rules(careful=careful)
    draw(points, rows, [2], [[0, 4]], rules)
    columns = slice(rows.first[2], rows.first[3])
    found = points.status[0, columns] == REPROJECTED
    # Who reaches what: a pixel at o of the target is seen at o + (c' - c) s under the source.
    o, s = np.arange(WIDTH) - (WIDTH - 1) / 2, truth.disparity[0, columns].astype(float)
    half = (WIDTH - 1) / 2
    reached = (np.abs(o + 2 * WIDTH * s) <= half) | (np.abs(o - 2 * WIDTH * s) <= half)
    sure = np.minimum(np.abs(np.abs(o + 2 * WIDTH * s) - half), np.abs(np.abs(o - 2 * WIDTH * s) - half)) > 0.05
    # Pieces drawn by two sources must agree; stretched ones of very oblique planes may be left out.
    assert np.array_equal(found[sure], reached[sure])
    assert np.all(points.status[0, columns][~found] == QUEUED)
    assert np.allclose(points.disparity[0, columns][found], s[found], rtol=1e-3, atol=1e-5)
    assert np.allclose(points.color[0, columns][found], truth.color[0, columns][found], atol=2e-3)


def constant(value):
    return lambda x, s: np.full((len(x), 3), value)


def test_the_nearest_wins():
    rows = the_rows()
    points = plane(rows, -0.05, 0.0, constant(0.2))
    # A near thing covers the left half of lens 1's micro-image; lens 2 sees it one pixel further on.
    points.disparity[:, 8:12], points.color[:, 8:12] = -0.125, 0.9
    forget(points, rows, [2])
    draw(points, rows, [2], [[1, -1]], the_rules(careful=False))
    # Left of the near thing nothing is known; it covers places -1 to 2, its outline reaches up to place 3.
    assert points.color[0, 16:18, 0] == pytest.approx([0.9, 0.9], abs=1e-6)
    assert np.all(points.disparity[0, 16:18] == pytest.approx(-0.125))
    farther = points.status[0, 16:24] > 0
    assert points.color[0, 20:23, 0][farther[4:7]] == pytest.approx(0.2, abs=1e-6)
    assert farther[4:7].any()


def test_the_nearest_wins_of_one_source_whichever_is_drawn_first():
    rows = the_rows()
    # Under the next lens a near thing comes to lie before the wall beside it: on its left, or on its right.
    for source, near, seen in ((1, slice(12, 16), slice(16, 20)), (3, slice(24, 28), slice(20, 24))):
        points = plane(rows, -0.05, 0.0, constant(0.2))
        points.disparity[:, near], points.color[:, near] = -0.5, 0.9
        forget(points, rows, [2])
        draw(points, rows, [2], [[source, -1] if source < 2 else [-1, source]], the_rules(careful=False))
        assert points.color[0, seen, 0] == pytest.approx(0.9)
        assert points.disparity[0, seen] == pytest.approx(-0.5)


@pytest.mark.parametrize("careful", [False, True])
def test_the_nearer_source_has_the_larger_share(careful):
    rows = the_rows()
    for sources, expected in (([1, 4], 0.3), ([0, 3], 0.4)):
        points = plane(rows, -1e-4, 0.0, constant(0.2))
        points.color[:, 24:] = 0.5
        forget(points, rows, [2])
        draw(points, rows, [2], [sources], the_rules(careful=careful))
        assert points.color[0, 17:23] == pytest.approx(expected, abs=1e-3)


def test_a_point_in_front_of_the_lens_plane_hides_one_behind():
    rows = the_rows()
    points = plane(rows, -0.1, 0.0, constant(0.2))
    near = plane(rows, 0.1, 0.0, constant(0.8))
    columns = slice(rows.first[3], rows.first[4])
    points.disparity[:, columns], points.color[:, columns] = near.disparity[:, columns], near.color[:, columns]
    forget(points, rows, [2])
    draw(points, rows, [2], [[1, 3]], the_rules(careful=False))
    # The right source sees the pixel at o at o + 0.8, where it has pixels from -3.5 to 3.5.
    reaches = np.arange(WIDTH) - 3.5 + 0.8 <= 3.5
    assert np.all(points.disparity[0, 16:24][reaches] == pytest.approx(0.1))
    assert points.color[0, 16:24, 0][reaches] == pytest.approx(0.8)


def test_traced_pixels_stay():
    from lippmann.rendering.reprojection.point_image import TRACED

    rows = the_rows()
    points = plane(rows, -0.1, 0.0, constant(0.2))
    forget(points, rows, [2])
    points.status[0, 20], points.color[0, 20], points.disparity[0, 20] = TRACED, 0.77, -0.3
    draw(points, rows, [2], [[1, 3]], the_rules(careful=False, probe_rows=1))
    assert points.color[0, 20] == pytest.approx(0.77)
    assert points.status[0, 20] == TRACED


def test_nothing_farther_than_what_probes_met_is_taken():
    from lippmann.rendering.reprojection.point_image import QUEUED, REPROJECTED, TRACED

    rows = the_rows()
    # Between probes that have met different surfaces, the nearer one counts.
    for above, below, expected in ((-0.1, -0.1, REPROJECTED), (0.5, 0.5, QUEUED), (-0.1, 0.5, QUEUED)):
        points = plane(rows, -0.1, 0.0, constant(0.2), height=5)
        forget(points, rows, [2])
        for row, places, met in ((0, (0, 4), above), (4, (2, 6), below)):
            columns = [16 + place for place in places]
            points.status[row, columns], points.disparity[row, columns] = TRACED, met
        draw(points, rows, [2], [[1, 3]], the_rules(careful=False, probe_rows=4))
        assert np.all(points.status[2, 18:22] == expected)


@pytest.mark.parametrize("careful", [False, True])
def test_care_leaves_fragile_points_and_edges_to_tracing(careful):
    from lippmann.rendering.reprojection.point_image import QUEUED

    rows = the_rows()
    rules = the_rules(careful=careful, tolerance=0.06)
    points = plane(rows, -1e-4, 0.0, constant(0.2))
    points.fragile[:, 8:16] = points.fragile[:, 24:32] = True
    forget(points, rows, [2])
    draw(points, rows, [2], [[1, 3]], rules)
    assert np.all((points.status[:, 17:23] == QUEUED) == careful)

    points = plane(rows, -1e-4, 0.0, constant(0.2))
    points.color[:, 12:16] = points.color[:, 28:32] = 0.6
    forget(points, rows, [2])
    draw(points, rows, [2], [[1, 3]], rules)
    missed = points.status[0, 16:24] == QUEUED
    assert np.any(missed[3:5]) == careful
    assert not missed[1:3].any()
    assert not missed[5:7].any()


@pytest.mark.parametrize("column", [12, 28])
def test_one_fragile_pixel_of_one_source_is_enough(column):
    from lippmann.rendering.reprojection.point_image import QUEUED

    rows = the_rows()
    points = plane(rows, -1e-4, 0.0, constant(0.2))
    points.fragile[:, column] = True
    forget(points, rows, [2])
    draw(points, rows, [2], [[1, 3]], the_rules())
    missed = points.status[0, 16:24] == QUEUED
    assert missed[4]
    assert not missed[1:3].any()
    assert not missed[6]


def test_care_leaves_to_tracing_what_the_sources_dispute():
    from lippmann.rendering.reprojection.point_image import QUEUED, REPROJECTED

    rows = the_rows()
    for apart, expected in ((0.02, REPROJECTED), (0.3, QUEUED)):
        points = plane(rows, -1e-4, 0.0, constant(0.2))
        points.color[:, 24:32] += apart
        forget(points, rows, [2])
        draw(points, rows, [2], [[1, 3]], the_rules(tolerance=0.06))
        assert np.all(points.status[:, 17:23] == expected)
        if expected == REPROJECTED:
            assert points.color[0, 17:23] == pytest.approx(0.2 + apart / 2, abs=1e-4)


@pytest.mark.parametrize("careful", [False, True])
@pytest.mark.parametrize("sources", [1, 2])
def test_where_an_outline_may_reach_farther_points_are_not_taken(careful, sources):
    """Between its last pixel and the next one, which sees the wall, the nearer thing may go on."""
    from lippmann.rendering.reprojection.point_image import QUEUED

    rows = the_rows()
    points = plane(rows, -1e-4, 0.0, constant(0.2))
    # Near to the left of either source's place 4; it comes to the left by 0.4 pixels, or to the right.
    for lens in (1, 3)[:sources]:
        points.disparity[:, 8 * lens : 8 * lens + 4] = -0.05
    forget(points, rows, [2])
    draw(points, rows, [2], [[1, 3]], the_rules(careful=careful))
    missed = points.status[0, 16:24] == QUEUED
    # The outline of the left source ends between the places 2.6 and 3.6, that of the right one between 3.4 and 4.4.
    assert missed[3] == (careful and sources == 1)
    assert not missed[[1, 2, 6]].any()
