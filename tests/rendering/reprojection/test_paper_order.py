"""The paper's order, on pictures small enough to be worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.display import Display, LensArray, Panel

pytestmark = pytest.mark.usefixtures("engine")

GAP = 4.0
DISPLAYS = {
    "straight": Display("s", Panel(48, 6, 1.0), LensArray("lenticular", 6.0), GAP),
    "broken": Display("b", Panel(48, 6, 1.0), LensArray("lenticular", 5.7), GAP, viewing_distance=500.0),
    "slanted": Display("t", Panel(48, 40, 1.0), LensArray("lenticular", 6.2, slant=12.0), GAP, viewing_distance=600.0),
    "square": Display("q", Panel(42, 42, 1.0), LensArray("square", 7.0), GAP),
    "hexagonal": Display("h", Panel(49, 48, 1.0), LensArray("hexagonal", 7.0, row_pitch=6.0), GAP),
}


def straight(lenses, width=4, height=1):
    return Display("s", Panel(lenses * width, height, 1.0), LensArray("lenticular", float(width)), GAP)


class Scripted:
    """Traces what a table says: the disparity of each pixel, and its own number as its colour."""

    def __init__(self, disparity):
        self.disparity = disparity
        self.calls = []

    def trace(self, numbers, points):
        self.calls.append(np.asarray(numbers, dtype=int))
        points.color.reshape(-1, 3)[numbers] = np.asarray(numbers, dtype=np.float32)[:, None]
        points.disparity.ravel()[numbers] = np.asarray(self.disparity, dtype=np.float32).ravel()[numbers]
        points.status.ravel()[numbers] = 0

    @property
    def traced(self):
        return np.concatenate(self.calls)


def make(display, tracer, method="lens_view"):
    """The finished points, and how many pixels were reported as traced."""
    from lippmann.rendering.reprojection.paper_order import PaperOrder
    from lippmann.rendering.reprojection.point_image import PointImage
    from lippmann.runtime.row_threads import Bands

    points = PointImage.empty(display.panel.height, display.panel.width)
    bands = Bands(1)
    getattr(PaperOrder(display, points, tracer, bands), method)()
    return points


def origins(points):
    """The number of the traced pixel that each pixel's colour comes from."""
    return points.color[..., 0]


def table(display, disparity):
    return np.full((display.panel.height, display.panel.width), disparity)


# ---- Lens-view -------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_plane_moves_by_its_disparity():
    display = straight(4)
    tracer = Scripted(table(display, -0.25))
    points = make(display, tracer)
    # From lens to lens everything moves by a quarter of a lens, a pixel to the left; the last pixel is missed.
    assert points.status.tolist() == [[0, 0, 0, 0] + [1, 1, 1, 0] * 3]
    assert origins(points).tolist() == [[0, 1, 2, 3, 1, 2, 3, 7, 2, 3, 7, 11, 3, 7, 11, 15]]
    assert [sorted(call) for call in tracer.calls] == [[0, 1, 2, 3], [7], [11], [15]]
    assert points.share(0) == 7 / 16
    assert np.all(points.disparity == np.float32(-0.25))


def test_before_the_lens_plane_it_moves_the_other_way():
    points = make(straight(3), Scripted(table(straight(3), 0.25)))
    assert origins(points).tolist() == [[0, 1, 2, 3, 4, 0, 1, 2, 8, 4, 0, 1]]


def test_a_plane_very_far_away_is_traced_once(flat_tracer, sheet):
    display = straight(5, height=3)
    tracer = flat_tracer(display, [sheet(-1e9, lambda x, y: np.stack([x, y, x * y], axis=-1))])
    points = make(display, tracer)
    assert np.array_equal(points.status, np.tile([0] * 4 + [1] * 16, (3, 1)))
    first = points.color[:, :4]
    assert all(np.array_equal(points.color[:, 4 * i : 4 * i + 4], first) for i in range(5))


def test_the_background_has_no_points(flat_tracer):
    display = straight(4, height=2)
    points = make(display, flat_tracer(display, []))
    assert np.all(points.status == 0)


def test_the_nearest_wins_whichever_comes_first():
    # Under lens 0: pixel 0 moves right by one, pixel 2 left by one.
    disparity = table(straight(2), -1e-9)
    disparity[0, :4] = [0.25, -100, -0.25, -100]
    assert origins(make(straight(2), Scripted(disparity)))[0, 5] == 0
    # Both behind the lens plane: the nearer one comes later.
    disparity[0, :4] = [-100, -100, -0.25, -0.5]
    assert origins(make(straight(2), Scripted(disparity)))[0, 5] == 3
    # Before the lens plane the nearer one has the smaller disparity.
    disparity[0, :4] = [0.5, 0.25, -100, -100]
    assert origins(make(straight(2), Scripted(disparity)))[0, 6] == 1


def test_of_two_at_one_distance_the_first_stays():
    disparity = table(straight(2), -100.0)
    disparity[0, 2:4] = [-0.3, -0.3]
    # Pixels 2 and 3 move by 1.2 pixels, to 0.8 and 1.8: nearest are 1 and 2.
    assert origins(make(straight(2), Scripted(disparity))).tolist()[0][4:] == [4, 2, 3, 7]


def test_points_do_not_drift():
    points = make(straight(4), Scripted(table(straight(4), -0.3)))
    # Pixel 3 is seen at 1.8, 0.6 and -0.6; moved to a pixel's centre each time it would come to 2, 1 and 0.
    assert origins(points)[0, 4 + 2] == 3
    assert origins(points)[0, 8 + 1] == 3
    assert not np.any(origins(points)[0, 12:] == 3)


def test_points_near_to_the_lens_plane_are_seen_by_one_lens():
    points = make(straight(3), Scripted(table(straight(3), 1e6)))
    assert np.all(points.status == 0)


def test_micro_images_without_pixels_are_passed_over():
    # A lens that owns points of the panel at its very edge, but no pixel's centre.
    array = LensArray("lenticular", 4.0, offset=(-5.6, 0.0))
    display = Display("edge", Panel(8, 1, 1.0), array, GAP)
    assert display.lens_grid.columns == 3
    points = make(display, Scripted(table(display, -0.25)))
    assert np.all(points.status >= 0)


def test_rows_of_square_lenses_are_displays_of_their_own():
    display = Display("q", Panel(12, 12, 1.0), LensArray("square", 4.0), GAP)
    tracer = Scripted(table(display, -0.25))
    points = make(display, tracer)
    assert np.array_equal(points.status, np.tile([0, 0, 0, 0] + [1, 1, 1, 0] * 2, (12, 1)))
    assert [len(call) for call in tracer.calls] == [48, 12, 12]
    assert origins(points)[5].tolist() == (np.array([0, 1, 2, 3, 1, 2, 3, 7, 2, 3, 7, 11]) + 60).tolist()


@pytest.mark.parametrize("name", DISPLAYS)
@pytest.mark.parametrize("method", ["lens_view", "interpolated"])
def test_colors_are_copies(name, method):
    display = DISPLAYS[name]
    tracer = Scripted(table(display, -0.11))
    points = make(display, tracer, method)
    assert len(np.unique(tracer.traced)) == len(tracer.traced) < points.status.size
    assert set(origins(points)[points.status == 1]) <= set(tracer.traced)
    numbers = np.arange(points.status.size).reshape(points.status.shape)
    assert np.array_equal(origins(points)[points.status == 0], numbers[points.status == 0])
    assert np.all(points.status >= 0)


# ---- Interpolated ----------------------------------------------------------------------------------------------------


def test_even_micro_images_take_points_of_both_sides():
    display = straight(5)
    points = make(display, Scripted(table(display, -0.25)), "interpolated")
    # Odd ones from odd ones, two pixels on; an even one has three points from its left, the fourth from its right.
    assert points.status.tolist() == [[0] * 4 + [1] * 4 + [1, 1, 0, 0] + [1] * 4 + [1, 1, 0, 0]]
    assert origins(points).tolist() == [[0, 1, 2, 3, 1, 2, 3, 10, 2, 3, 10, 11, 3, 10, 11, 18, 10, 11, 18, 19]]


def test_missed_pixels_become_the_mean_of_corresponding_ones():
    display = straight(3)
    disparity = table(display, 1e6)
    points = make(display, Scripted(disparity), "interpolated")
    assert points.status.tolist() == [[0] * 4 + [2] * 4 + [0] * 4]
    assert points.color[0, 4:8, 1].tolist() == [4.0, 5.0, 6.0, 7.0]  # means of 0 and 8, 1 and 9, ...


def test_the_last_of_an_even_number_has_one_neighbor():
    display = straight(4)
    points = make(display, Scripted(table(display, 1e6)), "interpolated")
    assert points.status.tolist() == [[0] * 4 + [2] * 4 + [0] * 4 + [2] * 4]
    assert origins(points)[0, 12:].tolist() == [8, 9, 10, 11]


def test_without_any_corresponding_pixel_it_is_traced():
    # One lens and a half: 1, 4 and 1 pixels, so that the middle two have no like at either side.
    display = Display("cut", Panel(6, 1, 1.0), LensArray("lenticular", 4.0), GAP)
    points = make(display, Scripted(table(display, 1e6)), "interpolated")
    assert points.status.tolist() == [[0, 2, 0, 0, 2, 0]]
    # The first pixel of the middle lens corresponds to one under the right lens, its last to one under the left.
    assert origins(points).tolist() == [[0, 5, 2, 3, 0, 5]]


def test_a_single_micro_image():
    display = straight(1)
    for method in ("lens_view", "interpolated"):
        assert make(display, Scripted(table(display, 0.1)), method).status.tolist() == [[0] * 4]


# ---- There and back --------------------------------------------------------------------------------------------------


@pytest.mark.slow
@given(
    name=st.sampled_from(sorted(DISPLAYS)),
    place=st.tuples(st.floats(0, 0.999), st.floats(0, 0.999)),
    height=st.floats(1.5, 1e4),
    in_front=st.booleans(),
)
@settings(max_examples=300, deadline=None)
def test_there_and_back_is_the_pixel(name, place, height, in_front):
    from lippmann.display.lens_field import LensField
    from lippmann.rendering.reprojection.paper_order import _carry
    from lippmann.rendering.reprojection.point_image import MISSED, REPROJECTED, TRACED, PointImage

    display = DISPLAYS[name]
    field = LensField.of(display)
    rows, columns = field.lens.shape
    row, column = int(place[1] * rows), int(place[0] * columns)
    lens = int(field.lens[row, column])
    if (lens + 1) % field.columns == 0:
        return
    points, beside = PointImage.empty(rows, columns), np.zeros((rows, columns, 2), dtype=np.float32)
    points.color[row, column] = (0.25, 0.5, 0.75)
    points.disparity[row, column] = 1 / height if in_front else -1 / height
    points.status[row, column] = TRACED
    points.fragile[row, column] = True
    number = np.array([row * columns + column], dtype=np.uint32)
    _carry(points, beside, field, number, 1)
    there = np.argwhere(points.status == REPROJECTED)
    if not len(there):
        return
    (r, c) = there[0]
    assert len(there) == 1
    assert field.lens[r, c] == lens + 1
    assert points.fragile[r, c]
    z = display.gap / float(points.disparity[row, column])
    (ox, oy, oz), (dx, dy, dz) = display.light_ray(*display.panel_point(column + 0.5, row + 0.5))
    t = (z - oz) / dz
    point = (np.array([a]) for a in (ox + t * dx, oy + t * dy, z))
    seen = display.pixel_coordinates(*display.project(*point, (lens + 1) % field.columns, (lens + 1) // field.columns))
    assert math.isclose(seen[0][0] - 0.5, c + beside[r, c, 0], abs_tol=1e-4)
    assert math.isclose(seen[1][0] - 0.5, r + beside[r, c, 1], abs_tol=1e-4)
    assert np.array_equal(points.color[r, c], points.color[row, column])
    points.status[row, column] = MISSED
    points.color[row, column] = 0
    _carry(points, beside, field, np.array([r * columns + c], dtype=np.uint32), -1)
    assert points.status[row, column] == REPROJECTED
    assert points.color[row, column].tolist() == [0.25, 0.5, 0.75]
    assert np.all(np.abs(beside[row, column]) < 1e-4)


@given(
    name=st.sampled_from(sorted(DISPLAYS)),
    place=st.tuples(st.floats(0, 0.999), st.floats(0, 0.999)),
    height=st.floats(0.5, 1e3),
    in_front=st.booleans(),
    to=st.floats(0, 0.999),
)
@settings(max_examples=300, deadline=None)
def test_points_move_as_the_display_projects_them(name, place, height, in_front, to):
    from lippmann.display.lens_field import LensField

    display = DISPLAYS[name]
    field = LensField.of(display)
    rows, columns = field.lens.shape
    row, column = int(place[1] * rows), int(place[0] * columns)
    z = height * GAP if in_front else -height * GAP
    if display.viewing_distance <= z:
        return
    x, y = display.panel_point(column + 0.5, row + 0.5)
    (ox, oy, oz), (dx, dy, dz) = display.light_ray(x, y)
    t = (z - oz) / dz
    target = int(to * len(field.center))
    seen_x, seen_y = display.project(
        *(np.array([v]) for v in (ox + t * dx, oy + t * dy, z)), target % field.columns, target // field.columns
    )
    u, v = display.pixel_coordinates(seen_x, seen_y)
    moved = (field.center[target] - field.center[field.lens[row, column]]) * (1 + GAP / z)
    assert math.isclose(u[0] - 0.5, column + moved[0], abs_tol=1e-6)
    assert math.isclose(v[0] - 0.5, row + moved[1], abs_tol=1e-6)
