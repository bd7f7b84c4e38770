"""What the panel's edge cuts in front of the lens plane is said, by rays along the edge."""

import re
from dataclasses import replace

import numpy as np
import pytest

import lippmann
from lippmann.display import load_display
from lippmann.options.placement import PlacementOptions
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import open_session
from lippmann.scene.values.description import Camera, Instance, Material, Mesh, SceneDescription
from lippmann.scene.values.splats import Splats
from lippmann.scene.values.volume import TransferFunction, Volume
from lippmann.sequences.frames import place_frames
from lippmann.sequences.turntable import Turntable, open_turntable

pytestmark = pytest.mark.usefixtures("engine")

#: 21 mm wide and high, seen from 300 mm; points move by half their height to either side, 5 mm over the lens plane by
#: twice a lens.
DISPLAY = replace(load_display("mla-square").resized(320, 320), viewing_distance=300.0, aperture_distance=40.0)
HALF = DISPLAY.size_mm[0] / 2
FRONT = 20.0


def card(x, y, z, half=4.0):
    """A square across the view."""
    corners = [(x - half, y - half, z), (x + half, y - half, z), (x + half, y + half, z), (x - half, y + half, z)]
    return np.float32(corners)


def wall(x, near, far):
    """A wall along the view, as high as can be."""
    return np.float32([(x, -999, far), (x, -999, near), (x, 999, near), (x, 999, far)])


def scene(*quads, cameras=()):
    return SceneDescription(
        "cards",
        [Mesh("", corners, np.uint32([(0, 1, 2), (0, 2, 3)]), 0) for corners in quads],
        [Material(base_color=(0.6, 0.6, 0.6))],
        [Instance(number, np.eye(4)) for number in range(len(quads))],
        cameras=list(cameras),
    )


def warnings(*quads, cameras=(), **placement):
    request = RenderRequest(placement=PlacementOptions(**({"place": "display"} | placement)))
    placed = open_session(lippmann.load_scene(scene(*quads, cameras=cameras)), request).place(DISPLAY)
    return [line for line in placed.warnings if "panel's edge cuts" in line]


def test_an_object_in_front_that_an_edge_cuts_is_said_with_the_way_out():
    (line,) = warnings(card(HALF, 0.0, FRONT))
    assert line.startswith("the panel's edge cuts what stands up to 20 mm in front of it (")
    assert "(right 4" in line
    assert line.endswith("shift=0,0,-20 sets it behind")
    assert not warnings(card(HALF, 0.0, FRONT), shift=(0.0, 0.0, -20.0))


def test_the_share_of_the_edge_is_that_which_the_object_covers():
    (line,) = warnings(card(0.0, HALF, FRONT, half=8.0))
    # Seen from the viewing point it is larger by D / (D - z).
    share = 16.0 / (2.0 * HALF) / (1.0 - FRONT / 300.0)
    told = re.search(r"top ([0-9]+) %", line)
    assert float(told[1]) == pytest.approx(100 * share, abs=1.0)


@pytest.mark.parametrize("z", [0.5, -20.0])
def test_what_stands_at_the_panel_or_behind_it_may_be_cut(z):
    assert not warnings(card(HALF, 0.0, z), card(0.0, 0.0, FRONT))


def test_what_stands_in_front_within_all_views_is_whole():
    assert not warnings(card(0.0, 0.0, FRONT))


def test_an_outermost_view_cuts_what_the_middle_one_shows_whole():
    beyond = HALF - 4.0 - 3.0
    assert (beyond + 4.0) / (1.0 - FRONT / 300.0) < HALF
    assert warnings(card(beyond, 0.0, FRONT))


def test_walls_of_a_room_that_pass_the_edge_behind_the_panel_are_a_frame():
    """The room around reaches the eye, so that its box is cut on all sides."""
    room = wall(-HALF - 40.0, 250.0, -100.0), wall(HALF + 40.0, 250.0, -100.0)
    assert not warnings(*room, card(0.0, 0.0, FRONT))
    assert warnings(wall(HALF, 30.0, -100.0))


def test_a_camera_has_another_way_out():
    eye = Camera(
        "eye", np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 300.0], [0, 0, 0, 1]]), fov_y=0.2, focus_distance=300.0
    )
    quads = card(HALF, 0.0, FRONT), card(0.0, 0.0, -30.0, half=200.0)
    (line,) = warnings(*quads, cameras=[eye], place="camera", camera="eye")
    assert "pop_out=0 or shift=0,0,-20 sets it behind" in line
    assert not warnings(*quads, cameras=[eye], place="camera", camera="eye", pop_out=0.0)


def test_a_fitted_scene_is_cut_only_where_it_is_enlarged_or_moved():
    assert not warnings(card(0.0, 0.0, 9.0), card(0.0, 0.0, -9.0), place="fit")
    assert warnings(card(0.0, 0.0, 9.0), card(0.0, 0.0, -9.0), place="fit", scale=1.5)


def test_pictures_say_it():
    options = PlacementOptions(place="display")
    image = lippmann.render(scene(card(HALF, 0.0, FRONT)), DISPLAY, placement=options, spp=1, integrator="normal")
    assert any("the panel's edge cuts" in note for note in image.provenance.notes)


def cloud(x, y, z, opacity=0.99):
    """Gaussians of 0.5 mm that fill a square of 8 mm across the view."""
    places = np.arange(-4.0, 4.01, 0.5)
    across, up = (axis.ravel() for axis in np.meshgrid(places, places))
    centers = np.stack([across + x, up + y, np.full_like(up, z)], axis=1).astype(np.float32)
    count = len(centers)
    return Splats(
        centers,
        np.full((count, 3), 0.25, np.float32),
        np.tile(np.float32([0, 0, 0, 1]), (count, 1)),
        np.full(count, opacity, np.float32),
        np.zeros((count, 1, 3), np.float32),
    )


def slab(x, y, z, opacity):
    """A volume of 8 x 8 x 4 mm whose front is at ``z``."""
    where = np.array([[4.0, 0, 0, x - 2], [0, 4, 0, y - 2], [0, 0, 1, z - 3.5], [0, 0, 0, 1]])
    shown = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.full(2, opacity), shading=0.0)
    return Volume(np.zeros((4, 2, 2), np.int16), where, shown)


@pytest.mark.parametrize(
    ("more", "height", "near"),
    [
        ({"splats": cloud(HALF, 0.0, FRONT)}, FRONT, 0.5),
        # Each millimetre lets half of the light through.
        ({"volume": slab(HALF, 0.0, FRONT, 0.5)}, FRONT - 1.0, 0.3),
        ({"splats": cloud(HALF, 0.0, FRONT, opacity=0.02)}, None, 0.0),
        ({"volume": slab(HALF, 0.0, FRONT, 0.05)}, None, 0.0),
        ({"splats": cloud(0.0, 0.0, FRONT)}, None, 0.0),
        ({"volume": slab(HALF, 0.0, -5.0, 0.5)}, None, 0.0),
    ],
    ids=["splats", "volume", "faint splats", "faint volume", "splats in the middle", "volume behind"],
)
def test_splats_and_volumes_are_cut_as_meshes_are(more, height, near):
    request = RenderRequest(placement=PlacementOptions(place="display"))
    described = replace(scene(card(0.0, 0.0, -30.0)), **more)
    placed = open_session(lippmann.load_scene(described, environment="none"), request).place(DISPLAY)
    lines = [line for line in placed.warnings if "panel's edge cuts" in line]
    if height is None:
        assert not lines
    else:
        (line,) = lines
        assert float(re.search(r"up to ([\d.]+) mm", line)[1]) == pytest.approx(height, abs=near)
        assert "(right 3" in line or "(right 4" in line


def cuts(motion, options, frames):
    """What the frames of a sequence say."""
    where = place_frames(motion, DISPLAY, options)
    for frame in frames:
        session = open_session(motion.scene(frame), RenderRequest(placement=where(frame)))
        yield any("panel's edge cuts" in line for line in session.place(DISPLAY).warnings)


def test_a_sequence_says_it_of_the_frames_that_it_is_true_of():
    """An arm that comes out of the panel's edge only where it is turned to the side."""
    arm = lippmann.load_scene(scene(card(0.0, 0.0, FRONT, half=2.0), card(0.0, 0.0, -FRONT, half=2.0)))
    options = PlacementOptions(place="display")
    motion = Turntable(arm, 4, swing=80.0)
    shown = list(cuts(motion, options, range(4)))
    assert shown == [False, True, False, True]


def test_a_fitted_model_is_whole_in_all_frames_of_a_turn():
    bars = scene(card(0.0, 0.0, 2.0, half=3.0), wall(5.0, 6.0, -6.0) / np.float32([1, 999, 1]))
    for options in (PlacementOptions(), PlacementOptions(turn=(0.0, 25.0, 0.0))):
        motion = open_turntable(lippmann.load_scene(bars), 6, placement=options)
        assert not any(cuts(motion, options, range(6)))
    assert any(cuts(motion, PlacementOptions(scale=2.0, shift=(0.0, 0.0, 8.0)), range(6)))
