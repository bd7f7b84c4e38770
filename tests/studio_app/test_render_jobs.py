"""Full renders beside the live picture: their command lines, and what becomes of their processes."""

from __future__ import annotations

import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

import psutil
import pytest
from stand_in import TINY

from lippmann.errors import OutputError, UsageError
from lippmann.studio_app import render_jobs
from lippmann.studio_app.command_line import render_command
from lippmann.studio_app.output_names import claim_output, frames_of, is_unfinished
from lippmann.studio_app.render_jobs import JobRunner, command_of
from lippmann.studio_app.state import StudioState

WORDS = render_command(StudioState(display=TINY, turn=(30.0, 0.0, 0.0), subpixels=True))

#: A process that says how far it is; its first run waits to be stopped, later ones finish.
PROCESS = """
import json, pathlib, signal, sys, time
if "deaf" in sys.argv:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
output = pathlib.Path(sys.argv[sys.argv.index("-o") + 1])
begun = output.with_suffix(".begun")
waits = "wait" in sys.argv and not begun.exists()
begun.touch()
if "tiles" in sys.argv:
    folder = output.with_name(output.name + ".parts")
    folder.mkdir(mode=0o700, exist_ok=True)
    job = {"lippmann-journal": 1, "fingerprint": {}, "grid": [1, 1, 1]}
    (folder / "job.json").write_text(json.dumps(job))
    (folder / "r0000_c0000.tile").touch()
print("40 %: tracing", file=sys.stderr, flush=True)
if waits:
    try:
        time.sleep(60)
    except KeyboardInterrupt:
        sys.exit("lippmann: stopped")
if "fail" in sys.argv:
    sys.exit("lippmann: a.glb: is damaged")
output.write_bytes(b"made")
"""


def test_every_kind_has_its_command_line():
    lines = {kind: " ".join(command_of(kind, WORDS, Path("out.x"))) for kind in render_jobs.KINDS}
    assert lines["picture"].startswith("lippmann render teapot --display print:")
    assert lines["picture"].endswith("--turn 30,0,0 --integrator path --subpixels --resume -o out.x")
    assert lines["quilt"].startswith("lippmann quilt render teapot ")
    assert "--subpixels" not in lines["quilt"]
    assert "--resume" not in lines["quilt"]
    assert "--turntable 48 --video out.x --resume -o out-frames" in lines["turntable"]
    assert lines["print"].endswith("--marks 10mm -o out.x")


def test_an_output_of_the_state_gives_way():
    assert command_of("quilt", ["lippmann", "render", "a.glb", "-o", "b.png", "--spp", "4"], Path("out.png")) == (
        "lippmann", "quilt", "render", "a.glb", "--spp", "4", "-o", "out.png"
    )  # fmt: skip


@pytest.fixture
def runner(tmp_path, monkeypatch):
    """A runner of the stand-in process, its folder, and ``until(phase)``, which waits for the job to be there."""
    monkeypatch.setattr(render_jobs, "_CODE", PROCESS)
    changed = threading.Condition()
    jobs = []

    def take(job):
        with changed:
            jobs.append(job)
            changed.notify()

    def until(holds):
        with changed:
            assert changed.wait_for(lambda: jobs and holds(jobs[-1]), 20.0), jobs
            return jobs[-1]

    made = JobRunner(tmp_path, take)
    yield made, tmp_path, until
    made.close()


def test_a_render_is_done(runner):
    jobs, folder, until = runner
    jobs.start("picture", ["lippmann", "render", "a"], "teapot")
    job = until(lambda job: job.phase == "done")
    assert (job.output.read_bytes(), job.output, job.share, job.stage) == (
        b"made",
        folder / "teapot.png",
        0.4,
        "Tracing light",
    )
    assert jobs.finished(1) == job
    assert job.message()["shows"] == "picture"
    jobs.start("picture", ["lippmann", "render", "a"], "teapot")
    assert until(lambda job: job.number == 2 and job.phase == "done").output.name == "teapot-2.png"


def test_a_cancelled_render_goes_on(runner):
    jobs, _, until = runner
    jobs.start("picture", ["lippmann", "render", "wait", "tiles"], "teapot")
    until(lambda job: job.share == 0.4)
    with pytest.raises(UsageError, match="a render is running"):
        jobs.start("picture", ["lippmann", "render", "a"], "other")
    jobs.cancel()
    job = until(lambda job: job.phase != "running")
    assert (job.phase, job.can_resume, jobs.finished(1)) == ("cancelled", True, None)
    jobs.resume()
    assert until(lambda job: job.phase == "done").output.read_bytes() == b"made"
    with pytest.raises(UsageError, match="nothing to go on with"):
        jobs.resume()


def test_a_render_that_hears_nothing_is_killed(runner, monkeypatch):
    monkeypatch.setattr(render_jobs, "PATIENCE", 0.3)
    jobs, _, until = runner
    jobs.start("picture", ["lippmann", "render", "wait", "deaf"], "teapot")
    until(lambda job: job.share == 0.4)
    jobs.cancel()
    until(lambda job: job.stage == "Cancelling")
    job = until(lambda job: job.phase != "running")
    assert (job.phase, job.can_resume) == ("cancelled", False)  # no tile was finished
    with pytest.raises(UsageError, match="nothing to go on with"):
        jobs.resume()


def test_a_failed_render_says_why_in_one_line(runner):
    jobs, _, until = runner
    jobs.start("quilt", ["lippmann", "render", "fail"], "teapot")
    job = until(lambda job: job.phase != "running")
    assert (job.phase, job.line, job.can_resume) == ("failed", "a.glb: is damaged", False)


def test_a_render_ends_with_its_studio(runner):
    jobs, _, until = runner
    jobs.start("picture", ["lippmann", "render", "wait"], "teapot")
    until(lambda job: job.share == 0.4)
    jobs.close()
    assert until(lambda job: job.phase != "running").phase == "cancelled"


def test_files_are_named_as_where_the_studio_was_started(runner, monkeypatch):
    jobs, folder, until = runner
    monkeypatch.setattr(render_jobs, "_CODE", PROCESS + "output.write_text(str(pathlib.Path.cwd()))")
    started = Path.cwd()
    monkeypatch.chdir(folder)
    jobs.start("picture", ["lippmann", "render", "a"], "teapot")
    assert until(lambda job: job.phase == "done").output.read_text() == str(started)


@pytest.mark.slow
def test_a_render_ends_with_a_studio_that_is_killed(tmp_path):
    """The real child process, whose work is a sleep that hears nothing."""
    render = (
        "import lippmann.cli, time; lippmann.cli.main = lambda words: [print('9 %: on', flush=True), time.sleep(99)]"
    )
    studio = f"""
import sys, threading
from pathlib import Path
from lippmann.studio_app import render_jobs
render_jobs._CODE = "import signal; {render}; signal.signal(signal.SIGINT, signal.SIG_IGN); " + render_jobs._CODE
jobs = render_jobs.JobRunner(Path(sys.argv[1]), lambda job: None)
jobs.start("picture", ["lippmann", "render", "a"], "a")
print(jobs._process.pid, flush=True)
threading.Event().wait()
"""
    with subprocess.Popen([sys.executable, "-c", studio, tmp_path], stdout=subprocess.PIPE, text=True) as process:
        child = psutil.Process(int(process.stdout.readline()))
        process.kill()
    assert child.wait(10) is None or not child.is_running()


@pytest.fixture
def claim(tmp_path):
    """``claim(stem)``: a claim of a picture's name in the test's folder."""
    with ExitStack() as stack:

        def claimed(stem):
            made = claim_output(tmp_path, stem, ".png")
            stack.callback(made.release)
            return made

        yield claimed


def test_names_are_taken_by_one_studio(claim):
    first, second = claim("a"), claim("a")
    assert [each.output.name for each in (first, second)] == ["a.png", "a-2.png"]
    first.release()
    assert claim("a").output.name == "a.png"
    second.output.write_bytes(b"")
    second.release()
    assert claim("a").output.name == "a-3.png"


def test_names_are_claimed_once_whoever_comes_and_goes(tmp_path):
    """Studios that claim, write and release at the same time: no name is written twice."""

    def write(_):
        claim = claim_output(tmp_path, "a", "_qs8x6.png")
        with claim.output.open("x"):
            pass
        claim.release()

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(write, range(60)))
    assert len(list(tmp_path.iterdir())) == 60


@pytest.mark.parametrize("left", ["a.png.parts", "a-frames"])
def test_what_an_earlier_session_left_unfinished_keeps_its_name(tmp_path, claim, left):
    (tmp_path / left).mkdir()
    (tmp_path / ".a.png.claim").touch()  # of a studio that was killed
    assert claim("a").output.name == "a-2.png"
    assert not (tmp_path / ".a.png.claim").exists()


@pytest.mark.parametrize("stem", ["b/../c", "模型" * 200, "a\nb", "'[x], y'"])
def test_any_name_of_a_model_gives_a_name_of_a_file(tmp_path, claim, stem):
    output = claim(stem).output
    output.touch()
    assert output.parent == tmp_path


def test_a_folder_that_is_gone_is_one_line(tmp_path):
    with pytest.raises(OutputError, match="cannot be written"):
        claim_output(tmp_path / "gone", "a", ".png")


@pytest.mark.parametrize("number", [-1, 0, 1, 99])
def test_there_are_no_other_results(runner, number):
    assert runner[0].finished(number) is None


def test_frames_of_a_film_are_gone_on_with_once_there_is_one(tmp_path):
    output = tmp_path / "teapot.mp4"
    frames = frames_of(output)
    assert not is_unfinished(output)
    frames.mkdir()
    journal = frames / f"{frames.name}.journal"
    journal.write_text('{"fingerprint": {}}\n')
    assert not is_unfinished(output)
    journal.write_text('{"fingerprint": {}}\n{"frame": 0}\n')
    assert is_unfinished(output)


def test_a_folder_that_is_no_journal_is_not_gone_on_with(tmp_path):
    folder = tmp_path / "teapot.png.parts"
    folder.mkdir()
    (folder / "mine.txt").touch()
    assert not is_unfinished(tmp_path / "teapot.png")


@pytest.mark.parametrize(
    ("share", "elapsed", "remark", "left"),
    [
        (0.5, 30.0, "", 30.0),
        (0.25, 9.0, "tile 3 of 12", 27.0),
        (0.04, 60.0, "", None),  # too little is done
        (0.5, 2.0, "", None),  # kernels were compiled meanwhile
        (0.02, 1.0, "35.1 dB, goal 40 dB, about 75 s left", 75.0),
        (1.0, 10.0, "", 0.0),
    ],
)
def test_the_time_left_is_told_once_it_is_known(share, elapsed, remark, left):
    assert render_jobs.seconds_left(share, elapsed, remark) == left


@pytest.mark.parametrize(
    ("line", "stage", "left"),
    [
        ("40 %: tracing, 35.1 dB, goal 40 dB, about 75 s left", "Tracing light", 75.0),
        ("40 %: denoising", "Removing noise", None),
        ("40 %: rendering frames, frame 3 of 48", "Rendering the film", None),
        ("40 %: something else", "Something else", None),
    ],
)
def test_progress_is_told_in_words_of_people(runner, monkeypatch, line, stage, left):
    monkeypatch.setattr(render_jobs, "_CODE", PROCESS.replace("40 %: tracing", line))
    jobs, _, until = runner
    jobs.start("picture", ["lippmann", "render", "a b"], "teapot")
    job = until(lambda job: job.share == 0.4)
    assert (job.stage, job.seconds_left) == (stage, left)
    assert job.message()["settings"] == "lippmann render 'a b'"
