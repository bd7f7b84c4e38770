"""Runs of the command that the add-on watches: progress, errors, an end on request."""

import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.progress import Progress
from lippmann.progress_bar import PlainProgress


@pytest.fixture
def start(addon):
    jobs = []

    def run(code):
        jobs.append(addon("job").Job([sys.executable, "-I", "-u", "-c", f"import sys, time\n{code}"]))
        return jobs[-1]

    yield run
    for job in jobs:
        job.close()


def ended(job):
    job._reader.join()
    return job.status


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("42 %: tracing", (0.42, "tracing")),
        ("7 %: tracing, about 3 min left\n", (0.07, "tracing, about 3 min left")),
        ("250 %: strange", (1.0, "strange")),
        ("error: 42 %: no", None),
        ("", None),
        ("1000 %: no", None),
    ],
)
def test_lines_of_progress(addon, line, told):
    assert addon("job").parse_progress(line) == told


@pytest.mark.slow
@given(st.text(max_size=40))
def test_any_line(addon, line):
    told = addon("job").parse_progress(line)
    assert told is None or 0.0 <= told[0] <= 1.0


def test_lines_that_lippmann_itself_writes(addon, capsys, monkeypatch):
    monkeypatch.setattr("lippmann.progress_bar.PLAIN_INTERVAL", 0.0)
    PlainProgress()(Progress("trace", 1, 2))
    share, stage = addon("job").parse_progress(capsys.readouterr().err)
    assert 0.0 < share < 1.0
    assert stage == "tracing"


def test_a_run_that_goes_well(start):
    job = start("print('10 %: loading', file=sys.stderr)\nprint('60 %: tracing', file=sys.stderr)\nprint('{}')")
    assert ended(job) == 0
    assert (job.share, job.stage) == (0.6, "tracing")


def test_a_bar_never_runs_backwards(start):
    job = start("for share in (50, 20): print(f'{share} %: tracing', file=sys.stderr)")
    ended(job)
    assert job.share == 0.5


def test_the_one_line_on_what_went_wrong(start):
    job = start(
        "print('50 %: tracing', file=sys.stderr)\nprint('error: no such display', file=sys.stderr)\nsys.exit(2)"
    )
    assert ended(job) == 2
    assert job.error == "no such display"
    silent = start("sys.exit(3)")
    assert ended(silent) == 3
    assert silent.error == "exit status 3"


def test_an_end_on_request(start):
    job = start("print('1 %: loading', file=sys.stderr)\ntime.sleep(60)")
    assert job.status is None
    while job.stage == "starting":
        pass
    job.cancel()
    assert ended(job) != 0
    assert job.is_cancelled


def test_one_that_does_not_listen(start, addon, monkeypatch):
    monkeypatch.setattr(addon("job"), "_PATIENCE", 0.1)
    job = start(
        "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\nprint('1 %: a', file=sys.stderr)\ntime.sleep(60)"
    )
    while job.stage == "starting":
        pass
    job.close()
    assert job.status not in (None, 0)


def test_blenders_own_python_is_not_the_commands(start, monkeypatch):
    monkeypatch.setenv("PYTHONHOME", "/nowhere")
    job = start("import os\nprint(f\"100 %: {os.environ.get('PYTHONHOME')}\", file=sys.stderr)")
    assert ended(job) == 0
    assert job.stage == "None"
