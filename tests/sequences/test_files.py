"""Sequences that are interrupted: killed processes, changed scenes and options, damaged frames."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
import weakref
from dataclasses import replace
from operator import attrgetter
from typing import ClassVar

import numpy as np
import pytest

from lippmann.display import load_display
from lippmann.errors import PictureError
from lippmann.image import Provenance
from lippmann.image.preview import Preview
from lippmann.options.placement import PlacementOptions
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.runtime.atomic_write import temporary_file
from lippmann.sequences.files import journal_of, save_sequence
from lippmann.sequences.motion import open_motion

QUICK = RenderRequest(integrator="direct", spp=1, device="cpu")
FRAMES = range(0, 12, 3)


@pytest.fixture(scope="module")
def display():
    return load_display("seed-lenticular")


@pytest.fixture(scope="module")
def unbroken(engine, moving_ball, display, tmp_path_factory):
    """The frames of a run that nothing interrupted."""
    folder = tmp_path_factory.mktemp("unbroken")
    assert [frame.resumed for frame in run(moving_ball, display, folder)] == [False] * 4
    return contents(folder)


@pytest.fixture(scope="module")
def begun(engine, moving_ball, display, tmp_path_factory):
    """The folder of a run that ended after its first frame."""
    folder = tmp_path_factory.mktemp("begun")
    run(moving_ball, display, folder, most=1)
    return folder


def run(scene, display, folder, *, frames=FRAMES, most=99, resume=False, motion=None, bits=None, **changes):
    """Render frames, at most so many of them; those that came."""
    moving = motion or open_motion(scene)
    came = []
    name = folder / "f_%02d.png"

    def path_of(number):
        return folder / f"f_{number:02}.png"

    request = replace(QUICK, **changes)
    with save_sequence(moving, name, path_of, display, frames, request, resume=resume, bits=bits) as saved:
        for frame in saved:
            came.append(frame)
            if len(came) == most:
                break
    return came


def contents(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


@pytest.mark.long
def test_a_whole_run_leaves_its_frames_alone(unbroken):
    assert list(unbroken) == [f"f_{number:02}.png" for number in FRAMES]
    assert len(set(unbroken.values())) == 4


def test_a_frame_is_let_go_before_the_next_is_rendered(engine, moving_ball, display, tmp_path):
    """A film takes the memory of a still: neither the rendered picture nor its values in the file stay."""
    alive = set()

    def counted(dtype):
        values = np.zeros((2, 2, 3), dtype)
        alive.add(id(values))
        weakref.finalize(values, alive.discard, id(values))
        return values

    class Form:
        settings: ClassVar[dict[str, str]] = {}

        def render(self, scene, display, request, progress, build):
            assert not alive
            return Preview(counted(np.float32), Provenance(method="full"))

        def write(self, frame, path, bits):
            path.write_bytes(frame.pixels.tobytes())
            return Preview(counted(np.uint8), frame.provenance)

    motion = open_motion(moving_ball)
    with save_sequence(
        motion,
        tmp_path / "f.png",
        lambda number: tmp_path / f"{number}.png",
        display,
        FRAMES,
        QUICK,
        form=Form(),
    ) as saved:
        assert list(map(attrgetter("quilt.pixels.size"), saved)) == [12] * len(FRAMES)


@pytest.mark.long
def test_finished_frames_are_kept_and_the_rest_is_the_same(unbroken, moving_ball, display, tmp_path):
    run(moving_ball, display, tmp_path, most=2)
    assert (tmp_path / "f_%02d.png.journal").exists()
    written = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("*.png")}
    frames = run(moving_ball, display, tmp_path, resume=True)
    assert [(frame.number, frame.resumed) for frame in frames] == [(0, True), (3, True), (6, False), (9, False)]
    assert frames[0].provenance.spp == 1
    assert contents(tmp_path) == unbroken
    assert {name: (tmp_path / name).stat().st_mtime_ns for name in written} == written


@pytest.mark.long
def test_damaged_and_absent_frames_are_rendered_again(unbroken, moving_ball, display, tmp_path):
    run(moving_ball, display, tmp_path, most=3)
    (tmp_path / "f_00.png").unlink()
    (tmp_path / "f_03.png").write_bytes(unbroken["f_06.png"])
    frames = run(moving_ball, display, tmp_path, resume=True)
    assert [frame.resumed for frame in frames] == [False, False, True, False]
    assert contents(tmp_path) == unbroken


@pytest.mark.long
def test_what_was_half_written_is_swept(unbroken, moving_ball, display, tmp_path):
    run(moving_ball, display, tmp_path, most=1)
    temporary_file(tmp_path / "f_03.png").write_bytes(b"half")
    run(moving_ball, display, tmp_path, resume=True)
    assert contents(tmp_path) == unbroken


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"seed": 1}, r"seed \(was 0, is 1\)"),
        ({"subpixels": True}, r"subpixels \(was None, is True\)"),
        (
            {"placement": PlacementOptions(shift=(0.0, 0.0, 1.0))},
            r"placement shift \(was \(0\.0, 0\.0, 0\.0\), is \(0\.0, 0\.0, 1\.0\)\)",
        ),
        ({"bits": 16}, r"values \(was uint8, is uint16\)"),
        ({"frames": range(3, 12, 3)}, r"the first frame \(was 0, is 3\)"),
    ],
)
def test_other_options_are_refused(begun, moving_ball, display, options, said):
    before = contents(begun)
    with pytest.raises(PictureError, match=f"the unfinished sequence is another one: {said}"):
        run(moving_ball, display, begun, resume=True, **options)
    assert contents(begun) == before


@pytest.mark.slow
def test_other_scenes_and_displays_are_refused(begun, moving_ball, display, tmp_path):
    out, scene = begun, tmp_path / "scene"
    shutil.copytree(moving_ball.parent, scene)
    assert run(scene / moving_ball.name, display, out, most=1, resume=True)[0].resumed
    tree = json.loads((scene / moving_ball.name).read_text())
    tree["materials"] = [{"pbrMetallicRoughness": {"roughnessFactor": 0.31}}]
    (scene / moving_ball.name).write_text(json.dumps(tree))
    with pytest.raises(PictureError, match="another one: the scene and what moves in it;"):
        run(scene / moving_ball.name, display, out, resume=True)
    with pytest.raises(PictureError, match="another one: the scene and what moves in it;"):
        run(moving_ball, display, out, resume=True, motion=open_motion(moving_ball, fps=25))
    with pytest.raises(PictureError, match="the display's gap"):
        run(moving_ball, load_display("panel-4k"), out, resume=True)


@pytest.mark.long
def test_more_or_fewer_frames_may_be_asked_for(unbroken, moving_ball, display, tmp_path):
    run(moving_ball, display, tmp_path, most=2)
    frames = run(moving_ball, display, tmp_path, frames=range(7), most=5, resume=True)
    assert [frame.resumed for frame in frames] == [True, False, False, True, False]
    assert all(contents(tmp_path)[name] == unbroken[name] for name in ("f_00.png", "f_03.png"))


def command(scene, folder, *more):
    words = ("render", scene, "--frames", "0:24:3", "-o", folder / "f_%02d.png", "--integrator", "direct", "--spp", "1")
    start = "from lippmann.cli import main; main()"
    return [sys.executable, "-c", start, *map(str, (*words, "--device", "cpu", *more))]


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="there is no such signal there")
@pytest.mark.parametrize("film", [pytest.param("film.png", marks=pytest.mark.long), "film.mp4"])
def test_killed_in_mid_sequence_and_gone_on_with(unbroken, moving_ball, tmp_path, film):
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    whole.mkdir()
    broken.mkdir()
    subprocess.run(command(moving_ball, whole, "--video", whole / film), check=True, capture_output=True)
    assert len(contents(whole)) == 9
    assert contents(whole).items() >= unbroken.items()
    more = ("--video", broken / film, "--resume", "--json")
    killed = subprocess.Popen(command(moving_ball, broken, *more), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    journal = journal_of(broken / "f_%02d.png", broken / "f_00.png")
    end = time.monotonic() + 120
    while not journal.exists() or journal.read_bytes().count(b"\n") < 3:
        assert time.monotonic() < end
        assert killed.poll() is None
        time.sleep(0.002)
    os.kill(killed.pid, signal.SIGKILL)
    killed.wait()
    assert not (broken / film).exists()
    done = subprocess.run(command(moving_ball, broken, *more), check=True, capture_output=True, text=True)
    found = [frame["found"] for frame in json.loads(done.stdout)["frames"]]
    assert 2 <= sum(found) < 8
    assert found == sorted(found, reverse=True)
    assert contents(broken) == contents(whole)
