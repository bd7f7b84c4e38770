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
