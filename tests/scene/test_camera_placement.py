"""Displays placed by a camera show all that it sees; ``pop_out`` counts what is seen."""

import dataclasses

import numpy as np
import pytest

from lippmann import api
from lippmann.display import load_display
from lippmann.errors import UsageError
from lippmann.image import IntegralImage
from lippmann.options.placement import PlacementOptions
from lippmann.scene.camera_placement import FILL, VisibleDepth, place_by_camera
from lippmann.scene.extent import box_corners
from lippmann.scene.matrices import inverse, rotation_of
from lippmann.scene.placement import place
from lippmann.scene.values.description import Camera, Instance, Light, Material, Mesh, SceneDescription

BOUNDS = np.array([[-5.0, -5.0, -30.0], [5.0, 5.0, -1.0]])
EYE = Camera("eye", np.eye(4), fov_y=0.5, focus_distance=20.0)
#: Seen from 300 mm; rays begin 10 mm in front of the lens plane.
DISPLAY = dataclasses.replace(load_display("mla-square"), viewing_distance=300.0, aperture_distance=10.0)


def lens_plane(display_from_world):
    """Distance of the lens plane from the eye at the origin, world units."""
    return -inverse(display_from_world)[2, 3]


def seeing(near, far):
    return lambda view: VisibleDepth(near, far)


def test_a_focus_that_cuts_nothing_stays():
    warnings = []
    placed = place_by_camera(EYE, BOUNDS, DISPLAY, probe=seeing(19.8, 25.0), warnings=warnings)
    assert lens_plane(placed) == pytest.approx(20.0)
    assert not warnings


def test_the_lens_plane_moves_until_nothing_seen_is_cut():
    warnings = []
    placed = place_by_camera(EYE, BOUNDS, DISPLAY, probe=seeing(12.0, 25.0), warnings=warnings)
    front = (placed @ (0, 0, -12.0, 1))[2]
    assert 9.9 < front < 10.0
    assert len(warnings) == 1
    assert "the lens plane moved by 7.59 to 12.4" in warnings[0]


def test_enlarging_the_scene_leaves_less_room_before_the_lens_plane():
    placed = place_by_camera(EYE, BOUNDS, DISPLAY, scale=2.0, probe=seeing(12.0, 25.0), warnings=[])
    assert 2 * (placed @ (0, 0, -12.0, 1))[2] < 10.0


def test_without_an_aspect_the_camera_takes_the_display_s():
    """The angle spans the height of a display twice as wide as high, as it would that of such a picture."""
    square = load_display("seed-lenticular")
    wide = dataclasses.replace(square, panel=dataclasses.replace(square.panel, width=2 * square.panel.width))
    camera = dataclasses.replace(EYE, aspect=None)
    placed = place_by_camera(camera, BOUNDS, wide, probe=seeing(20.0, 20.0), warnings=[])
    height = 2 * 20 * np.tan(0.25)
    assert np.linalg.norm(placed[:3, 1]) == pytest.approx(wide.size_mm[1] / height)


@pytest.mark.parametrize("display", [DISPLAY, load_display("seed-lenticular")])
def test_a_shifted_lens_shows_what_lies_beside_the_axis_in_the_middle(display):
    turned = np.array([[0, 0, 1, 3], [0, 1, 0, -2], [-1, 0, 0, 5], [0, 0, 0, 1.0]])
    camera = dataclasses.replace(EYE, world_from_camera=turned, shift=(0.2, -0.1))
    bounds = np.array([[-25.0, -8.0, -2.0], [-5.0, 4.0, 12.0]])
    placement = place(bounds, display, cameras=[camera], options=PlacementOptions(camera="eye"))
    placed = placement.display_from_world
    middle = placed @ turned @ (0.2 * 20, -0.1 * 20, -20, 1)
    np.testing.assert_allclose(middle[:3], 0, atol=1e-6)
    # The lens plane lies at a right angle to the camera's own axis, its sides where the camera's are.
    linear = placement.world_from_display[:3, :3]
    np.testing.assert_allclose(rotation_of(placement.world_from_display)[:3, :3], turned[:3, :3], atol=1e-9)
    IntegralImage(np.zeros((display.panel.height, display.panel.width, 3)), display, placement.world_from_display)
    assert placement.depth_scale == pytest.approx(1.0)
    # The middle of every plane is behind that of the lens plane, as seen by the eye.
    behind = placed @ turned @ (0.2 * 25, -0.1 * 25, -25, 1)
    np.testing.assert_allclose(behind[:2], 0, atol=1e-6)
    assert behind[2] == pytest.approx(-5 / np.linalg.norm(linear[:, 0]))
    if np.isfinite(display.viewing_distance):
        np.testing.assert_allclose(placed @ turned @ (0, 0, 0, 1), (0, 0, display.viewing_distance, 1), atol=1e-6)


def test_a_shifted_orthographic_camera_moves_its_picture():
    camera = Camera("flat", np.eye(4), height=10.0, focus_distance=20.0, shift=(1.5, -2.0))
    placed = place_by_camera(camera, BOUNDS, DISPLAY, warnings=[])
    for depth in (20, 25):
        np.testing.assert_allclose((placed @ (1.5, -2.0, -depth, 1))[:2], 0, atol=1e-9)


def test_an_orthographic_camera_moves_its_lens_plane_too():
    camera = Camera("flat", np.eye(4), height=10.0, focus_distance=20.0)
    placed = place_by_camera(camera, BOUNDS, DISPLAY, probe=seeing(12.0, 25.0), warnings=[])
    assert 9.9 < (placed @ (0, 0, -12.0, 1))[2] < 10.0


def test_pop_out_is_the_share_of_what_is_seen():
    deep = dataclasses.replace(DISPLAY, aperture_distance=200.0)
    placed = place_by_camera(EYE, BOUNDS, deep, pop_out=0.25, probe=seeing(12.0, 20.0), warnings=[])
    assert lens_plane(placed) == pytest.approx(14.0)


def test_too_much_pop_out_is_refused_with_the_most_there_is():
    with pytest.raises(
        UsageError, match=r"0.5 of the visible depth .* 10 mm in front of it; ask for at most 0.05"
    ) as no:
        place_by_camera(EYE, BOUNDS, DISPLAY, pop_out=0.5, probe=seeing(12.0, 20.0), warnings=[])
    assert no.value.parameter == "pop_out"


def steps_scene():
    """Four walls across the view, one behind the other like stairs: depths 6 to 12, seen alike; a floor far below."""
    meshes = []
    for number, depth in enumerate((6.0, 8.0, 10.0, 12.0)):
        left = (-1.0 + 0.5 * number) * depth * 0.06
        right = left + 0.5 * depth * 0.06
        corners = np.float32([(left, -1, -depth), (right, -1, -depth), (right, 1, -depth), (left, 1, -depth)])
        meshes.append(Mesh(f"step {number}", corners, np.uint32([(0, 1, 2), (0, 2, 3)]), 0))
    floor = np.float32([(-90, -50, -900), (90, -50, -900), (90, -50, -1), (-90, -50, -1)])
    meshes.append(Mesh("floor", floor, np.uint32([(0, 1, 2), (0, 2, 3)]), 0))
    return api.load_scene(
        SceneDescription(
            "stairs",
            meshes,
            [Material(base_color=(0.6, 0.6, 0.6))],
            [Instance(number, np.eye(4)) for number in range(len(meshes))],
            lights=[Light("directional", (2.0, 2.0, 2.0), np.eye(4))],
            cameras=[Camera("eye", np.eye(4), fov_y=0.2)],
        )
    )


@pytest.mark.long
@pytest.mark.parametrize("pop_out", [0.2, 0.5, 0.8])
def test_a_picture_shows_the_share_before_the_lens_plane_that_was_asked_for(engine, pop_out):
    """Measured on what the display shows; the box around the scene is a hundred times as deep."""
    display = dataclasses.replace(DISPLAY, aperture_distance=250.0)
    options = api.PlacementOptions(place="camera", pop_out=pop_out)
    image = api.render(steps_scene(), display, placement=options, spp=1, integrator="direct", layers=True)
    depth = image.maps["depth"]
    status = np.isfinite(depth) & (image.maps["shape"] >= 0)
    z = depth[status]
    near, far = z.max(), np.quantile(z[z > -1e3], 0.02)
    assert near / (near - far) == pytest.approx(pop_out, abs=0.05)


def test_what_a_camera_sees_near_the_eye_is_not_cut_off(engine):
    options = api.PlacementOptions(place="camera")
    image = api.render(steps_scene(), DISPLAY, placement=options, spp=1, integrator="depth", method="full")
    assert any("the lens plane moved" in note for note in image.provenance.notes)
    assert (image.world_from_display[2, 3], 6.0) == pytest.approx((-6.2, 6.0), abs=0.05)


class TestFraming:
    """A home camera that may move: all of its picture is seen, and a scene within it is large."""

    CAMERA = Camera("home", np.eye(4), fov_y=0.6, focus_distance=20.0)
    DISPLAYS = ("looking-glass-portrait", "panel-4k", "print-60lpi", "mla-hexagonal")

    @staticmethod
    def seen(bounds, display, **options):
        """Extent of a scene on the panel, as the viewing point sees it, in shares of the panel: lowest and highest."""
        placed = place(bounds, display, cameras=[TestFraming.CAMERA], home_camera="home", **options)
        points = box_corners(bounds) @ placed.display_from_world[:3, :3].T + placed.display_from_world[:3, 3]
        places = points[:, :2] / (1 - points[:, 2:] / display.viewing_distance) / display.size_mm
        return places.min(axis=0), places.max(axis=0)

    @pytest.mark.parametrize("name", DISPLAYS)
    def test_a_part_of_the_picture_fills_the_panel(self, name):
        bounds = np.array([[1.0, 0.5, -20.5], [3.0, 1.5, -19.5]])
        low, high = self.seen(bounds, load_display(name), contains_home=True)
        assert (high - low).max() == pytest.approx(FILL, abs=0.005)
        assert low + high == pytest.approx([0, 0], abs=0.01)

    @pytest.mark.parametrize("name", DISPLAYS)
    def test_more_than_the_picture_shows_all_of_the_picture(self, name):
        reach = 20.0 * np.tan(0.3)
        picture = np.array([[-reach, -reach, -20.0], [reach, reach, -20.0]])
        beyond = np.array([[-30.0, -30.0, -20.0], [30.0, 30.0, -20.0]])
        display = load_display(name)
        low, high = self.seen(beyond, display, contains_home=True)
        shown = (high - low) * np.ptp(picture, axis=0)[:2] / np.ptp(beyond, axis=0)[:2]
        assert shown.max() <= 1 + 1e-9
        exact = self.seen(beyond, display)
        assert (high - low).max() <= (exact[1] - exact[0]).max() + 1e-9

    def test_a_placement_that_was_asked_for_is_kept(self):
        bounds, display = np.array([[1.0, 0.5, -20.5], [3.0, 1.5, -19.5]]), load_display("panel-4k")
        asked = PlacementOptions(camera="home")
        kept = self.seen(bounds, display, contains_home=True, options=asked)
        assert np.allclose(kept, self.seen(bounds, display, options=asked))

    @pytest.mark.parametrize("name", DISPLAYS)
    def test_what_is_enlarged_is_not_cut_open(self, name):
        """Recorded rays begin before all of it: a teapot had a hole on a print."""
        display = load_display(name)
        bounds = np.array([[-1.5, -1.5, -21.0], [1.5, 1.5, -19.7]])
        placed = place(bounds, display, cameras=[self.CAMERA], home_camera="home", contains_home=True)
        nearest = (box_corners(bounds) @ placed.display_from_world[:3, :3].T + placed.display_from_world[:3, 3])[
            :, 2
        ].max()
        assert nearest <= display.aperture_distance
        assert not [line for line in placed.warnings if "cut off" in line]
