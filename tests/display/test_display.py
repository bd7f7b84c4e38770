"""The geometry of any display: what must hold whatever its numbers are."""

from __future__ import annotations

import json
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from lippmann.display import Display, LensArray, Panel, load_display
from lippmann.errors import DisplayError

many = settings(deadline=None, max_examples=30)


def panel_points(display, seed=0, count=400):
    """Random points of the panel, away from its very edge, beside all pixel centres of its diagonal."""
    rng = np.random.default_rng(seed)
    u, v = rng.uniform(1e-6, 1 - 1e-6, (2, count)) * [[display.panel.width], [display.panel.height]]
    steps = np.arange(max(display.panel.width, display.panel.height))
    u = np.concatenate([u, np.minimum(steps, display.panel.width - 1) + 0.5])
    v = np.concatenate([v, np.minimum(steps, display.panel.height - 1) + 0.5])
    return display.panel_point(u, v)


def all_lenses(display):
    grid = display.lens_grid
    j, i = np.indices((grid.rows, grid.columns)).astype(float)
    return i.ravel(), j.ravel()


def across(display, x, y):
    angle = math.radians(display.lens_array.slant)
    return x * math.cos(angle) - y * math.sin(angle)


def along(display, x, y):
    angle = math.radians(display.lens_array.slant)
    return x * math.sin(angle) + y * math.cos(angle)


# ---- Points and pixels ----------------------------------------------------------------------------------------------


@given(data=st.data())
@many
def test_pixel_coordinates_invert_panel_points(displays, data):
    display = data.draw(displays())
    u, v = np.linspace(0, display.panel.width, 23), np.linspace(0, display.panel.height, 23)
    again = display.pixel_coordinates(*display.panel_point(u, v))
    np.testing.assert_allclose(again, (u, v), atol=1e-10)


def test_row_0_is_on_top_and_column_0_on_the_left():
    display = load_display("seed-lenticular")
    x, y = display.panel_point(np.array([0.5, 511.5]), np.array([0.5, 511.5]))
    edge = 255.5 * 25.4 / 96
    np.testing.assert_allclose(x, [-edge, edge])
    np.testing.assert_allclose(y, [edge, -edge])


def test_subpixels_have_their_own_places():
    d = 0.3
    panel = Panel(6, 4, d)
    display = Display("x", panel, LensArray("square", 2 * d), gap=1)
    x, y = display.panel_point(2.5, 1.5)
    places = [display.subpixel_point(2.5, 1.5, c) for c in range(3)]
    np.testing.assert_allclose([p[0] - x for p in places], [-d / 3, 0, d / 3], atol=1e-15)
    np.testing.assert_allclose([p[1] - y for p in places], 0, atol=1e-15)
    # Measured offsets point right and down; the frame's y points up.
    panel = Panel(6, 4, d, subpixel_offsets=((0.25, 0.5), (-0.25, 0.0), (0.0, -0.5)))
    display = replace(display, panel=panel)
    x3, y3 = display.subpixel_point(np.full(3, 2.5), np.full(3, 1.5), np.arange(3.0))
    np.testing.assert_allclose(x3 - x, [0.25 * d, -0.25 * d, 0], atol=1e-15)
    np.testing.assert_allclose(y3 - y, [-0.5 * d, 0, 0.5 * d], atol=1e-15)
    for c in range(3):
        np.testing.assert_allclose(display.subpixel_point(2.5, 1.5, c), (x3[c], y3[c]), atol=1e-15)


# ---- The lens of a point --------------------------------------------------------------------------------------------


@given(data=st.data())
@many
def test_the_lens_of_a_point_has_the_nearest_center(displays, data):
    display = data.draw(displays())
    x, y = panel_points(display)
    i, j = display.lens_of(x, y)
    grid = display.lens_grid
    assert i.min() >= 0
    assert j.min() >= 0
    assert i.max() < grid.columns
    assert j.max() < grid.rows
    assert np.array_equal(i, np.round(i))
    shrink = display.viewing_distance / (display.viewing_distance + display.gap)
    shrink = 1.0 if math.isnan(shrink) else shrink
    assert display.magnification == pytest.approx(1 / shrink, rel=1e-12)

    def distance(lens_i, lens_j):
        cx, cy = display.lens_center(lens_i, lens_j, x, y)
        if display.lens_array.layout == "lenticular":
            return np.abs(across(display, x * shrink - cx, y * shrink - cy))
        return np.hypot(x * shrink - cx, y * shrink - cy)

    own = distance(i, j)
    for other_i, other_j in zip(*all_lenses(display), strict=True):
        assert (own <= distance(other_i, other_j) + 1e-8 * display.lens_array.pitch).all()


@given(data=st.data())
@many
def test_the_grid_is_tight(displays, data):
    """Each side of the panel touches the grid's outermost column or row."""
    display = data.draw(displays())
    width, height, grid = display.panel.width, display.panel.height, display.lens_grid
    inset = 1e-8
    # Hexagonal cells touch an edge with a tip level with their centre, so the centres are among the places looked at.
    i, j = all_lenses(display)
    centers = [c * display.magnification for c in display.lens_center(i, j, 0.0, 0.0)]
    center_u, center_v = display.pixel_coordinates(*centers)
    u = np.clip(np.concatenate([np.linspace(0, width, 200), center_u]), inset, width - inset)
    v = np.clip(np.concatenate([np.linspace(0, height, 200), center_v]), inset, height - inset)
    top = display.lens_of(*display.panel_point(u, np.full_like(u, inset)))
    bottom = display.lens_of(*display.panel_point(u, np.full_like(u, height - inset)))
    left = display.lens_of(*display.panel_point(np.full_like(v, inset), v))
    right = display.lens_of(*display.panel_point(np.full_like(v, width - inset), v))
    assert top[1].min() == 0
    assert bottom[1].max() == grid.rows - 1
    assert left[0].min() == 0
    assert right[0].max() == grid.columns - 1


def test_rows_count_down_and_odd_hexagonal_rows_are_shifted_right():
    display = load_display("mla-hexagonal")
    x0, y0 = display.lens_center(0.0, 0.0, 0.0, 0.0)
    x1, y1 = display.lens_center(0.0, 1.0, 0.0, 0.0)
    x2, y2 = display.lens_center(0.0, 2.0, 0.0, 0.0)
    assert (x1 - x0, x2 - x0) == pytest.approx((0.5, 0.0))
    assert (y1 - y0, y2 - y0) == pytest.approx((-13 / 15, -26 / 15))


@pytest.mark.parametrize(("columns", "center"), [(4, 0.5), (5, 0.0)])
@pytest.mark.parametrize("layout", ["lenticular", "square"])
def test_whole_lenses_tile_the_panel(layout, columns, center):
    """Even counts put a boundary at the origin, odd ones a centre."""
    display = Display("x", Panel(6 * columns, 6 * columns, 0.2), LensArray(layout, 1.2), gap=3)
    assert display.lens_grid.columns == columns
    x, _ = display.lens_center(float(columns // 2), 0.0, 0.0, 0.0)
    assert x == pytest.approx(center * 1.2, abs=1e-12)
    i, _ = display.lens_of(*display.panel_point(np.arange(6 * columns) + 0.5, 0.5))
    np.testing.assert_array_equal(i, np.repeat(np.arange(columns), 6))


def test_rounded_numbers_leave_no_slivers():
    """64.0000004 lenses are 64: the pitch in effect tiles the panel."""
    exact = load_display("seed-lenticular")
    pitch = exact.lens_array.pitch * (1 - 7e-9)
    rounded = replace(exact, lens_array=LensArray("lenticular", pitch))
    assert rounded.lens_grid == exact.lens_grid
    assert rounded.lens_array.pitch == pitch
    u = np.array([1e-8, 512 - 1e-8])
    np.testing.assert_array_equal(rounded.lens_of(*rounded.panel_point(u, u))[0], [0, 63])


def test_an_offset_places_the_lens():
    panel = Panel(40, 40, 0.25)
    display = Display("x", panel, LensArray("lenticular", 2.0, slant=20, offset=(0.3, -0.8)), gap=5)
    i, _ = display.lens_of(0.3, -0.8)
    np.testing.assert_allclose(display.lens_center(i, 0.0, 0.3, -0.8), (0.3, -0.8), atol=1e-12)
    display = Display("x", panel, LensArray("hexagonal", 2.0, offset=(0.3, -0.8)), gap=5, viewing_distance=200)
    i, j = display.lens_of(0.3 * display.magnification, -0.8 * display.magnification)
    np.testing.assert_allclose(display.lens_center(i, j, 0.0, 0.0), (0.3, -0.8), atol=1e-12)


# ---- Ties -----------------------------------------------------------------------------------------------------------


@given(
    data=st.data(),
    half_pixels=st.integers(2, 31),
    pixel_pitch=st.sampled_from([25.4 / 96, 0.1, 1 / 3, 0.0897, 25.4 / 720]),
    viewing_distance=st.sampled_from([math.inf, 600.0, 333.3]),
)
@many
def test_boundaries_on_pixel_centers_belong_to_the_right(data, half_pixels, pixel_pitch, viewing_distance):
    """7.5 pixels per lens and the like: every other boundary hits a pixel centre, and noise must not decide."""
    lenses = data.draw(st.integers(2, 60).filter(lambda n: n * half_pixels % 2 == 0))
    width = lenses * half_pixels // 2
    gap = 6.8
    shrink = 1 / (1 + gap / viewing_distance)
    lens_array = LensArray("square", half_pixels * pixel_pitch / 2 * shrink)
    assume(half_pixels <= 2 * width)
    display = Display("x", Panel(width, width, pixel_pitch), lens_array, gap, viewing_distance=viewing_distance)
    columns = np.arange(width)
    expected = (2 * columns + 1) // half_pixels  # exact: floor of (column + 1/2) / (half_pixels / 2)
    x, y = display.panel_point(columns + 0.5, columns + 0.5)
    i, j = display.lens_of(x, y)
    np.testing.assert_array_equal(i, expected)
    np.testing.assert_array_equal(j, expected)


@pytest.mark.parametrize("viewing_distance", [math.inf, 500.0])
@pytest.mark.parametrize("half_pixels", [3, 13, 25])
def test_ties_hold_on_the_widest_panels(half_pixels, viewing_distance):
    """A sheet of 100 000 pixels: rounding noise stays far below the tolerance."""
    lenses, pixel_pitch, gap = 2 * (100_000 // half_pixels), 25.4 / 720, 0.42
    width = lenses * half_pixels // 2
    lens_array = LensArray("lenticular", half_pixels * pixel_pitch / 2 / (1 + gap / viewing_distance))
    display = Display("x", Panel(width, 1, pixel_pitch), lens_array, gap, viewing_distance=viewing_distance)
    columns = np.arange(width)
    i, _ = display.lens_of(*display.panel_point(columns + 0.5, np.full(width, 0.5)))
    np.testing.assert_array_equal(i, (2 * columns + 1) // half_pixels)


def test_hexagonal_ties_do_not_depend_on_noise():
    """Pixel corners half-way between two rows of lenses belong to the lower one, wherever they lie."""
    display = Display("x", Panel(160, 96, 25.4 / 96), LensArray("hexagonal", 16 * 25.4 / 96, row_pitch=25.4 / 8), gap=3)
    # Lenses 16 apart in rows 12 apart, the origin midway between rows: the middle of neighbours of two rows, (4, 6)
    # from a centre, is a pixel corner.
    i, j = all_lenses(display)
    x, y = (c / (25.4 / 96) for c in display.lens_center(i, j, 0.0, 0.0))
    for side in (-1, 1):
        inside = (np.abs(x + 4 * side) < 80) & (y - 6 > -48) & (y - 6 < 48)
        d = display.panel.pixel_pitch
        _, owner_j = display.lens_of((x[inside] + 4 * side) * d, (y[inside] - 6) * d)
        np.testing.assert_array_equal(owner_j, j[inside] + 1)


# ---- Rays -----------------------------------------------------------------------------------------------------------


@given(data=st.data())
@many
def test_a_ray_lies_on_its_light_line(displays, data):
    """It starts in front of the lens plane, runs away from the viewer and passes its lens and its panel point."""
    display = data.draw(displays())
    x, y = panel_points(display)
    (ox, oy, oz), (dx, dy, dz) = display.light_ray(x, y)
    np.testing.assert_allclose(oz, display.aperture_distance)
    np.testing.assert_allclose(dx**2 + dy**2 + dz**2, 1)
    assert (dz < 0).all()
    i, j = display.lens_of(x, y)
    cx, cy = display.lens_center(i, j, x, y)
    np.testing.assert_allclose(ox - oz * dx / dz, cx, atol=1e-9)
    np.testing.assert_allclose(oy - oz * dy / dz, cy, atol=1e-9)
    np.testing.assert_allclose(ox - (oz + display.gap) * dx / dz, x, atol=1e-9)
    np.testing.assert_allclose(oy - (oz + display.gap) * dy / dz, y, atol=1e-9)


@given(data=st.data())
@many
def test_points_on_a_ray_project_back(displays, data):
    display = data.draw(displays())
    depth = data.draw(st.floats(-200, 50).filter(lambda z: abs(z) > 1e-3))
    x, y = panel_points(display)
    i, j = display.lens_of(x, y)
    (ox, oy, oz), (dx, dy, dz) = display.light_ray(x, y)
    t = (depth - oz) / dz
    np.testing.assert_allclose(display.project(ox + t * dx, oy + t * dy, oz + t * dz, i, j), (x, y), atol=1e-7)


@given(data=st.data())
@many
def test_views_meet_at_the_viewing_distance(displays, data):
    """One place under every lens is one view: its lines meet at D, or are parallel if D is infinite."""
    display = data.draw(displays())
    place = np.array(data.draw(st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2)))) * display.lens_array.pitch
    i, j = all_lenses(display)
    x, y = (
        c * display.magnification + shift for c, shift in zip(display.lens_center(i, j, 0.0, 0.0), place, strict=True)
    )
    np.testing.assert_array_equal(display.lens_of(x, y), (i, j))
    (ox, oy, oz), (dx, dy, dz) = display.light_ray(x, y)
    if math.isinf(display.viewing_distance):
        u, v = dx / dz, dy / dz
        expected = -place / display.gap
    else:
        t = (display.viewing_distance - oz) / dz
        u, v = ox + t * dx, oy + t * dy
        expected = -place * display.viewing_distance / display.gap
    np.testing.assert_allclose(across(display, u, v), across(display, *expected), atol=1e-7)
    if display.lens_array.layout == "lenticular":
        np.testing.assert_allclose(along(display, u, v), 0, atol=1e-7)
    else:
        np.testing.assert_allclose(v, expected[1], atol=1e-7)


@given(data=st.data())
@many
def test_far_viewing_distances_approach_the_infinite_one(displays, data):
    display = data.draw(displays(aligned=False, viewing_distances=st.just(math.inf)))
    assume(display.lens_array.offset is not None)  # alignment may jump with the count of lenses
    far = replace(display, viewing_distance=1e12)
    x, y = panel_points(display)
    near_boundary = np.any(
        np.not_equal(display.lens_of(x + 1e-6, y - 1e-6), display.lens_of(x - 1e-6, y + 1e-6)), axis=0
    )
    x, y = x[~near_boundary], y[~near_boundary]
    for a, b in zip(display.light_ray(x, y), far.light_ray(x, y), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-7)


@given(data=st.data())
@many
def test_mirrored_points_have_mirrored_rays(displays, data):
    """Mirroring x mirrors the rays; a slanted sheet leans to the other side."""
    display = data.draw(displays())
    lenses = display.lens_array
    offset = None if lenses.offset is None else (-lenses.offset[0], lenses.offset[1])
    mirrored = replace(display, lens_array=replace(lenses, slant=-lenses.slant, offset=offset))
    x, y = panel_points(display)
    a, b = display.light_ray(x, y), mirrored.light_ray(-x, y)
    # A point on a boundary belongs to the lens on its right, so it has no mirror image.
    step = 1e-8 * display.panel.pixel_pitch
    on_boundary = np.zeros(x.shape, dtype=bool)
    for sx, sy in ((step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)):
        on_boundary |= np.any(np.not_equal(display.lens_of(x + sx, y + sy), display.lens_of(x, y)), axis=0)
    keep = ~on_boundary
    for k in range(2):
        np.testing.assert_allclose(-a[k][0][keep], b[k][0][keep], atol=1e-9)
        np.testing.assert_allclose(a[k][1][keep], b[k][1][keep], atol=1e-9)


# ---- Pixels of a point, and what an eye sees ------------------------------------------------------------------------


@given(data=st.data())
@many
def test_the_ray_of_a_projected_point_passes_the_point(displays, data):
    display = data.draw(displays())
    point = data.draw(st.tuples(st.floats(-4, 4), st.floats(-4, 4), st.floats(-60, 40).filter(lambda z: abs(z) > 0.1)))
    i, j = all_lenses(display)
    x, y = display.project(*(np.full(i.shape, value) for value in point), i, j)
    owner_i, owner_j = display.lens_of(x, y)
    is_own = (owner_i == i) & (owner_j == j)
    (ox, oy, oz), (dx, dy, dz) = display.light_ray(x[is_own], y[is_own])
    t = (point[2] - oz) / dz
    np.testing.assert_allclose(ox + t * dx, point[0], atol=1e-7)
    np.testing.assert_allclose(oy + t * dy, point[1], atol=1e-7)


@given(data=st.data())
@many
def test_a_point_in_the_lens_plane_gives_no_nonsense(displays, data):
    display = data.draw(displays())
    i, j = (float(a[-1]) for a in all_lenses(display))
    cx, cy = display.lens_center(i, j, 0.0, 0.0)
    x, y = display.project(cx, cy, 0.0, i, j)
    np.testing.assert_allclose((x, y), (cx, cy), atol=1e-7)
    x, y = display.project(cx + 0.1, cy, 0.0, i, j)
    assert math.isfinite(x)
    # Slanted cylinders are passed at an angle, and deflect what is left of it across themselves.
    assert abs(x) > 1e4 * math.cos(math.radians(display.lens_array.slant)) ** 2


@given(data=st.data())
@many
def test_an_eye_on_a_ray_sees_its_panel_point(displays, data):
    """Looking along a recorded line finds the pixel that recorded it (across the lens, for a cylindrical one)."""
    display = data.draw(displays())
    x, y = panel_points(display)
    (ox, oy, oz), (dx, dy, dz) = display.light_ray(x, y)
    i, j = display.lens_of(x, y)
    cx, cy = display.lens_center(i, j, x, y)
    t = (display.aperture_distance + 40 - oz) / dz
    eye = ox + t * dx, oy + t * dy, oz + t * dz
    np.testing.assert_allclose(display.visible_panel_point(*eye, cx, cy), (x, y), atol=1e-8)
    # Elsewhere on the same lens it sees the same point; along a cylindrical lens the line of sight runs straight on.
    angle = math.radians(display.lens_array.slant)
    shift = 0.2 * display.lens_array.pitch
    lx, ly = cx + shift * math.cos(angle), cy - shift * math.sin(angle)
    np.testing.assert_allclose(display.visible_panel_point(*eye, lx, ly), (x, y), atol=1e-8)
    if display.lens_array.layout == "lenticular":
        lx, ly = cx + 0.7 * math.sin(angle), cy + 0.7 * math.cos(angle)
        seen = display.visible_panel_point(*eye, lx, ly)
        straight = 0.7 * (1 + display.gap / eye[2])
        np.testing.assert_allclose(along(display, seen[0] - x, seen[1] - y), straight, atol=1e-8)
        np.testing.assert_allclose(across(display, seen[0] - x, seen[1] - y), 0, atol=1e-8)


# ---- Values ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@given(data=st.data())
@many
def test_plain_values_round_trip_exactly(displays, data):
    display = data.draw(displays())
    assert Display.from_dict(json.loads(json.dumps(display.to_dict()))) == display
    assert pickle.loads(pickle.dumps(display)) == display


def test_resized_keeps_the_optics():
    display = load_display("seed-lenticular")
    larger = display.resized(3840, 2160)
    assert (larger.panel.width, larger.panel.height) == (3840, 2160)
    assert larger.lens_grid.columns == 480
    assert replace(larger, panel=display.panel) == display
    assert larger.resized(512, 512) == display


def test_a_notebook_shows_a_table():
    page = load_display("mla-square")._repr_html_()
    for text in ("mla-square", "510x510", "34x34", "15x15", "18.9 deg", "34x34 mm"):
        assert f">{text}</td>" in page


def test_summary_is_plain():
    summary = load_display("panel-4k").summary()
    assert json.loads(json.dumps(summary)) == summary
    assert summary["pixels"] == [3840, 2160]
    assert summary["viewing_distance"] == 600
    assert summary["depth_budget"] == pytest.approx([38.3, -38.3], abs=0.1)
    assert summary["pixels_per_lens"] == [pytest.approx(6.3, abs=0.01), None]
    assert load_display("mla-square").summary()["pixels_per_lens"] == pytest.approx([15, 15])


def test_depth_budget_ends_at_the_aperture_and_the_viewer():
    display = replace(load_display("mla-square"), aperture_distance=20)
    assert display.resolvable_depth == pytest.approx((45, -45))
    assert display.depth_budget == pytest.approx((20, -45))
    display = replace(display, viewing_distance=30)
    assert display.resolvable_depth == pytest.approx((30, -45))


# ---- Refusals -------------------------------------------------------------------------------------------------------


def good(**changes):
    values = {"name": "x", "panel": Panel(8, 8, 1.0), "lens_array": LensArray("square", 2.0), "gap": 1.0}
    return Display(**{**values, **changes})


@pytest.mark.parametrize(
    ("changes", "where", "said"),
    [
        ({"gap": 0}, "gap", "above zero"),
        ({"gap": -1.0}, "gap", "above zero"),
        ({"gap": math.nan}, "gap", "nan"),
        ({"gap": math.inf}, "gap", "inf"),
        ({"gap": "6.8"}, "gap", "'6.8'"),
        ({"gap": True}, "gap", "True"),
        ({"gap": 10**400}, "gap", "finite"),
        ({"viewing_distance": 0}, "viewing_distance", "above zero"),
        ({"viewing_distance": -500.0}, "viewing_distance", "-500"),
        ({"viewing_distance": math.nan}, "viewing_distance", "nan"),
        ({"aperture_distance": -0.1}, "aperture_distance", "-0.1"),
        ({"aperture_distance": math.inf}, "aperture_distance", "below the viewing distance"),
        ({"aperture_distance": 500, "viewing_distance": 400}, "aperture_distance", "below the viewing distance"),
        ({"name": ""}, "name", "not empty"),
        ({"title": 3}, "title", "text"),
        (
            {"lens_array": LensArray("square", 9.0)},
            "lens_array.pitch",
            "a lens covers 9 pixels across; the panel has only 8",
        ),
        ({"lens_array": LensArray("square", 6.0), "panel": Panel(8, 5, 1.0)}, "lens_array.pitch", "6 pixels down"),
        ({"lens_array": LensArray("lenticular", 5.0, slant=60)}, "lens_array.pitch", "a lens covers 10 pixels across"),
        ({"lens_array": LensArray("square", 0.5)}, "lens_array.pitch", "at least one"),
    ],
)
def test_impossible_displays_are_refused(changes, where, said):
    with pytest.raises(DisplayError) as caught:
        good(**changes)
    assert caught.value.where == where
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("change", "where", "said"),
    [
        (lambda d: d.update(gapp=1), "gapp", "did you mean 'gap'?"),
        (lambda d: d["panel"].update(widht=1), "panel.widht", "did you mean 'width'?"),
        (lambda d: d["lens_array"].pop("pitch"), "lens_array", "the key 'pitch' is missing"),
        (lambda d: d.pop("panel"), "", "the key 'panel' is missing"),
        (lambda d: d.update(panel=3), "panel", "table"),
        (lambda d: d.update(viewing_distance="far"), "viewing_distance", "'far'"),
    ],
)
def test_foreign_values_are_refused(change, where, said):
    values = good().to_dict()
    change(values)
    with pytest.raises(DisplayError) as caught:
        Display.from_dict(values)
    assert caught.value.where == where
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("asked", "inside"),
    [
        ((400, 300), (400, 300)),
        ((800, 300), (400, 300)),
        ((400, 900), (400, 300)),
        ((33, 25), (33, 25)),
        ((1, 9), (1, 1)),
    ],
)
def test_the_largest_picture_of_the_panels_shape(asked, inside):
    assert Panel(1600, 1200, 0.1).size_inside(*asked) == inside
