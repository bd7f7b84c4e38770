"""Turntables: one placement for all angles, light that stands still, and frames that are the scene turned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import lippmann
from lippmann.display import load_display
from lippmann.errors import PictureError, UsageError
from lippmann.options.placement import PlacementOptions
from lippmann.quilts.quilt import quilt_of_display
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.matrices import inverse, transform_points
from lippmann.scene.values.description import Instance, Light, Material, Mesh, SceneDescription
from lippmann.sequences.files import save_sequence
from lippmann.sequences.forms import QuiltForm
from lippmann.sequences.frames import place_frames, render_sequence
from lippmann.sequences.turntable import Turntable, open_turntable

QUICK = {"integrator": "direct", "spp": 4, "device": "cpu", "tone_map": "none"}


@pytest.fixture(scope="module")
def display():
    return load_display("seed-lenticular").resized(128, 128)


def ball(segments=16):
    """A matte ball of radius 1 that a turn by a segment leaves as it is."""
    rows = segments // 2 + 1
    theta, phi = np.linspace(0, np.pi, rows), np.linspace(0, 2 * np.pi, segments, endpoint=False)
    sine = np.sin(theta)[:, None]
    y = np.broadcast_to(np.cos(theta)[:, None], (rows, segments))
    points = np.stack([sine * np.sin(phi), y, sine * np.cos(phi)], axis=-1).reshape(-1, 3).astype(np.float32)
    faces = []
    for row in range(rows - 1):
        for column in range(segments):
            a, b = row * segments + column, row * segments + (column + 1) % segments
            faces += [(a, a + segments, b), (b, a + segments, b + segments)]
    return Mesh("ball", points, np.array(faces, np.uint32), 0, normals=points)


def block():
    """A box of 4 x 1 x 2 about (2, 3, 1)."""
    corners = np.array([[x, y, z] for x in (0, 4) for y in (2.5, 3.5) for z in (0, 2)], np.float32)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))]
    return Mesh("block", corners, np.array(faces, np.uint32), 0)


def scene_of(mesh, **more):
    description = SceneDescription(
        "x", [mesh], [Material(double_sided=True)], [Instance(0, np.eye(4))], background=(0.0, 0.0, 0.0), **more
    )
    return lippmann.load_scene(description)


SIDE_LIGHT = Light("point", (80.0, 80.0, 80.0), np.array([[1, 0, 0, 6], [0, 1, 0, 4], [0, 0, 1, 6], [0, 0, 0, 1.0]]))


def corners_before(motion, where, frame):
    return motion.scene(frame).bounds_in(where(frame).display_from_world)


@pytest.mark.slow
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (33.0, 0.0, 0.0), (0.0, -90.0, 0.0), (20.0, 25.0, 0.0)])
@pytest.mark.parametrize("swing", [None, 70.0])
def test_one_placement_holds_the_scene_at_all_angles(display, turn, swing):
    options = PlacementOptions(turn=turn)
    motion = open_turntable(scene_of(block()), 24, swing=swing, placement=options)
    where = place_frames(motion, display, options)
    boxes = np.array([corners_before(motion, where, frame) for frame in range(24)])
    for frame in range(24):
        # The display goes round the scene as the scene would have turned before it.
        turned = inverse(motion.display_turn(frame)) @ where(frame).world_from_display
        assert turned == pytest.approx(where.first, abs=1e-9)
    # Round, tilted or swinging: what is swept is in the middle, across and in height.
    assert (boxes[:, 0, :2].min(axis=0) + boxes[:, 1, :2].max(axis=0)) == pytest.approx(0.0, abs=0.25)
    assert (np.abs(boxes[..., :2]) <= np.array(display.size_mm) / 2).all()
    # Nothing more than what is swept was made room for, whatever the yaw.
    plain = place_frames(motion, display, replace(options, turn=(0.0, *turn[1:])))
    scales = [np.linalg.norm(stand.first[:3, 0]) for stand in (where, plain)]
    assert swing is not None or scales[0] == pytest.approx(scales[1], rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("frame", [0, 1, 3])
def test_a_frame_is_the_scene_turned(engine, display, frame):
    """Frame k of N, as a picture of a scene whose vertices were turned by hand."""
    scene = scene_of(block(), lights=[SIDE_LIGHT])
    motion = open_turntable(scene, 8)
    ((_, image),) = render_sequence(motion, display, [frame], fixed_noise=True, **QUICK)
    angle = np.radians(360.0 * frame / 8)
    x, y, z = (block().positions.astype(np.float64) - (2.0, 3.0, 1.0)).T
    turned = np.stack([x * np.cos(angle) + z * np.sin(angle), y, z * np.cos(angle) - x * np.sin(angle)], axis=1)
    mesh = replace(block(), positions=(turned + np.array([2.0, 3.0, 1.0])).astype(np.float32))
    placed = place_frames(motion, display, PlacementOptions())(0)
    expected = lippmann.render(scene_of(mesh, lights=[SIDE_LIGHT]), display, placement=placed, **QUICK)
    assert expected.pixels.max() > 0.05
    # Edges may fall to the other side by rounding.
    assert np.mean(np.abs(image.pixels - expected.pixels).max(axis=-1) > 1e-3) < 2e-3
    border = np.concatenate([image.pixels[[0, -1]].ravel(), image.pixels[:, [0, -1]].ravel()])
    assert border.max() == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("lit", ["light", "studio"])
def test_light_stands_still(engine, display, lit):
    """A matte ball looks the same at all angles, and is lit from one side."""
    scene = scene_of(ball(), lights=[SIDE_LIGHT] if lit == "light" else [])
    motion = open_turntable(scene, 16)
    frames = [image.pixels for _, image in render_sequence(motion, display, [0, 3, 8], fixed_noise=True, **QUICK)]
    half = frames[0].shape[1] // 2
    left, right = frames[0][:, :half].mean(), frames[0][:, half:].mean()
    assert abs(left - right) > 0.1 * max(left, right)
    for other in frames[1:]:
        assert np.mean(np.abs(other - frames[0])) < 1e-4 * frames[0].mean()


def test_classic_light_stands_still_too(engine, display, tmp_path):
    """The display goes round the balls with the light: the picture of balls that were moved by hand."""

    def room(name, *centers):
        camera = (
            "CAMERA ZOOM 1 ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH 2 CENTER 0 0 -5 VIEWDIR 0 0 1 UPDIR 0 1 0 END_CAMERA"
        )
        texture = "TEXTURE AMBIENT 0.1 DIFFUSE 0.9 SPECULAR 0 OPACITY 1 COLOR 1 1 1 TEXFUNC 0"
        balls = " ".join(f"SPHERE CENTER {x} 0 {z} RAD 0.5 {texture}" for x, z in centers)
        light = "LIGHT CENTER 6 4 -8 RAD 0.1 COLOR 1 1 1"
        path = tmp_path / name
        path.write_text(f"BEGIN_SCENE RESOLUTION 64 64 {camera} {light} {balls} END_SCENE")
        return lippmann.load_scene(path)

    # Of the world, whose z is Tachyon's negated: (2, 0, 0) goes to (0, 0, -2), which is behind.
    still, turned = room("a.dat", (2, 0), (-2, 0)), room("b.dat", (0, 2), (0, -2))
    motion = open_turntable(still, 4)
    where = place_frames(motion, display, PlacementOptions())
    ((_, image),) = render_sequence(motion, display, [1], device="cpu")
    expected = lippmann.render(turned, display, placement=where(0), device="cpu")
    assert np.ptp(expected.pixels) > 0.3
    assert np.mean(np.abs(image.pixels - expected.pixels).max(axis=-1) > 2e-3) < 2e-3
    assert not np.array_equal(where(1).world_from_display, where(0).world_from_display)


def test_a_swing_is_smooth_and_closed():
    motion = Turntable(scene_of(block()), 8, swing=40.0)
    angles = [motion.angle(frame) for frame in range(9)]
    assert angles[:5] == pytest.approx([0.0, 14.142, 20.0, 14.142, 0.0], abs=1e-3)
    assert (min(angles), angles[8]) == pytest.approx((-20.0, 0.0))


@pytest.mark.slow
def test_exposure_is_held(engine, display):
    """Whatever frame is rendered first."""
    from lippmann.rendering import picture

    scene = scene_of(block(), lights=[SIDE_LIGHT])
    scene = replace(scene, description=replace(scene.description, physical_lights=True))
    motion = open_turntable(scene, 4)
    where = place_frames(motion, display, PlacementOptions())
    request = RenderRequest(**QUICK, placement=where(0))
    exposure = picture.choose_exposure(motion.scene(0), display, request)
    images = dict(render_sequence(motion, display, [1, 2], **QUICK))
    fixed = dict(render_sequence(motion, display, [1, 2], exposure=exposure, **QUICK))
    assert exposure != 0.0
    assert all(np.array_equal(images[frame].pixels, fixed[frame].pixels) for frame in (1, 2))


@pytest.mark.slow
def test_unfinished_quilts_are_gone_on_with(engine, display, tmp_path):
    motion = open_turntable(scene_of(block(), lights=[SIDE_LIGHT]), 3)

    def run(folder, most, size=(300, 256), **options):
        came = []
        form = QuiltForm(quilt_of_display(display, (3, 1), size))
        ending = form.quilt.layout.ending
        request = RenderRequest(**QUICK)
        output = folder / f"q_%d{ending}.png"
        folder.mkdir(exist_ok=True)
        with save_sequence(
            motion, output, lambda k: folder / f"q_{k}{ending}.png", display, range(3), request, form=form, **options
        ) as saved:
            for frame in saved:
                came.append(frame.resumed)
                if len(came) == most:
                    break
        return came

    run(tmp_path / "whole", 3)
    run(tmp_path / "broken", 2)
    with pytest.raises(PictureError, match=r"the quilt \(was 3x1 views, 300x256"):
        run(tmp_path / "broken", 3, size=(312, 256), resume=True)
    assert run(tmp_path / "broken", 3, resume=True) == [True, True, False]
    whole, broken = ({path.name: path.read_bytes() for path in (tmp_path / n).iterdir()} for n in ("whole", "broken"))
    assert len(whole) == 3
    assert whole == {name: data for name, data in broken.items() if name in whole}


def test_a_camera_that_places_the_display_cuts_nothing_off(display):
    teapot = lippmann.load_scene("teapot")
    options = PlacementOptions(place="camera")
    motion = open_turntable(teapot, 8, placement=options)
    where = place_frames(motion, display, options)
    fronts = [where(frame).depth_range[1] for frame in range(8)]
    assert max(fronts) <= display.aperture_distance
    assert "the lens plane moved" in where(0).warnings[0]


@pytest.mark.slow
def test_progress_never_runs_backwards(engine, display):
    reports = []
    motion = open_turntable(scene_of(block(), lights=[SIDE_LIGHT]), 3)
    list(render_sequence(motion, display, range(3), progress=reports.append, layers=True, **QUICK))
    done = [report.done for report in reports]
    assert done == sorted(done)
    assert done[-1] == 3


@pytest.mark.slow
def test_the_call_renders_a_whole_turn(engine, display):
    images = list(lippmann.render_turntable(scene_of(block(), lights=[SIDE_LIGHT]), display, 3, spp=1, device="cpu"))
    assert len(images) == 3
    assert not np.array_equal(images[0].world_from_display, images[1].world_from_display)
    assert not np.array_equal(images[0].pixels, images[1].pixels)


@pytest.mark.parametrize(("count", "swing"), [(1, None), (0, None), (8, 0.0), (8, 361.0), (8, float("nan"))])
def test_what_is_no_turn_is_refused(count, swing):
    with pytest.raises(UsageError, match=r"frames of a turn|at most 360 degrees"):
        Turntable(scene_of(block()), count, swing=swing)


def test_the_display_goes_round_the_middle():
    scene = scene_of(block())
    turn = Turntable(scene, 6).display_turn(1)
    middle = scene.bounds.mean(axis=0)[None]
    assert transform_points(turn, middle) == pytest.approx(middle)
    assert np.linalg.det(turn[:3, :3]) == pytest.approx(1.0)


def test_a_scene_of_mitsubas_turns_with_its_light_and_says_so(engine, display):
    cube = {"type": "cube", "bsdf": {"type": "diffuse"}}
    light = {"type": "point", "position": [4.0, 5.0, 6.0], "intensity": 60.0}
    motion = open_turntable(lippmann.load_scene({"type": "scene", "cube": cube, "light": light}), 4)
    first, second = (image for _, image in render_sequence(motion, display, [0, 1], **QUICK))
    assert "the light sources of a Mitsuba scene turn with it" in first.provenance.notes
    # Its right side comes to the front, with the light on it.
    assert min(first.pixels.max(), second.pixels.max()) > 0.05
    assert not np.array_equal(first.pixels, second.pixels)
