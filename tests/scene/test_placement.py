"""How a display stands in a scene."""

import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from lippmann.display import Display, LensArray, Panel, list_displays, load_display
from lippmann.errors import SceneError, UsageError
from lippmann.options.placement import PlacementOptions
from lippmann.scene.camera_placement import VisibleDepth
from lippmann.scene.fit_placement import FILL, POP_OUT
from lippmann.scene.matrices import rotation, translation
from lippmann.scene.placement import face_viewer, find_eye_share, options_of_sequence, place, placement_of
from lippmann.scene.values.description import Camera


def display(viewing_distance=math.inf, aperture=20.0, width=400, height=300, gap=5.0):
    """100 mm x 75 mm, 10 pixels per lens; resolves 50 mm to either side."""
    return Display(
        "test",
        Panel(width, height, 0.25),
        LensArray("square", 2.5),
        gap=gap,
        viewing_distance=viewing_distance,
        aperture_distance=aperture,
    )


def box(*size, center=(0, 0, 0)):
    half = np.array(size, float) / 2
    return np.stack([center - half, center + half])


def corners(bounds):
    return np.array(np.meshgrid(*np.asarray(bounds).T)).reshape(3, -1).T


def in_display(placement, points):
    matrix = np.linalg.inv(placement.world_from_display)
    return np.atleast_2d(points) @ matrix[:3, :3].T + matrix[:3, 3]


def scale_of(placement):
    """World units per millimetre, across the display."""
    return np.linalg.norm(placement.world_from_display[:3, 0])


def zone(found):
    """Slopes ``(n, 2)`` of a display's light lines, and of eyes that move level, against the line to its middle eye.

    From the corners of the central micro-image; hexagons of the lens plane are those about the middles of a triangle.
    """
    lenses, around = found.lens_array, np.linspace(-1.0, 1.0, 9)
    half, slant = found.micro_image_pitch / 2, math.radians(lenses.slant)
    if lenses.layout == "lenticular":
        across = around[:, None] * half * np.array([math.cos(slant), -math.sin(slant)])
        level = around[:, None] * half / math.cos(slant) * np.array([1.0, 0.0])
        return np.concatenate([across, level]) / found.gap
    if lenses.layout == "square":
        return np.array(np.meshgrid(around, around)).reshape(2, -1).T * half / found.gap
    # The tips of a hexagon are as far from its own lens as from the two beyond.
    right, above = np.array([lenses.pitch, 0.0]), np.array([lenses.pitch / 2, lenses.row_spacing])
    tips = [
        np.linalg.solve(pair, (np.square(pair).sum(axis=1)) / 2) for pair in ([right, above], [above, above - right])
    ]
    return np.concatenate([tips, np.negative(tips), tips * np.array([1, -1])]) * found.magnification / found.gap


def spans(placement, points, found):
    """Lowest and highest place ``(2, 2)`` in the lens plane at which any view of the view zone shows one of points."""
    slopes, distance = zone(found)[:, None, :], found.viewing_distance
    x, y, z = in_display(placement, points).T
    # An eye at (sx D, sy D, D): its line to the point meets the lens plane at z / D of the way to the eye's foot.
    share = z / distance if math.isfinite(distance) else 0.0 * z
    toward = slopes * (z / (1 - share))[:, None]
    seen = np.stack([x, y], axis=1) / (1 - share)[:, None] - toward
    return np.stack([seen.min(axis=(0, 1)), seen.max(axis=(0, 1))])


def fill(placement, points, found):
    """Share of the panel, as all eyes of the view zone see it together, from its middle to the farthest side."""
    seen = np.abs(spans(placement, points, found)).max(axis=0)
    return float((2 * seen * found.magnification / found.size_mm).max())


def options(**fields):
    return PlacementOptions(**fields)


#: The line on a scene with cameras that is fitted, since nobody named one.
SEEN = 'fitted, seen along -z: as a camera of the file sees it by camera="{}"'
#: The same where the scene's middle lies before a camera, whose direction the fit takes.
FACING = (
    'fitted, seen the way that a camera of the file looks: camera="{}" shows its picture, place="fit" a view along -z'
)


class TestFit:
    def test_a_flat_scene_fills_the_panel_in_the_lens_plane(self):
        placed = place(box(3, 1, 0, center=(7, 8, 9)), display())
        points = in_display(placed, corners(box(3, 1, 0, center=(7, 8, 9))))
        assert np.ptp(points, axis=0) == pytest.approx([FILL * 100, FILL * 100 / 3, 0])
        assert points.mean(axis=0) == pytest.approx([0, 0, 0], abs=1e-9)
        assert placed.depth_range == pytest.approx((0, 0), abs=1e-9)
        assert placed.mode == "fit"
        assert placed.warnings == ()

    def test_a_tall_scene_is_held_by_the_height(self):
        placed = place(box(1, 3, 0), display())
        assert np.ptp(in_display(placed, corners(box(1, 3, 0))), axis=0)[1] == pytest.approx(FILL * 75)

    def test_up_is_up_and_the_front_faces_the_viewer(self):
        placed = place(box(2, 2, 1), display())
        low, high = in_display(placed, [[-1, -1, -0.5], [1, 1, 0.5]])
        assert (high > low).all()

    def test_a_third_of_the_depth_pops_out(self):
        back, front = place(box(10, 10, 2), display()).depth_range
        assert front / (front - back) == pytest.approx(POP_OUT)

    @pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
    def test_pop_out(self, share):
        placed = place(box(10, 10, 2), display(), options=options(pop_out=share))
        back, front = placed.depth_range
        assert front / (front - back) == pytest.approx(share, abs=1e-9)
        assert placed.warnings == ()

    def test_the_aperture_cuts_nothing(self):
        placed = place(box(10, 10, 5), display(aperture=3.0))
        assert placed.depth_range[1] == pytest.approx(3.0)
        assert placed.warnings == ()
        wished = place(box(10, 10, 5), display(aperture=3.0), options=options(pop_out=0.5))
        assert wished.depth_range[1] == pytest.approx(3.0)
        (warning,) = wished.warnings
        assert "3 mm of the scene lie in front of the lens plane instead of" in warning

    def test_a_deep_scene_fills_the_panel_with_its_depth_compressed(self):
        placed = place(box(6, 6, 8), display(aperture=0.0))
        back, front = placed.depth_range
        assert (back, front) == (pytest.approx(-50), pytest.approx(0, abs=1e-9))
        assert placed.depth_budget == display(aperture=0.0).depth_budget[::-1] == (-50, 0)
        # Views a quarter to either side show its back 12.5 mm to the other.
        side = FILL * 75 - 2 * 12.5
        assert np.ptp(in_display(placed, corners(box(6, 6, 8))), axis=0)[:2] == pytest.approx([side] * 2)
        assert placed.depth_scale == pytest.approx(50 / (8 / 6 * side))
        assert placed.warnings == (
            "depth 61.7 mm flattened to 81 %: depth_scale=1 keeps it, soft at its ends; scale=0.81 keeps it sharp, "
            "in a smaller picture",
        )
        smaller = place(box(6, 6, 8), display(aperture=0.0), options=options(scale=0.8))
        assert smaller.depth_scale == pytest.approx(1.0)
        assert smaller.warnings == ()
        back, front = place(box(6, 6, 16), display(aperture=60.0)).depth_range
        assert (back, front) == (pytest.approx(-50), pytest.approx(25))

    @pytest.mark.parametrize("aperture", [60.0, 200.0])
    def test_what_pops_out_is_held_by_the_resolved_depth_too(self, aperture):
        placed = place(box(6, 6, 16), display(aperture=aperture), options=options(pop_out=0.6))
        assert placed.depth_range == (pytest.approx(-100 / 3), pytest.approx(50))

    def test_depth_is_shown_whole_where_that_is_asked_for(self):
        whole = place(box(1, 1, 40), display(), options=options(depth_scale=1.0))
        # 20 mm in front, the rest behind, which a quarter of it to either side does not take off the panel.
        size = (FILL * 75 + 20 / 2) / (1 + 40 / 2)
        assert np.ptp(in_display(whole, corners(box(1, 1, 40))), axis=0) == pytest.approx([size, size, 40 * size])
        (warning,) = whole.warnings
        assert "the display resolves -50 to 50 mm" in warning

    @pytest.mark.parametrize("mode", ["fit", "display"])
    def test_a_given_depth_scale(self, mode):
        given = options(place=mode, depth_scale=0.25, scale=0.5, shift=(1, 2, 3), turn=(20, 30, 40))
        placed = place(box(10, 10, 2), display(), options=given)
        plain = place(box(10, 10, 2), display(), options=options(place=mode, scale=0.5, turn=(20, 30, 40)))
        points = corners(box(10, 10, 2))
        if mode == "fit":  # it stands elsewhere in depth, and larger, as its views move less
            depth, full = (scale_of(each) * np.ptp(in_display(each, points), axis=0)[2] for each in (placed, plain))
            assert depth == pytest.approx(0.25 * full)
        else:
            assert in_display(placed, points) == pytest.approx(in_display(plain, points) * (1, 1, 0.25) + (1, 2, 3))
        assert placed.depth_scale == pytest.approx(0.25)

    @pytest.mark.parametrize("distance", [math.inf, 150.0])
    def test_extreme_points_fill_where_the_box_would_not(self, distance):
        rng = np.random.default_rng(3)
        ball = rng.normal(size=(4000, 3))
        ball /= np.linalg.norm(ball, axis=1)[:, None]
        bounds = np.stack([ball.min(axis=0), ball.max(axis=0)])

        def filled(**known):
            placed = place(bounds, display(distance), options=options(turn=(45, 0, 45)), **known)
            return fill(placed, ball, display(distance))

        assert filled(extreme_points=lambda: ball) == pytest.approx(FILL, abs=0.01)
        assert filled() < 0.8

    def test_a_near_viewer_sees_the_front_face_whole(self):
        near = display(viewing_distance=100.0, aperture=90.0)
        bounds = box(4, 0.1, 1)
        assert fill(place(bounds, near), corners(bounds), near) == pytest.approx(FILL)

    @pytest.mark.parametrize(
        ("turn", "of", "to"),
        [
            ((90, 0, 0), (0, 0, 1), (1, 0, 0)),
            ((0, 90, 0), (0, 1, 0), (0, 0, 1)),
            ((0, -90, 0), (0, 0, 1), (0, 1, 0)),
            ((0, 0, 90), (1, 0, 0), (0, 1, 0)),
            ((90, 90, 0), (1, 0, 0), (0, 1, 0)),  # to -z first, then up
        ],
    )
    def test_turns(self, turn, of, to):
        placed = place(box(2, 2, 2), display(), options=options(turn=turn, depth_scale=1.0))
        origin, point = in_display(placed, [(0, 0, 0), of])
        assert (point - origin) * scale_of(placed) == pytest.approx(to, abs=1e-9)

    def test_the_turned_box_is_what_is_fitted(self):
        bounds = box(1, 1, 4)
        placed = place(bounds, display(), options=options(turn=(90, 0, 0)))
        assert np.ptp(in_display(placed, corners(bounds)), axis=0)[0] == pytest.approx(FILL * 100 * 4 / (4 + 1 / 3))

    def test_shift_and_scale(self):
        bounds = box(10, 10, 1)
        plain = place(bounds, display(), options=options(pop_out=0.0))
        moved = place(bounds, display(), options=options(pop_out=0.0, shift=(1, 2, -3), scale=0.5))
        assert scale_of(moved) == pytest.approx(2 * scale_of(plain))
        assert in_display(moved, [(0, 0, 0.5)]) == pytest.approx(np.array([[1, 2, -3]]))

    def test_a_line_toward_the_viewer(self):
        back, front = place(box(0, 0, 3), display(aperture=0.0)).depth_range
        assert (back, front) == (pytest.approx(-50), pytest.approx(0, abs=1e-9))

    @pytest.mark.parametrize(
        ("size", "turn"),
        [
            ((0, 0, 3), (0, 180, 0)),  # sine and cosine of 180 degrees leave 4e-16 of height
            ((0, 0, 3), (180, 0, 0)),
            ((3, 0, 0), (90, 0, 0)),
            ((0, 3, 0), (0, 90, 0)),
            ((0, 1e-7, 3), (0, 0, 0)),  # as a file's single precision has it
        ],
    )
    def test_rounding_noise_across_a_line_toward_the_viewer_is_no_width(self, size, turn):
        bounds = box(*size, center=(3, -2, 1))
        placed = place(bounds, display(aperture=0.0), options=options(turn=turn))
        assert placed.depth_range == pytest.approx((-50, 0), abs=1e-9)
        assert 3 / scale_of(placed) == pytest.approx(50)
        assert placed.warnings == ()

    def test_a_small_scene_far_from_the_origin_has_a_size(self):
        placed = place(box(0.1, 0.1, 0, center=(1e6, 2e6, 0)), display())
        assert 0.1 / scale_of(placed) == pytest.approx(FILL * 75, rel=1e-6)

    def test_a_scene_moved_off_the_panel(self):
        placed = place(box(1, 1, 0), display(), options=options(shift=(500, 0, 0)))
        assert any("beside the panel" in warning for warning in placed.warnings)
        assert place(box(1, 1, 0), display(), options=options(shift=(30, 0, 0))).warnings == ()

    @pytest.mark.parametrize("preset", [found.name for found in list_displays()])
    def test_presets_are_filled(self, preset):
        found = load_display(preset)
        placed = place(box(2, 2, 2), found)
        assert fill(placed, corners(box(2, 2, 2)), found) == pytest.approx(FILL, rel=1e-6)
        assert placed.depth_range[1] <= found.aperture_distance + 1e-9
        assert not any("blurred" in warning for warning in placed.warnings)

    @settings(deadline=None, max_examples=30)
    @given(
        st.tuples(*[st.floats(0, 10)] * 3),
        st.sampled_from([math.inf, 300.0, 60.0]),
        st.floats(0, 50),
        st.tuples(*[st.floats(-180, 180)] * 3),
        st.none() | st.floats(0, 1),
    )
    @example(
        (0.0, 1.0, 0.0), 60.0, 27.0, (0.0, 102.0, 0.0), None
    )  # the lens plane's share in front depends on the size
    def test_a_fitted_scene_is_inside(self, size, distance, aperture, turn, pop_out):
        assume(max(size) > 1e-3)
        found = display(distance, aperture)
        bounds = box(*size, center=(3, -2, 1))
        placed = place(bounds, found, options=options(turn=turn, pop_out=pop_out))
        points = in_display(placed, corners(bounds))
        rotation = placed.world_from_display[:3, :3] / np.linalg.norm(placed.world_from_display[:3, :3], axis=0)
        assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-9)
        assert np.linalg.det(rotation) == pytest.approx(1)
        assert 0 < placed.depth_scale <= 1 + 1e-9
        assert points[:, 2].max() <= aperture + 1e-6
        assert placed.depth_range == pytest.approx((points[:, 2].min(), points[:, 2].max()), abs=1e-6)
        assert points[:, 2].min() >= -50 - 1e-6
        assert points[:, 2].max() <= 50 + 1e-6
        filled = fill(placed, corners(bounds), found)
        assert filled == pytest.approx(FILL, rel=1e-6) or (size[0] + size[1] < 1e-3 and filled < FILL)


@st.composite
def displays(draw):
    """Of all layouts, with 45 to 90 lenses from side to side."""
    layout = draw(st.sampled_from(["lenticular", "square", "hexagonal"]))
    pixels = draw(st.integers(4, 9))
    width, height = (draw(st.integers(45, 90)) * pixels for _ in range(2))
    return Display(
        "test",
        Panel(width, height, 0.25),
        LensArray(layout, 0.25 * pixels, slant=draw(st.floats(-35, 35)) if layout == "lenticular" else 0.0),
        gap=draw(st.floats(1.0, 12.0)),
        viewing_distance=draw(st.sampled_from([math.inf, 2000.0, 400.0, 90.0])),
        aperture_distance=draw(st.floats(0.0, 60.0)),
    )


def panel_points(found, points):
    """All panel points ``(n, 2)`` that show one of points through their own lens, beyond the panel's edges too."""
    columns, rows = (
        range(-count // 4, count + count // 4) for count in (found.lens_grid.columns, found.lens_grid.rows)
    )
    if found.lens_array.layout == "lenticular":
        rows = [0]
    j, i = (a.ravel().astype(float) for a in np.meshgrid(rows, columns, indexing="ij"))
    x, y = found.project(*(values[:, None] for values in points.T), i, j)
    owner = found.lens_of(x, y)
    own = (owner[0] == i) & (owner[1] == j)
    return np.stack([x[own], y[own]], axis=1)


@settings(deadline=None, max_examples=20)
@given(
    displays(),
    st.integers(0, 2**32 - 1),
    st.tuples(*[st.floats(-180, 180)] * 3),
    st.none() | st.floats(0, 1),
    st.none() | st.sampled_from([0.1, 1.0]),
)
def test_every_view_shows_all_of_a_fitted_mesh(found, seed, turn, pop_out, depth_scale):
    rng = np.random.default_rng(seed)
    mesh = rng.normal(size=(8, 3)) * rng.uniform(0.02, 1.0, 3) + rng.normal(size=3) * 10
    placed = place(
        np.stack([mesh.min(axis=0), mesh.max(axis=0)]),
        found,
        options=options(turn=turn, pop_out=pop_out, depth_scale=depth_scale),
        bounds_in=lambda frame: np.stack([f(mesh @ frame[:3, :3].T + frame[:3, 3], axis=0) for f in (np.min, np.max)]),
        extreme_points=lambda: mesh,
    )
    assert fill(placed, mesh, found) <= FILL + 1e-9
    shown = panel_points(found, in_display(placed, mesh))
    assert len(shown) > 0
    assert (np.abs(shown) <= np.array(found.size_mm) / 2).all()


class TestCamera:
    BOUNDS = box(2, 2, 2)

    @staticmethod
    def camera(**fields):
        """At (0, 0, 10), looking along -z."""
        matrix = np.eye(4)
        matrix[2, 3] = 10.0
        return Camera(**({"name": "eye", "world_from_camera": matrix, "fov_y": math.radians(40)} | fields))

    def test_the_plane_of_focus_becomes_the_lens_plane(self):
        placed = place(self.BOUNDS, display(), cameras=[self.camera(focus_distance=9.5)], options=options(camera="eye"))
        assert in_display(placed, [(0, 0, 0.5)]) == pytest.approx(np.zeros((1, 3)), abs=1e-9)
        assert placed.mode == "camera"

    def test_without_focus_the_centre_lies_in_the_lens_plane(self):
        placed = place(self.BOUNDS, display(), cameras=[self.camera()], options=options(place="camera"))
        assert in_display(placed, [(0, 0, 0)]) == pytest.approx(np.zeros((1, 3)), abs=1e-9)

    def test_the_eye_becomes_the_viewing_point(self):
        placed = place(self.BOUNDS, display(500.0), cameras=[self.camera()], options=options(camera="eye"))
        assert in_display(placed, [(0, 0, 10)]) == pytest.approx(np.array([[0, 0, 500]]))

    @pytest.mark.parametrize(("aspect", "filled"), [(2.0, "height"), (4 / 3, "both"), (1.0, "width")])
    def test_a_distant_viewer_sees_the_field_fill_the_panel(self, aspect, filled):
        camera = self.camera(aspect=aspect)
        placed = place(self.BOUNDS, display(), cameras=[camera], options=options(camera="eye"))
        top = 10 * math.tan(math.radians(20))
        x, y, _ = in_display(placed, [(top * aspect, top, 0)])[0]
        assert x >= 50 - 1e-9
        assert y >= 37.5 - 1e-9
        assert (y == pytest.approx(37.5)) == (filled in ("height", "both"))
        assert (x == pytest.approx(50)) == (filled in ("width", "both"))

    @pytest.mark.parametrize("distance", [math.inf, 500.0])
    def test_an_orthographic_camera(self, distance):
        camera = self.camera(fov_y=None, height=3.0, aspect=4 / 3)
        placed = place(self.BOUNDS, display(distance), cameras=[camera], options=options(camera="eye"))
        assert in_display(placed, [(2, 1.5, 0)])[0, :2] == pytest.approx([50, 37.5])

    def test_scale_and_mirror_of_its_node_do_not_count(self):
        bent = self.camera()
        bent.world_from_camera[:3, :3] = np.diag([-3.0, 2.0, 5.0])
        plain = place(self.BOUNDS, display(), cameras=[self.camera()], options=options(camera="eye"))
        found = place(self.BOUNDS, display(), cameras=[bent], options=options(camera="eye"))
        assert found.world_from_display == pytest.approx(plain.world_from_display)

    def test_pop_out_moves_the_plane(self):
        placed = place(self.BOUNDS, display(), cameras=[self.camera()], options=options(camera="eye", pop_out=0.25))
        back, front = placed.depth_range
        assert front / (front - back) == pytest.approx(0.25)

    def test_turn_and_scale_leave_the_focus_where_it_is(self):
        changed = options(camera="eye", turn=(30, 20, 10), scale=3.0, shift=(0, 0, 2))
        placed = place(self.BOUNDS, display(), cameras=[self.camera()], options=changed)
        assert in_display(placed, [(0, 0, 0)]) == pytest.approx(np.array([[0, 0, 2.0]]), abs=1e-9)

    def test_a_camera_inside_the_scene(self):
        placed = place(
            box(40, 40, 40, center=(0, 0, 20)), display(), cameras=[self.camera()], options=options(place="camera")
        )
        assert in_display(placed, [(0, 0, 5)]) == pytest.approx(np.zeros((1, 3)), abs=1e-9)  # between eye and far end
        assert any("cut off" in warning for warning in placed.warnings)
        assert any("blurred" in warning for warning in placed.warnings)

    def test_the_home_camera(self):
        cameras = [self.camera(name="other", focus_distance=1.0), self.camera()]
        home = place(self.BOUNDS, display(), cameras=cameras, home_camera="eye")
        assert home.mode == "camera"
        assert in_display(home, [(0, 0, 0)]) == pytest.approx(np.zeros((1, 3)), abs=1e-9)
        assert home.warnings == ()
        fitted = place(self.BOUNDS, display(), cameras=cameras)
        assert (fitted.mode, fitted.warnings) == ("fit", (FACING.format("other"),))
        asked = place(self.BOUNDS, display(), cameras=cameras, options=options(place="fit"), home_camera="eye")
        assert (asked.mode, asked.warnings) == ("fit", ())
        other = place(self.BOUNDS, display(), cameras=cameras, options=options(camera="other"), home_camera="eye")
        assert in_display(other, [(0, 0, 9)]) == pytest.approx(np.zeros((1, 3)), abs=1e-9)

    @pytest.mark.parametrize("turn", [(0, 0, 0), (30, 20, 10)])
    @pytest.mark.parametrize("degrees", [(40, -25, 5), (170, 0, 0), (0, -90, 0), (30, 90, 20)])
    def test_a_fit_takes_the_direction_of_a_camera(self, degrees, turn):
        pose = rotation(degrees).T
        pose[:3, 3] = 10.0 * pose[:3, 2] + (1.0, 2.0, 3.0)
        bounds = box(3, 2, 1, center=(1, 2, 3))
        away = self.camera(name="away", world_from_camera=pose @ np.diag([-1.0, 1, -1, 1]))
        flat = self.camera(name="flat", world_from_camera=np.diag([1.0, 0, 1, 1]))
        cameras = [flat, away, self.camera(world_from_camera=pose)]
        placed = place(bounds, display(), cameras=cameras, options=options(turn=turn, depth_scale=1.0))
        towards = placed.display_from_world[:3, :3] / np.cbrt(np.linalg.det(placed.display_from_world[:3, :3]))
        assert towards == pytest.approx((rotation(turn) @ rotation(degrees))[:3, :3], abs=1e-7)
        assert placed.warnings[0] == FACING.format("eye")
        asked = place(bounds, display(), cameras=cameras, options=options(place="fit", turn=turn))
        plain = place(bounds, display(), options=options(turn=turn))
        assert asked.world_from_display == pytest.approx(plain.world_from_display)
        unseen = place(bounds, display(), cameras=cameras[:2])
        assert unseen.warnings[0] == SEEN.format("flat")

    def test_unknown_cameras(self):
        with pytest.raises(SceneError, match=r"unknown camera 'eya', did you mean 'eye'\?; known are eye"):
            place(self.BOUNDS, display(), cameras=[self.camera()], options=options(camera="eya"))

    @pytest.mark.parametrize(
        ("fields", "message"),
        [
            ({"focus_distance": 0.0}, "camera 'eye' focuses at 0"),
            ({"focus_distance": math.nan}, "camera 'eye' focuses at nan"),
            ({"fov_y": None}, "neither an angle nor a height"),
            ({"fov_y": 0.0}, "has a field 0 high"),
            ({"fov_y": None, "height": -1.0}, "has a field -1 high"),
            ({"world_from_camera": np.diag([1.0, 1, 0, 1])}, "not invertible"),
            ({"world_from_camera": np.full((4, 4), np.nan)}, "not invertible"),
            ({"world_from_camera": np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -9], [0, 0, 0, 1]])}, "behind it"),
        ],
    )
    def test_cameras_that_see_nothing(self, fields, message):
        with pytest.raises(SceneError, match=message):
            place(self.BOUNDS, display(), cameras=[self.camera(**fields)], options=options(camera="eye"))

    @pytest.mark.parametrize(
        "fields", [{"focus_distance": 1e-300}, {"fov_y": 1e-308}, {"fov_y": None, "height": 1e300}]
    )
    def test_cameras_that_see_next_to_nothing_or_all(self, fields):
        eye = self.camera(**fields)
        shown = display(500.0 if eye.focus_distance else math.inf)
        with pytest.raises(
            SceneError, match=r"camera 'eye' makes 1 mm of the display .* long; between 1e-30 and 1e\+30"
        ):
            place(self.BOUNDS, shown, cameras=[eye], options=options(camera="eye"))

    def test_no_camera_at_all(self):
        with pytest.raises(SceneError, match="the scene has no cameras; fit it"):
            place(self.BOUNDS, display(), options=options(place="camera"))
        with pytest.raises(SceneError, match="unknown camera 'eye'; there is none"):
            place(self.BOUNDS, display(), options=options(camera="eye"))


class TestDisplayFrame:
    def test_coordinates_are_millimetres(self):
        placed = place(box(10, 10, 10), display(), options=options(place="display"))
        assert placed.world_from_display == pytest.approx(np.eye(4))
        assert placed.depth_range == (-5, 5)
        assert placed.warnings == ()

    def test_changes_apply(self):
        changed = options(place="display", turn=(90, 0, 0), scale=2.0, shift=(0, 0, -10))
        placed = place(box(10, 10, 10), display(), options=changed)
        assert in_display(placed, [(0, 0, 1)]) == pytest.approx(np.array([[2, 0, -10]]))

    def test_what_is_too_near_or_too_deep(self):
        placed = place(box(10, 10, 200), display(), options=options(place="display"))
        cut, blurred = placed.warnings
        assert "reaches 100 mm in front of the lens plane; recorded rays begin at 20 mm" in cut
        assert "from -100 to 100 mm; the display resolves -50 to 50 mm" in blurred

    def test_what_strains_eyes_says_how_flat_it_would_be_comfortable(self):
        monitor, deep = load_display("odyssey-3d"), box(10, 10, 260)
        (warning,) = place(deep, monitor, options=options(place="display")).warnings
        assert "from -120 to 85.8 mm it is comfortable to look at: flatten it to 66 %, or shift it" in warning
        assert place(deep, monitor, options=options(place="display", depth_scale=0.65)).warnings == ()


class TestEyesOfACamera:
    """Of a monitor that a camera places, the two pictures are taken so close together that depth is comfortable."""

    MONITOR = load_display("odyssey-3d")
    # The eye is 600 units from the focus, so that units are millimetres.
    CAMERA = Camera("main", translation((0.0, 0.0, 600.0)), fov_y=0.5, aspect=16 / 9, focus_distance=600.0)

    def placed(self, bounds, probe=None, *, is_unbounded=False, **fields):
        asked = options(place="camera", **fields)
        return place(bounds, self.MONITOR, cameras=[self.CAMERA], options=asked, probe=probe, is_unbounded=is_unbounded)

    def test_deep_scenes_are_comfortable_by_themselves(self):
        deep = box(100, 100, 400, center=(0, 0, -200))
        placement = self.placed(deep)
        # 400 mm behind: 0.4 of the eye distance; 119.9 mm, the most that is comfortable, 0.1666.
        assert placement.eye_share == 0.41
        (line,) = placement.warnings
        assert line.startswith("the two pictures are taken 25.8 mm apart instead of 63, for comfortable depth")
        back, front = placement.depth_range
        far, _ = placement.depth_budget
        assert far < back < 0.98 * far
        assert front == pytest.approx(0)
        # The camera's own picture stays as it is.
        np.testing.assert_allclose(placement.world_from_display, self.placed(deep, depth_scale=1.0).world_from_display)
        assert placement.traced(self.MONITOR).gap == pytest.approx(self.MONITOR.gap / 0.41)

    def test_whoever_asks_for_all_of_the_depth_is_told_of_the_strain(self):
        placement = self.placed(box(100, 100, 400, center=(0, 0, -200)), depth_scale=1.0)
        assert placement.eye_share == 1.0
        assert placement.traced(self.MONITOR) is self.MONITOR
        assert placement.depth_range[0] == pytest.approx(-400)
        assert "seen double" in placement.warnings[0]

    def test_a_shallow_scene_keeps_the_eyes_as_they_are(self):
        placement = self.placed(box(100, 100, 100))
        assert placement.eye_share == 1.0
        assert placement.warnings == ()

    def test_what_lies_round_the_viewer_unseen_does_not_count(self):
        around = box(2000, 2000, 2000, center=(0, 0, 900))
        views = []

        def probe(view):
            views.append(view)
            return VisibleDepth(560.0, 690.0)

        placement = self.placed(around, probe)
        # From the viewer's eye, in millimetres, through the panel's rectangle.
        view = views[-1]
        np.testing.assert_allclose(view.world_from_camera, translation((0.0, 0.0, 600.0)), atol=1e-9)
        assert (2 * 600 * view.half_width, 2 * 600 * view.half_height) == pytest.approx(self.MONITOR.size_mm)
        assert placement.eye_share == 1.0
        assert placement.depth_range == pytest.approx((-100, 40))

    def test_planes_without_end_count_as_far_as_they_are_seen(self):
        placement = self.placed(box(100, 100, 100), lambda view: VisibleDepth(560.0, 6000.0), is_unbounded=True)
        # The box alone is comfortable.
        assert placement.eye_share == 0.18

    def test_a_panel_under_lenses_has_no_pair_of_eyes(self):
        deep = box(100, 100, 400, center=(0, 0, -200))
        panel, asked = load_display("portrait"), options(place="camera")
        assert place(deep, panel, cameras=[self.CAMERA], options=asked).eye_share == 1.0


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"place": "middle"}, "place: unknown place 'middle'; known are fit, camera, display"),
        ({"place": "disply"}, "place: unknown place 'disply', did you mean 'display'"),
        ({"camera": 3}, "camera: 3; must be the name of a camera"),
        ({"scale": "big"}, "scale: 'big'; must be a factor"),
        ({"pop_out": "half"}, "pop_out: 'half'; must be a share"),
        ({"turn": "left"}, "turn: 'left'; must be one to three numbers"),
        ({"turn": ()}, r"turn: \(\); must be one to three numbers"),
        ({"turn": (1, 2, 3, 4)}, "turn: .*one to three numbers, none beyond 1e"),
        ({"scale": 0.0}, r"scale: 0\.0; must be a factor from 1e-09 to 1e\+09"),
        ({"scale": -1.0}, "scale: -1"),
        ({"scale": math.nan}, "scale: nan"),
        ({"scale": 1e-200}, "scale: 1e-200"),
        ({"shift": (0, 1e200, 0)}, "shift: "),
        ({"depth_scale": 0.0}, r"depth_scale: 0\.0; must be a factor from 0\.0001 to 10000"),
        ({"depth_scale": math.nan}, "depth_scale: nan"),
        ({"pop_out": 1.01}, r"pop_out: 1\.01; must be a share of the depth, 0 to 1"),
        ({"pop_out": -0.1}, r"pop_out: -0\.1"),
        ({"pop_out": math.nan}, "pop_out: nan"),
        ({"shift": 3}, "shift: 3; must be three numbers"),
        ({"shift": (0, math.inf, 0)}, "shift: .*three numbers, none beyond 1e"),
        ({"place": "fit", "camera": "eye"}, "camera: camera 'eye' beside placement 'fit'"),
        ({"place": "display", "pop_out": 0.5}, "pop_out: coordinates of the display leave nothing to choose"),
    ],
)
def test_options_that_cannot_be(fields, message):
    with pytest.raises(UsageError, match=message):
        PlacementOptions(**fields)


@pytest.mark.parametrize(
    ("turn", "kept"), [(30, (30, 0, 0)), (30.5, (30.5, 0, 0)), ((30, 15), (30, 15, 0)), ([1, 2, 3], (1, 2, 3))]
)
def test_a_turn_of_fewer_angles_is_yaw_then_pitch(turn, kept):
    assert PlacementOptions(turn=turn) == PlacementOptions(turn=kept)
    assert PlacementOptions(turn=np.array(turn)).turn == kept


def test_what_stands_for_a_placement():
    assert placement_of(None) == PlacementOptions()
    assert placement_of({"turn": 30, "place": "fit"}) == PlacementOptions(place="fit", turn=(30, 0, 0))
    placed = place(box(10, 10, 10), display())
    assert placement_of(placed) is placed
    with pytest.raises(UsageError, match="unknown option of a placement 'trun', did you mean 'turn'"):
        placement_of({"trun": 3})
    with pytest.raises(UsageError, match="placement: 'fit'; must be a PlacementOptions"):
        placement_of("fit")
    with pytest.raises(UsageError, match="a sequence finds the placement of each frame"):
        options_of_sequence(placed)


@pytest.mark.parametrize("mode", ["fit", "display"])
@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        (box(0, 0, 0, center=(1, 2, 3)), "a single point"),
        (np.array([[0, 1, 0], [1e-45, 1, 0]]), "a single point"),  # once it is turned
        (np.array([[0.1 + 0.2, 1, 0], [0.3, 1, 0]])[::-1], "a single point"),
        (np.full((2, 3), np.nan), "no extent"),
    ],
)
def test_scenes_without_extent(mode, bounds, message):
    with pytest.raises(SceneError, match=message):
        place(bounds, display(), options=options(place=mode))


@pytest.mark.parametrize(("thin", "said"), [(0, "side"), (1, "top")])
def test_a_flat_scene_seen_edge_on_is_turned(thin, said):
    size = np.array([20.0, 30.0, 40.0])
    size[thin] = 1e-9
    bounds = np.stack([-size / 2, size / 2])
    placement = place(bounds, display())
    assert any(f"turned to show its {said}" in warning for warning in placement.warnings)
    assert placement.depth_range[1] - placement.depth_range[0] < 1e-6
    normal = np.linalg.inv(placement.world_from_display)[:3, thin]
    np.testing.assert_allclose(normal / np.linalg.norm(normal), (0, 0, 1), atol=1e-9)
    turned = place(bounds, display(), options=PlacementOptions(turn=(0.0, 0.0, 90.0)))
    assert not any("edge-on" in warning for warning in turned.warnings)


def test_a_flat_scene_seen_from_its_face_stays():
    bounds = np.array([[-10.0, -15.0, 0.0], [10.0, 15.0, 1e-9]])
    assert not place(bounds, display()).warnings


@pytest.mark.parametrize(("aside", "is_seen"), [(0.0, True), (4.0, True), (6.0, False)])
def test_a_fit_is_seen_from_a_camera_that_has_the_scene_within_45_degrees(aside, is_seen):
    camera = Camera("from the right", rotation((90.0, 0.0, 0.0)) @ translation((aside, 0.0, 5.0)), math.radians(40))
    seen = face_viewer(box(1, 1, 1), PlacementOptions(), [], [camera])
    assert any(seen.turn) == is_seen


def test_a_scene_that_covers_the_panel_is_not_cut_by_its_size():
    asked = {"options": options(scale=2.0)}
    assert place(box(1, 1, 1), display(), **asked).may_cut is not None
    assert place(box(1, 1, 1), display(), **asked, fills_panel=True).may_cut is None


def test_eyes_need_not_bear_what_lies_before_the_rays():
    monitor = load_display("spatiallabs")
    near = monitor.aperture_distance
    shares = [
        find_eye_share(np.eye(4), np.array([[-9.0, -9.0, -20.0], [9.0, 9.0, front]]), monitor)
        for front in (near, 2 * near)
    ]
    assert shares[0] == shares[1]
    assert shares[0][1] == (-20.0, near)
