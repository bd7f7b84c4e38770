"""``lippmann render --frames``: numbered pictures, films, and what is refused."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest

from lippmann.cli.shared.scene_source import output_of
from lippmann.image import read_picture
from lippmann.quilts.quilt_metadata import metadata_of_text
from lippmann.runtime.atomic_write import temporary_file
from lippmann.viewing.replay import replay

QUICK = ("--integrator", "direct", "--spp", "1", "--device", "cpu")


def frames_of(path):
    with av.open(str(path)) as container:
        rate = container.streams.video[0].average_rate  # a single picture has none
        return rate and float(rate), [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


@pytest.mark.long
def test_frames_by_a_pattern_and_a_film_of_quilts(engine, lippmann, moving_ball, tmp_path):
    film = tmp_path / "film_qs3x1a1.mp4"
    output = tmp_path / "out_%03d.exr"
    done = lippmann("render", moving_ball, "--frames", "1:3", "-o", output, "--video", film, *QUICK)
    assert done.code == 0, done.err
    assert f"{tmp_path}/out_001.exr to out_002.exr, {film}: 2 frames" in done.out
    _, shown = frames_of(film)
    assert len(shown) == 2
    assert shown[0].shape == (512, 1536, 3)
    with av.open(str(film)) as video:
        assert metadata_of_text(video.metadata["comment"], "film").layout == (3, 1, 1.0)


@pytest.mark.slow
def test_a_flight(engine, lippmann, tmp_path):
    body = "CAMERA ZOOM 1 ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH 2 CENTER 0 0 -5 VIEWDIR 0 0 1 UPDIR 0 1 0 END_CAMERA"
    ball = "SPHERE CENTER 0 0 0 RAD 1 TEXTURE AMBIENT 0.2 DIFFUSE 0.8 SPECULAR 0 OPACITY 1 COLOR 1 1 1 TEXFUNC 0"
    (tmp_path / "room.dat").write_text(f"BEGIN_SCENE RESOLUTION 64 64 {body} {ball} END_SCENE")
    (tmp_path / "room.cam").write_text("0 0 1 0 1 0 0 0 -5\n0 0 1 0 1 0 0.2 0 -5\n")
    call = (tmp_path / "room.dat", "--camera-path", tmp_path / "room.cam", "--frames", ":", "-o", tmp_path / "out")
    done = lippmann("render", *call, "--json", "--device", "cpu")
    assert done.code == 0, done.err
    first, second = (read_picture(Path(frame["output"])) for frame in done.json["frames"])
    assert first.provenance.integrator == "classic"
    assert not np.array_equal(first.pixels, second.pixels)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--frames", "0-9", "-o", "out"), "'0-9'; must be FIRST:STOP"),
        (("--frames", "5:2", "-o", "out"), "FIRST:STOP"),
        (("--frames", "0:26", "-o", "out"), "there is no frame 25"),
        (("--frames", "0:2", "-o", "out.png"), "one name for 2 frames; out_%04d.png, a folder, or a film: out.mp4"),
        (("--frames", "0:2", "-o", "turn.avi"), "turn.avi: this is one name for 2 frames; turn_%04d.png, a folder"),
        (("--frames", "0:2", "-o", "a%d_%d.png"), "no clear place"),
        (("--frames", "0:2", "-o", "out_%04d.gif"), ".gif"),
        (("--frames", "0:2", "-o", "nowhere/out"), "nowhere"),
        (("--frames", "0:2", "-o", "out", "--video", "film.avi"), "unknown ending of an animation"),
        (("--frames", "0:2", "-o", "out", "--fps", "0"), "0.001 to 1000"),
        (("--frames", "0:2", "-o", "out", "--eye", "0,0,500"), "nobody looks"),
        (("--frames", "0:2", "-o", "out", "--codec", "av1"), "--codec: there is no film"),
        (("--frames", "0:2", "-o", "out", "--video", "film.png", "--codec", "av1"), "--codec: only MP4 has a choice"),
        (("--codec", "av1", "-o", "out.png"), "--codec: has no meaning for a single picture"),
        (("--frames", "0:2", "-o", "out", "--animation", "walk"), "unknown animation 'walk'"),
        (("--frames", "0:2", "-o", "out", "--maps", "maps"), "--maps"),
        (("--frames", "0:2", "-o", "out", "--layers"), "OpenEXR can"),
        (("--frames", "0:2", "-o", "out", "--camera-path", "none.cam"), "a camera path leads through"),
        (("--eye", "0,0,600", "-o", "out.png"), "or --turntable 48; 'lippmann preview' and"),
        (("--fps", "24", "-o", "out.png"), "--fps: has no meaning for a single picture"),
        (("--camera-path", "x.cam", "-o", "out.png"), "--camera-path: has no meaning for a single picture"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(lippmann, moving_ball, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "none.cam").write_text("0 0 1 0 1 0 0 0 -5\n")
    done = lippmann("render", moving_ball, *words)
    assert done.code == 2
    assert message in done.err
    assert done.err.count("\n") == 1
    assert not (tmp_path / "out.png").exists()


@pytest.mark.slow
def test_a_single_frame_may_have_a_plain_name(engine, lippmann, moving_ball, cut_display, tmp_path):
    words = ("-d", cut_display(128, 64), "--frames", "7", "-o", tmp_path / "seven.png")
    done = lippmann("render", moving_ball, *words, *QUICK)
    assert done.code == 0, done.err
    assert (tmp_path / "seven.png").exists()


SMALL_QUILT = ("--views", "3x2", "--size", "384x288", *QUICK)


@pytest.mark.slow
def test_a_part_of_a_swing(engine, lippmann, cut_display, tmp_path):
    call = (
        "-d",
        cut_display(128, 64),
        "--turntable",
        "8",
        "--swing",
        "40",
        "--frames",
        "2:4",
        "-o",
        tmp_path / "out_%d.png",
    )
    done = lippmann("render", "teapot", *call, *QUICK)
    assert done.code == 0, done.err
    assert sorted(path.name for path in tmp_path.glob("*.png")) == ["out_2.png", "out_3.png"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("film", "eye", "shape"),
    [
        pytest.param("seen.mp4", ("--eye", "sweep"), (144, 108), marks=pytest.mark.long),
        ("all_qs3x2a0.75.png", (), None),
    ],
)
def test_quilts_of_a_turn_and_their_film(engine, lippmann, tmp_path, monkeypatch, film, eye, shape):
    from lippmann.color.transfer import quantize
    from lippmann.quilts.files import read_quilt
    from lippmann.viewing.video_frames import view_of_quilt

    call = ("quilt", "render", "teapot", "--turntable", "3", *SMALL_QUILT, *eye, "--video", tmp_path / film)
    # In a folder named after the scene, or named with a number, to which the ending of their kind is added.
    monkeypatch.chdir(tmp_path)
    done = lippmann(*call, *(() if eye else ("-o", "q_%d.png")), "--json")
    assert done.code == 0, done.err
    paths = [Path(frame["output"]) for frame in done.json["frames"]]
    assert {str(path.parent) for path in paths} == {"teapot-frames" if eye else "."}
    name = "frame_{:04}_qs3x2a0.75.png" if eye else "q_{}_qs3x2a0.75.png"
    assert [path.name for path in paths] == [name.format(number) for number in range(3)]
    _, shown = frames_of(tmp_path / film)
    assert len(shown) == 3
    first = read_quilt(paths[0])
    # What the cameras rendered: to the right, to the left and in the middle.
    for frame, number, path in zip(shown, (3, 5, 0), paths, strict=True):
        quilt = read_quilt(path)
        expected = quantize(view_of_quilt(quilt, number), 8, "srgb") if eye else quantize(quilt.pixels, 8, "srgb")
        even = frame[: expected.shape[0], : expected.shape[1]]
        assert 10 * np.log10(255**2 / max(np.mean((expected.astype(float) - even) ** 2), 1e-9)) > 30
    assert not np.array_equal(first.view(0), first.view(5))
    assert shape is None or shown[0].shape[:2] == shape


def test_a_dot_in_a_models_name_is_no_ending_of_the_folder_of_its_frames():
    assert output_of(None, "chair.v2.glb", "-frames") == Path("chair-v2-frames")
    assert output_of(None, "chair.v2.glb", "-native.png") == Path("chair.v2-native.png")


@pytest.mark.parametrize(("eye", "film"), [((), "turn_qs3x2a0.75.mp4"), (("--eye", "sweep"), "turn.mp4")])
def test_an_output_that_is_a_film_is_made_of_the_frames_beside_it(engine, lippmann, tmp_path, monkeypatch, eye, film):
    monkeypatch.chdir(tmp_path)
    done = lippmann("quilt", "render", "teapot", "--turntable", "2", *SMALL_QUILT, *eye, "-o", "turn.mp4", "--json")
    assert done.code == 0, done.err
    assert done.json["video"] == film
    assert sorted(path.name for path in tmp_path.iterdir()) == ["turn-frames", film]
    assert len(frames_of(tmp_path / film)[1]) == 2
    assert len(list((tmp_path / "turn-frames").glob("frame_*_qs3x2a0.75.png"))) == 2


def test_an_output_that_is_a_film_of_integral_images(engine, lippmann, moving_ball, cut_display, tmp_path):
    film = tmp_path / "out" / "ball.v1.mp4"
    film.parent.mkdir()
    temporary_file(film).write_bytes(b"what a killed run left")
    words = ("-d", cut_display(128, 64), "--frames", "0:2", *QUICK, "--fps", "10", "-o", film)
    done = lippmann("render", moving_ball, *words)
    assert done.code == 0, done.err
    assert sorted(path.name for path in film.parent.iterdir()) == ["ball-v1-frames", "ball.v1.mp4"]
    assert frames_of(film)[0] == 10


@pytest.mark.slow
def test_a_film_of_native_pixels_and_one_of_colour_beside_depth(engine, lippmann, cut_display, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    call = ("render", "teapot", "-d", cut_display(160, 160), "--turntable", "2", *QUICK, "--layers", "-o", "f_%d.exr")
    done = lippmann(*call, "--video", "native.mp4", "--shows", "native")
    assert done.code == 0, done.err
    _, shown = frames_of("native.mp4")
    for number, frame in enumerate(shown):
        np.testing.assert_array_equal(frame, read_picture(Path(f"f_{number}.exr")).srgb())
    assert lippmann(*call, "--video", "depth.mp4", "--shows", "rgbd-half").code == 0
    _, shown = frames_of("depth.mp4")
    seen = replay(read_picture(Path("f_0.exr")))
    assert shown[0].shape == seen.shape
    color, depth = np.split(shown[0].astype(int), 2, axis=1)
    assert np.ptp(depth, axis=2).max() < 12  # grey, as far as a film of 4:2:0 goes
    hit = depth[..., 1] > 40
    assert 0.05 < hit.mean() < 0.9
    assert color[hit].sum(axis=-1).mean() > 60


@pytest.mark.long
@pytest.mark.slow
def test_a_film_for_a_hololuminescent_display(engine, lippmann, tmp_path):
    call = ("--display", "looking-glass-go", "--views", "1x1", "--size", "288x512", "--turntable", "2", "--fps", "30")
    done = lippmann("quilt", "render", "teapot", *call, *QUICK, "-o", tmp_path / "h.mp4", "--shows", "hololuminescent")
    assert done.code == 0, done.err
    with av.open(str(tmp_path / "h.mp4")) as film:
        stream = film.streams.video[0]
        assert (stream.codec_context.codec_tag, stream.width, stream.height) == ("hvc1", 3840, 2160)
        upright = np.rot90(next(film.decode(stream)).to_ndarray(format="rgb24"), -1)
    assert upright[:340].max() < 8
    assert upright[400:-100, 120:-120].max() > 50


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("quilt", "render", "-o", "film.mp4"), "film.mp4: a film needs frames; add --turntable 48, or --frames 0:48"),
        (("render", "-o", "film.mp4"), "film.mp4: a film needs frames; add --turntable 48, or --frames 0:48"),
        (("render", "--turntable", "8", "-o", "a.mp4", "--video", "b.mp4"), "--video: the output is a film already"),
        (("render", "--turntable", "1", "-o", "out"), "--turntable: 1 frames; 2 to 100000 frames of a turn"),
        (("render", "--swing", "400", "-o", "out"), "--swing: 400 degrees; above 0 and at most 360 degrees"),
        (("render", "--turntable", "8", "--animation", "hop", "-o", "out"), "--animation: a scene on a turntable"),
        (("render", "--turntable", "8", "--frames", "0:9", "-o", "out"), "there is no frame 8"),
        (("render", "--turntable", "8", "--fps", "9", "-o", "out"), "--fps: a turn has one pose a frame"),
        (("render", "--turntable", "8", "-o", "out", "--video", "x_qs8x6a1.mp4", "--eye", "0,0,9"), "--eye: a quilt's"),
        (
            ("quilt", "render", "--turntable", "8", "-o", "x_qs8x6a0.75.png"),
            "x_%04d_qs8x6a0.75.png, a folder, or a film: x_qs8x6a0.75.mp4",
        ),
        (("quilt", "render", "--turntable", "8", "--video", "x_qs5x9a0.75.mp4"), "the name says another quilt"),
        (("quilt", "render", "--turntable", "8", "--video", "x.mp4", "--eye", "0,0,0"), "--eye: an eye at z = 0"),
        (("render", "--turntable", "8", "-o", "out", "--shows", "native"), "--shows: there is no film"),
        (("render", "-o", "x.png", "--shows", "native"), "--shows: has no meaning for a single picture"),
        (
            ("render", "--turntable", "8", "-o", "a.mp4", "--shows", "native", "--codec", "hevc"),
            "hevc halves the resolution",
        ),
        (("render", "--turntable", "8", "-o", "a.mp4", "--shows", "rgbd"), "--shows: the frames have no depth"),
        (
            ("render", "--turntable", "8", "-o", "a.mp4", "--shows", "hololuminescent"),
            "--fps: 24 frames per second; the",
        ),
        (("quilt", "render", "--turntable", "8", "-o", "a.mp4", "--shows", "native"), "--shows: 'native' of quilts"),
        (("quilt", "render", "--resume"), "--resume: a quilt is rendered in one piece"),
    ],
)
def test_turns_that_cannot_be_are_said_in_one_line(lippmann, moving_ball, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    command = 2 if words[0] == "quilt" else 1
    done = lippmann(*words[:command], moving_ball, *words[command:])
    assert done.code == 2
    assert message in done.err
    assert done.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_what_ends_before_its_first_frame_leaves_no_folder(lippmann, tmp_path, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("lippmann.sequences.files.save_sequence", interrupted)
    assert lippmann("render", "teapot", "--turntable", "2", "-o", tmp_path / "frames").code == 130
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_what_the_panel_cuts_is_said_once_with_the_first_frame_concerned(engine, lippmann, moving_ball, tmp_path):
    """A ball in front of the panel that comes to its right edge."""
    place = ("--display", "mla-square", "--place", "fit", "--scale", "0.5", "--shift", "12,0,8")
    quick = ("--integrator", "normal", "--spp", "1", "--device", "cpu")
    done = lippmann("render", moving_ball, "--frames", "0:25:6", *place, "-o", tmp_path / "out", *quick)
    assert done.code == 0, done.err
    (line,) = [line for line in done.err.splitlines() if "the panel's edge cuts" in line]
    assert "(right " in line
    assert line.endswith("sets it behind (frame 18; with other numbers 1 more of 5 frames)")
