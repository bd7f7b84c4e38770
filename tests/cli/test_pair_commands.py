"""Pictures and films for eye-tracked monitors, read again by Pillow and FFmpeg: which eye is where, and how deep."""

from __future__ import annotations

import re

import numpy as np
import pytest
from PIL import Image

from lippmann.display import load_display

pytestmark = [pytest.mark.usefixtures("engine"), pytest.mark.slow]

#: Where two balls stand in the frame of the display, mm, and their colours: red 60 in front, blue 100 behind.
BALLS = {"red": (-60.0, 10.0, 60.0), "blue": (70.0, -20.0, -100.0)}


@pytest.fixture(scope="module")
def balls(tmp_path_factory):
    import trimesh

    scene = trimesh.Scene()
    for color, place in BALLS.items():
        ball = trimesh.creation.icosphere(3, 12.0)
        ball.apply_translation(place)
        tint = [255 * (color == "red"), 0, 255 * (color == "blue"), 255]
        ball.visual = trimesh.visual.TextureVisuals(
            material=trimesh.visual.material.PBRMaterial(baseColorFactor=tint, metallicFactor=0.0)
        )
        scene.add_geometry(ball)
    path = tmp_path_factory.mktemp("balls") / "balls.glb"
    path.write_bytes(trimesh.exchange.gltf.export_glb(scene))
    return path


def places(picture, color):
    """Column and row of the middle of what is red or blue, in pixels."""
    values = np.asarray(picture, float)
    channel = {"red": 0, "blue": 2}[color]
    is_there = values[..., channel] > values.sum(axis=-1) - values[..., channel] + 30
    rows, columns = np.nonzero(is_there)
    return columns.mean() + 0.5, rows.mean() + 0.5


@pytest.mark.parametrize(
    ("target", "size", "ending"), [("odyssey-3d", "960x540", "_half_2x1"), ("displayxr", "960x270", "_2x1")]
)
def test_each_eye_sees_the_panel_from_its_own_place(lippmann, balls, tmp_path, target, size, ending):
    words = ("--place", "display", "--integrator", "albedo", "--spp", 4, "--threads", 1, "--quiet")
    done = lippmann("quilt", "render", balls, "--target", target, "--size", size, *words, "-o", tmp_path / "seen.png")
    assert done.code == 0, done.err
    display = load_display(target)
    with Image.open(tmp_path / f"seen{ending}.png") as pair:
        width, height = pair.width // 2, pair.height
        halves = {-1: pair.crop((0, 0, width, height)), 1: pair.crop((width, 0, 2 * width, height))}
        found = {(side, color): places(half, color) for side, half in halves.items() for color in BALLS}
    panel_width, panel_height = display.size_mm
    for color, (x, y, z) in BALLS.items():
        for side in (-1, 1):
            eye, distance = side * display.stereo.eyes / 2, display.viewing_distance
            # Where the line from the eye to the ball's middle meets the panel.
            at = eye + (x - eye) * distance / (distance - z), y * distance / (distance - z)
            column, row = (at[0] / panel_width + 0.5) * width, (0.5 - at[1] / panel_height) * height
            assert found[side, color] == pytest.approx((column, row), abs=1.0)
    # Crossed in front of the panel, uncrossed behind it.
    assert found[-1, "red"][0] > found[1, "red"][0] + 2
    assert found[-1, "blue"][0] < found[1, "blue"][0] - 2


def test_a_camera_of_a_deep_scene_takes_both_pictures_from_closer_places(lippmann, balls, tmp_path):
    import trimesh

    scene = trimesh.load(balls)
    scene.camera = trimesh.scene.Camera(resolution=(1600, 900), fov=(53, 31))
    scene.camera_transform = trimesh.transformations.translation_matrix((0.0, 0.0, 580.0))
    (tmp_path / "seen.glb").write_bytes(trimesh.exchange.gltf.export_glb(scene))
    # Without a focus, the middle of the scene lies in the lens plane, 600 mm from the camera.
    words = ("--place", "camera", "--shift", "0,0,-250", "--integrator", "albedo", "--spp", 4, "--threads", 1)
    words += "--target", "odyssey-3d", "--size", "960x540", "-o", tmp_path / "seen.png"
    done = lippmann("quilt", "render", tmp_path / "seen.glb", *words)
    assert done.code == 0, done.err
    apart = float(re.search(r"the two pictures are taken ([\d.]+) mm apart instead of 63", done.err)[1])
    assert 20 < apart < 40
    assert "comfortable to look at" not in done.err
    display = load_display("odyssey-3d")
    with Image.open(tmp_path / "seen_half_2x1.png") as pair:
        halves = {-1: pair.crop((0, 0, 480, 540)), 1: pair.crop((480, 0, 960, 540))}
        found = {(side, color): places(half, color) for side, half in halves.items() for color in BALLS}
    for color, (x, _, world) in BALLS.items():
        z = world + 20 - 250
        for side in (-1, 1):
            at = side * apart / 2 + (x - side * apart / 2) * 600 / (600 - z)
            assert found[side, color][0] == pytest.approx((at / display.size_mm[0] + 0.5) * 480, abs=0.6)


def test_our_own_reader_knows_the_eyes(lippmann, balls, tmp_path):
    words = ("--integrator", "albedo", "--spp", 1, "--threads", 1, "--quiet", "-o", tmp_path / "seen.png")
    assert lippmann("quilt", "render", balls, "-d", "odyssey-3d", "--size", "480x270", *words).code == 0
    pair = tmp_path / "seen_half_2x1.png"
    done = lippmann("quilt", "unpack", pair, "-o", tmp_path / "eyes", "--json")
    assert done.json["views"] == 2
    whole = np.asarray(Image.open(pair))
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "eyes" / "view_0.png")), whole[:, :240])
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "eyes" / "view_1.png")), whole[:, 240:])
    # A name alone says the same: views of half width are to be shown at twice of it.
    bare = tmp_path / "bare_half_2x1.png"
    Image.fromarray(whole).save(bare)
    assert "2x1 of 240x270 pixels, aspect 1.77778" in lippmann("info", bare).out


def test_a_photographed_pair_becomes_a_pair_for_a_monitor(lippmann, tmp_path):
    left, right = (Image.new("RGB", (320, 256), color) for color in ("red", "blue"))
    left.save(tmp_path / "seen.mpo", save_all=True, append_images=[right])
    done = lippmann("quilt", "pack", tmp_path / "seen.mpo", "-o", tmp_path / "seen_2x1.png")
    assert done.code == 0, done.err
    with Image.open(tmp_path / "seen_2x1.png") as made:
        assert made.size == (640, 256)
        assert made.getpixel((100, 100))[0] > 240 > 20 > made.getpixel((100, 100))[2]
        assert made.getpixel((500, 100))[2] > 240 > 20 > made.getpixel((500, 100))[0]
    done = lippmann("quilt", "pack", tmp_path / "seen.mpo", "-o", tmp_path / "seen_half_2x1.png")
    assert done.code == 0, done.err
    with Image.open(tmp_path / "seen_half_2x1.png") as made:
        assert made.size == (320, 256)
        assert made.getpixel((150, 100))[0] > 240 > 20 > made.getpixel((150, 100))[2]
        assert made.getpixel((170, 100))[2] > 240 > 20 > made.getpixel((170, 100))[0]
    assert "2x1 of 160x256 pixels, aspect 1.25" in lippmann("info", tmp_path / "seen_half_2x1.png").out
    done = lippmann("quilt", "pack", tmp_path / "seen.mpo", "-o", tmp_path / "seen_qs3x1a1.png")
    assert (done.code, "the name says 3x1" in done.err) == (2, True)


def test_the_second_view_of_a_pair_is_fitted_to_the_first(lippmann, tmp_path):
    """It was refused with the advice to say a fit, which the command does not take."""
    left, right = (Image.new("RGB", size, color) for size, color in (((320, 256), "red"), ((160, 256), "blue")))
    left.save(tmp_path / "seen.mpo", save_all=True, append_images=[right])
    done = lippmann("quilt", "pack", tmp_path / "seen.mpo", "-o", tmp_path / "seen_2x1.png")
    assert done.code == 0, done.err
    assert "differ in size: the right one is fitted to the left one" in done.err
    with Image.open(tmp_path / "seen_2x1.png") as made:
        assert made.size == (640, 256)
        assert all(made.getpixel((column, 100))[2] > 240 for column in (330, 630))


def test_views_for_a_pair_of_half_width_are_packed_as_they_are(lippmann, tmp_path):
    (tmp_path / "views").mkdir()
    for name, color in (("1.png", "red"), ("2.png", "blue")):
        Image.new("RGB", (160, 256), color).save(tmp_path / "views" / name)
    done = lippmann("quilt", "pack", tmp_path / "views", "-o", tmp_path / "seen_half_2x1.png")
    assert done.code == 0, done.err
    assert "taken as halved in width: players show them twice as wide" in done.err
    assert "2x1 of 160x256 pixels, aspect 1.25" in lippmann("info", tmp_path / "seen_half_2x1.png").out


def test_a_film_holds_both_eyes(lippmann, balls, tmp_path):
    import av

    words = ("--integrator", "albedo", "--spp", 1, "--threads", 1, "--turntable", 2, "--quiet")
    film = tmp_path / "turn.mp4"
    done = lippmann("quilt", "render", balls, "--target", "odyssey-3d", "--size", "480x270", *words, "-o", film)
    assert done.code == 0, done.err
    with av.open(str(tmp_path / "turn_half_2x1.mp4")) as container:
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(frames) == 2
    assert frames[0].shape == (270, 480, 3)
    assert abs(places(frames[0][:, :240], "red")[0] - places(frames[0][:, 240:], "red")[0]) > 0.2


@pytest.mark.usefixtures("short_probe")
def test_a_plan_is_of_the_pair_that_is_asked_for(lippmann, balls):
    words = ("plan", balls, "--target", "odyssey-3d", "--integrator", "albedo", "--spp", 2, "--threads", 1, "--json")
    own, wide = (lippmann(*words, *size).json for size in ((), ("--size", "7680x2160")))
    assert (own["size"], wide["size"]) == ([3840, 2160], [7680, 2160])
    assert wide["rays"]["primary"] == 2 * own["rays"]["primary"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("plan", "--target", "odyssey-3d", "--size", "999x999"), "it is 999 x 999 pixels; pairs for"),
        (("plan", "--target", "odyssey-3d", "--size", "20x30cm"), "--size: '20x30cm'; must be width x height"),
        (("plan", "--target", "odyssey-3d", "--size", "3840x2160", "--lpi", "60"), "--lpi: does not apply to the"),
        (("plan", "--target", "portrait", "--size", "3360x3360"), "--size: does not apply to the display portrait"),
        (("render", "--target", "odyssey-3d"), "--target: odyssey-3d takes no native pixels; an eye-tracked monitor"),
        (
            ("render", "--display", "odyssey-3d", "--target=odyssey-3d", "-o", "a.zarr"),
            "--display: odyssey-3d takes no native pixels",
        ),
        (("quilt", "render", "--target", "odyssey-3d", "--size", "999x999"), "it is 999 x 999 pixels; pairs for"),
        (("quilt", "render", "--target", "odyssey-3d", "--views", "8x6"), "--views: 8x6; odyssey-3d shows one view"),
        (
            ("quilt", "render", "--target", "oddyssey-3d"),
            "--target: unknown display 'oddyssey-3d', did you mean 'odyssey-3d'?",
        ),
        (("quilt", "render", "--target", "odyssey-3d", "-o", "a_2x1.png"), "a_2x1.png: the name says another quilt"),
        (("quilt", "render", "--target", "odyssey-3d", "-o", "a_qs8x6a0.75.png"), "the quilt's ends in _half_2x1.png"),
    ],
)
def test_refused_in_one_line(lippmann, balls, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    done = lippmann(*words, balls)
    assert done.code == 2
    assert said in done.err
    assert done.err.count("\n") == 1
    assert not list(tmp_path.iterdir())
