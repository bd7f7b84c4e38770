"""Sequences: what stands still from frame to frame, what moves, and what is not compiled twice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lippmann import api
from lippmann.display import LensArray, Panel, load_display
from lippmann.errors import SceneError, UsageError
from lippmann.image import Provenance
from lippmann.image.preview import Preview
from lippmann.options.placement import PlacementOptions
from lippmann.options.scene import SceneOptions
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.placement import place
from lippmann.sequences.frames import (
    FrameRange,
    place_frames,
    render_frames,
    render_quilt_sequence,
    render_sequence,
)
from lippmann.sequences.motion import open_motion
from lippmann.sequences.turntable import open_turntable

BODY = "CAMERA ZOOM 1 ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH 2 CENTER 0 0 -5 VIEWDIR 0 0 1 UPDIR 0 1 0 END_CAMERA"
BALL = "SPHERE CENTER 0 0 0 RAD 1 TEXTURE AMBIENT 0.2 DIFFUSE 0.8 SPECULAR 0 OPACITY 1 COLOR 1 1 1 TEXFUNC 0"
#: Forward, then to the right, then a turn.
FLIGHT = "0 0 1 0 1 0 0 0 -5\n0 0 1 0 1 0 0.5 0 -5\n0.1 0 1 0 1 0 0.5 0 -5\n"


@pytest.fixture
def room(tmp_path):
    (tmp_path / "room.dat").write_text(f"BEGIN_SCENE RESOLUTION 64 64 {BODY} {BALL} END_SCENE")
    (tmp_path / "room.cam").write_text(FLIGHT)
    return tmp_path / "room.dat", tmp_path / "room.cam"


@pytest.fixture(scope="session")
def display():
    return load_display("seed-lenticular")


def test_a_display_that_does_not_follow_stands_still(moving_ball, display):
    motion = open_motion(moving_ball)
    where = place_frames(motion, display, PlacementOptions())
    first, middle = where(0), where(motion.count // 2)
    assert np.array_equal(first.world_from_display, middle.world_from_display)
    assert first.depth_range != middle.depth_range


def test_nothing_ever_leaves_the_depth_that_the_scene_is_fitted_to(moving_ball, display):
    motion = open_motion(moving_ball)
    fitted = place(motion.bounds(), display)
    where = place_frames(motion, display, PlacementOptions())
    for frame in range(motion.count):
        back, front = where(frame).depth_range
        assert fitted.depth_range[0] - 1e-6 <= back <= front <= fitted.depth_range[1] + 1e-6


def test_where_it_stands_does_not_hang_on_the_frame_rate(moving_ball, display):
    slow, fast = (place_frames(open_motion(moving_ball, fps=fps), display, PlacementOptions()) for fps in (5, 60))
    assert np.array_equal(slow.first, fast.first)


def test_a_flight_keeps_the_display_before_the_camera(room, display):
    motion = open_motion(room[0], camera_path=room[1])
    where = place_frames(motion, display, PlacementOptions())
    for frame in range(3):
        camera = motion.camera(frame, None)
        relative = np.linalg.inv(camera.world_from_camera) @ where(frame).world_from_display
        first = np.linalg.inv(motion.camera(0, None).world_from_camera) @ where(0).world_from_display
        assert relative == pytest.approx(first, abs=1e-9)
    assert where(1).world_from_display[0, 3] - where(0).world_from_display[0, 3] == pytest.approx(0.5)


def test_the_first_frame_of_a_flight_is_the_scene_seen_by_that_camera(room, display):
    """The path begins where the file's own camera stands."""
    flown = place_frames(open_motion(room[0], camera_path=room[1]), display, PlacementOptions())(0)
    scene = api.load_scene(room[0])
    still = place(scene.bounds, display, cameras=scene.cameras, home_camera=scene.home_camera)
    assert flown.world_from_display == pytest.approx(still.world_from_display, rel=1e-6)


def test_all_of_a_flight_is_comfortable_with_one_distance_between_the_eyes(room):
    """It was that of the first frame: what the camera left behind was too deep to look at."""
    (room[1]).write_text("0 0 1 0 1 0 0 0 -5\n0 0 1 0 1 0 0 0 -9\n0 0 1 0 1 0 0 0 -6\n")
    monitor, motion = load_display("odyssey-3d"), open_motion(room[0], camera_path=room[1])
    where = place_frames(motion, monitor, PlacementOptions())
    placements = [where(frame) for frame in range(3)]
    far, near = placements[0].depth_budget
    assert {each.eye_share for each in placements} == {where.eye_share}
    assert all(far <= each.depth_range[0] <= each.depth_range[1] <= near for each in placements)
    # No closer than the deepest frame asks for.
    assert placements[1].depth_range[0] == pytest.approx(far, rel=0.1)
    assert place_frames(motion, monitor, PlacementOptions(depth_scale=1.0)).eye_share == 1.0


def test_a_camera_of_the_file_is_followed(moving_ball, display):
    motion = open_motion(moving_ball)
    where = place_frames(motion, display, PlacementOptions(camera="eye"))
    moved = where(24).world_from_display[:3, 3] - where(0).world_from_display[:3, 3]
    assert moved == pytest.approx([1, 0, 0], abs=1e-6)


def test_a_frame_is_read_once_in_a_row(moving_ball):
    motion = open_motion(moving_ball)
    frame = motion.scene(3)
    assert motion.scene(3) is frame
    assert motion.scene(4).bounds[0, 0] != frame.bounds[0, 0]


@pytest.mark.long
def test_a_frame_alone_is_the_same_as_among_others(engine, moving_ball):
    motion = open_motion(moving_ball)
    options = {"integrator": "direct", "spp": 1, "device": "cpu"}
    among = dict(render_sequence(motion, frames=FrameRange(0, 3), **options))
    (alone,) = (image for _, image in render_sequence(motion, frames=[2], **options))
    assert np.array_equal(among[2].pixels, alone.pixels)
    assert not np.array_equal(among[2].pixels, among[0].pixels)
    assert among[2].provenance.options["frame"] == 2


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["animation", "flight"])
def test_nothing_is_compiled_for_later_frames(engine, moving_ball, room, kind, monkeypatch):
    import drjit as dr

    from lippmann.rendering.film import sample_batches

    motion = open_motion(moving_ball) if kind == "animation" else open_motion(room[0], camera_path=room[1])
    options = {"integrator": "direct", "method": "full"} if kind == "animation" else {}
    kernels: list[set[object]] = []

    def look(started: float) -> float:
        kernels[-1] |= {kernel["hash"] for kernel in dr.kernel_history() if "hash" in kernel}
        return 0.0

    monkeypatch.setattr(sample_batches, "measure_compilation", look)
    images = render_sequence(motion, frames=[0, 1, 2], spp=2, device="cpu", **options)
    for _ in range(3):
        kernels.append(set())
        next(images)
    assert kernels[2]
    assert kernels[2] <= kernels[0] | kernels[1]


@pytest.mark.slow
@pytest.mark.parametrize("form", ["display", "quilt"])
def test_windows_of_any_size_and_displays_share_kernels(engine, display, form, monkeypatch):
    """What is traced of a frame is the part in which the scene can be seen, wider or narrower as it turns."""
    import drjit as dr

    from lippmann.rendering.film import sample_batches, wavefront

    for module in (sample_batches, wavefront):
        monkeypatch.setattr(module, "measure_compilation", lambda started: 0.0)
    motion = open_turntable(api.load_scene("teapot"), 48)
    options = {"integrator": "path", "spp": 2, "device": "cpu"}
    other = replace(display, panel=Panel(140, 90, 0.15), lens_array=LensArray("lenticular", 1.04), gap=3.7)
    if form == "display":
        films = [
            render_sequence(motion, display.resized(256, 256), [0, 8], **options),
            render_sequence(motion, other, [0], **options),
        ]
    else:
        films = [
            render_quilt_sequence(motion, display, [0, 8], views=(3, 1), size=(384, 256), **options),
            render_quilt_sequence(motion, other, [0], views=(2, 1), size=(256, 256), **options),
        ]
    kernels, rays = [], []
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        for film in films:
            dr.kernel_history_clear()
            for _, picture in film:
                rays.append(picture.provenance.rays["primary"])
                kernels.append({kernel["hash"] for kernel in dr.kernel_history() if "hash" in kernel})
                dr.kernel_history_clear()
    assert len(set(rays)) == 3
    assert kernels[2]
    assert kernels[2] <= kernels[0] | kernels[1]


def test_every_frame_is_rendered_as_was_asked_for(moving_ball, display):
    """The first one may have had fog, or time for one sample; that says nothing of the others."""
    motion, asked = open_motion(moving_ball), []

    class Form:
        def render(self, scene, display, request, progress, build):
            asked.append((request.method, request.denoise))
            return Preview(np.zeros((2, 2, 3), np.float32), Provenance(method="full"))

    where = place_frames(motion, display, PlacementOptions())
    list(render_frames(motion, display, [0, 1, 2], where, RenderRequest(), Form(), lambda _: None))
    assert asked == [("auto", "auto")] * 3


def seeds(motion, frames, **options):
    asked = []

    class Form:
        def render(self, scene, display, request, progress, build):
            asked.append((request.seed, request.fixed_noise))
            return Preview(np.zeros((2, 2, 3), np.float32), Provenance(method="full"))

    display = load_display("seed-lenticular")
    where = place_frames(motion, display, PlacementOptions())
    list(render_frames(motion, display, frames, where, RenderRequest(spp=1, **options), Form(), lambda _: None))
    return asked


def test_each_frame_has_noise_of_its_own_by_its_number_alone(moving_ball):
    motion = open_motion(moving_ball)
    every = seeds(motion, range(25))
    assert len(set(every)) == 25
    assert not any(is_fixed for _, is_fixed in every)
    assert seeds(motion, [7, 3]) == [every[7], every[3]]
    assert not set(every) & set(seeds(motion, range(25), seed=1))


def test_noise_can_be_held_still(moving_ball):
    assert seeds(open_motion(moving_ball), range(3), seed=5, fixed_noise=True) == [(5, False)] * 3


def test_one_picture_has_no_noise_to_hold_still():
    with pytest.raises(UsageError, match="fixed_noise: this is one picture"):
        api.render("teapot", spp=1, fixed_noise=True)


@pytest.mark.parametrize(
    ("first", "stop", "step", "wanted"),
    [(0, 3, 1, [0, 1, 2]), (0, None, 10, [0, 10, 20]), (24, None, 1, [24]), (1, 8, 3, [1, 4, 7])],
)
def test_ranges(moving_ball, first, stop, step, wanted):
    assert list(FrameRange(first, stop, step).of(open_motion(moving_ball))) == wanted


@pytest.mark.parametrize(("first", "stop"), [(0, 26), (25, None), (99, 100)])
def test_frames_beyond_the_end_are_refused(moving_ball, first, stop):
    with pytest.raises(UsageError, match="there are 25, counted from 0"):
        FrameRange(first, stop).of(open_motion(moving_ball))


@pytest.mark.parametrize(("first", "stop", "step"), [(3, 3, 1), (4, 2, 1), (0, 4, 0), (-1, 3, 1)])
def test_empty_ranges_are_refused(first, stop, step):
    with pytest.raises(UsageError, match="FIRST:STOP"):
        FrameRange(first, stop, step)


def test_contradictions_are_refused(moving_ball, room, display):
    flight = open_motion(room[0], camera_path=room[1])
    with pytest.raises(UsageError, match="beside a flight"):
        place_frames(flight, display, PlacementOptions(place="fit"))
    with pytest.raises(UsageError, match="beside a path"):
        place_frames(flight, display, PlacementOptions(camera="x"))
    with pytest.raises(SceneError, match="unknown camera 'x'"):
        place_frames(open_motion(moving_ball), display, PlacementOptions(camera="x"))
    with pytest.raises(UsageError, match="one pose a frame"):
        open_motion(room[0], camera_path=room[1], animation="x")
    with pytest.raises(UsageError, match="a camera path leads through"):
        open_motion(moving_ball, camera_path=room[1])
    with pytest.raises(UsageError, match="nothing moves in 'teapot'"):
        open_motion("teapot")
    with pytest.raises(UsageError, match="frames per second"):
        open_motion(moving_ball, fps=0.0)


def test_surroundings_hold_for_all_frames(moving_ball):
    motion = open_motion(moving_ball, asked=SceneOptions(environment="none", background=(0.1, 0.2, 0.3)))
    assert [motion.scene(frame).background for frame in (0, 9)] == [(0.1, 0.2, 0.3)] * 2
    assert not motion.scene(9).in_studio
