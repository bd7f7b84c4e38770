"""``lippmann render --frames``: numbered pictures, films, and what is refused."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest

from lippmann.image import read_picture
from lippmann.viewing.replay import replay

QUICK = ("--integrator", "direct", "--spp", "1", "--device", "cpu")


def frames_of(path):
    with av.open(str(path)) as container:
        rate = float(container.streams.video[0].average_rate)
        return rate, [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def test_frames_into_a_folder_with_a_film(engine, lippmann, moving_ball, tmp_path):
    film = tmp_path / "film.mp4"
    call = (moving_ball, "--frames", "0:24:12", "--fps", "24", "-o", tmp_path / "out", "--video", film, "--json")
    done = lippmann("render", *call, *QUICK)
    assert done.code == 0, done.err
    names = [f"frame_{number:04}.png" for number in (0, 12)]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == names
    assert [frame["frame"] for frame in done.json["frames"]] == [0, 12]
    assert done.json["video"] == str(film)
    rate, shown = frames_of(film)
    assert (rate, len(shown)) == (24, 2)
    for name, frame in zip(names, shown, strict=True):
        image = read_picture(tmp_path / "out" / name)
        seen = replay(image)
        from lippmann.color.transfer import quantize

        error = np.mean((quantize(seen, 8, "srgb").astype(float) - frame) ** 2)
        assert 10 * np.log10(255**2 / error) > 30
    assert read_picture(tmp_path / "out" / names[1]).provenance.options["frame"] == 12


def test_frames_by_a_pattern_and_a_film_of_quilts(engine, lippmann, moving_ball, tmp_path):
    film = tmp_path / "film_qs3x1a1.mp4"
    output = tmp_path / "out_%03d.exr"
    done = lippmann("render", moving_ball, "--frames", "1:3", "-o", output, "--video", film, *QUICK)
    assert done.code == 0, done.err
    assert f"{tmp_path}/out_001.exr to out_002.exr, {film}: 2 frames" in done.out
    _, shown = frames_of(film)
    assert len(shown) == 2
    assert shown[0].shape == (512, 1536, 3)


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


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--frames", "0-9", "-o", "out"), "'0-9' will not do"),
        (("--frames", "5:2", "-o", "out"), "FIRST:STOP"),
        (("--frames", "0:26", "-o", "out"), "there is no frame 25"),
        (("--frames", "0:2", "-o", "out.png"), "this is one name for 2 frames; out_%04d.png, or a folder"),
        (("--frames", "0:2", "-o", "a%d_%d.png"), "no clear place"),
        (("--frames", "0:2", "-o", "out_%04d.gif"), ".gif"),
        (("--frames", "0:2", "-o", "nowhere/out"), "nowhere"),
        (("--frames", "0:2", "-o", "out", "--video", "film.avi"), "animations are"),
        (("--frames", "0:2", "-o", "out", "--fps", "0"), "0.001 to 1000"),
        (("--frames", "0:2", "-o", "out", "--eye", "0,0,500"), "nobody looks"),
        (("--frames", "0:2", "-o", "out", "--animation", "walk"), "no animation is named 'walk'"),
        (("--frames", "0:2", "-o", "out", "--maps", "maps"), "--maps"),
        (("--frames", "0:2", "-o", "out", "--layers"), "OpenEXR can"),
        (("--frames", "0:2", "-o", "out", "--camera-path", "none.cam"), "a camera path leads through"),
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


def test_a_single_frame_may_have_a_plain_name(engine, lippmann, moving_ball, tmp_path):
    done = lippmann("render", moving_ball, "--frames", "7", "-o", tmp_path / "seven.png", *QUICK)
    assert done.code == 0, done.err
    assert (tmp_path / "seven.png").exists()


@pytest.mark.long
def test_frames_on_a_cluster_are_the_same(engine, lippmann, moving_ball, tmp_path):
    pytest.importorskip("distributed")
    for place, more in (("here", ()), ("there", ("--cluster", "local:2", "--video", tmp_path / "film.mp4"))):
        done = lippmann("render", moving_ball, "--frames", "0:2", "-o", tmp_path / place, *QUICK, *more)
        assert done.code == 0, done.err
    for name in ("frame_0000.png", "frame_0001.png"):
        here, there = (read_picture(tmp_path / place / name) for place in ("here", "there"))
        assert np.array_equal(here.pixels, there.pixels)
    assert len(frames_of(tmp_path / "film.mp4")[1]) == 2
