"""Full renders beside the live picture: their command lines, and what becomes of their processes."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
from stand_in import TINY

from lippmann.errors import UsageError
from lippmann.studio_app import render_jobs
from lippmann.studio_app.command_line import render_command
from lippmann.studio_app.render_jobs import JobRunner, command_of
from lippmann.studio_app.state import StudioState

WORDS = render_command(StudioState(display=TINY, turn=(30.0, 0.0, 0.0), subpixels=True))

#: A process that says how far it is; its first run waits to be stopped, later ones finish.
PROCESS = """
import pathlib, signal, sys, time
if "deaf" in sys.argv:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
output = pathlib.Path(sys.argv[sys.argv.index("-o") + 1])
begun = output.with_suffix(".begun")
waits = "wait" in sys.argv and not begun.exists()
begun.touch()
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
        "tracing",
    )
    assert jobs.finished(1) == job
    assert job.message()["shows"] == "picture"
    jobs.start("picture", ["lippmann", "render", "a"], "teapot")
    assert until(lambda job: job.number == 2 and job.phase == "done").output.name == "teapot-2.png"


def test_a_cancelled_render_goes_on(runner):
    jobs, _, until = runner
    jobs.start("picture", ["lippmann", "render", "wait"], "teapot")
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
    until(lambda job: job.stage == "cancelling")
    job = until(lambda job: job.phase != "running")
    assert (job.phase, job.can_resume) == ("cancelled", True)


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


@pytest.mark.parametrize("number", [-1, 0, 1, 99])
def test_there_are_no_other_results(runner, number):
    assert runner[0].finished(number) is None
