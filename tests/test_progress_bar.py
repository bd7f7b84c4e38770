"""Progress never runs backwards, and fits a terminal."""

from __future__ import annotations

import io
import sys
import types

import pytest

import lippmann
from lippmann.progress import Progress, silent
from lippmann.progress_bar import Overall, PlainProgress, show_progress


def shares(reports):
    overall = Overall()
    return [overall(report) for report in reports]


def test_stages_that_come_back_do_not_turn_it_back():
    turns = [
        Progress("load", 1, 1),
        *(Progress("trace", done, 100) for done in range(0, 101, 10)),
        *(Progress("denoise", done, 10) for done in range(11)),
        *(Progress("trace", done, 200) for done in range(0, 201, 20)),  # the goal has moved
        *(Progress("denoise", done, 10) for done in range(11)),
        Progress("write", 1, 1),
    ]
    found = shares(turns)
    assert found == sorted(found)
    assert 0 < found[0] < found[-1] <= 1


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        {"spp": 4},
        {"quality": 36, "spp": 64},
        {"method": "lens-view", "spp": 2},
        {"method": "full", "spp": 2, "layers": True},
    ],
)
def test_real_work_runs_forwards_to_the_end(engine, options):
    reports = []
    lippmann.render(
        "teapot", lippmann.load_display("seed-lenticular").resized(32, 24), progress=reports.append, **options
    )
    found = shares(reports)
    assert len(found) > 3
    assert found == sorted(found)
    assert found[-1] > 0.6


def test_a_callback_is_told_and_without_a_terminal_nothing_is_shown(monkeypatch):
    with show_progress(silent) as told:
        assert told is silent
    stream = io.StringIO()
    monkeypatch.setattr("sys.stderr", stream)
    with show_progress(None) as told:
        told(Progress("trace", 1, 2))
    assert stream.getvalue() == ""


def test_the_bar_fits_eighty_columns(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    stream = Terminal()
    monkeypatch.setattr("sys.stderr", stream)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.setenv("NO_COLOR", "1")
    with show_progress(None) as told:
        for done in range(5):
            told(Progress("guides", done, 4, "worst micro-image 33.3 dB, goal 40 dB, about 1234 s left"))
    lines = stream.getvalue().replace("\r", "\n").split("\n")
    assert all(len(line) <= 80 for line in lines)


def test_a_notebook_has_a_bar_of_its_own_that_goes_away(monkeypatch):
    shown = []
    handle = types.SimpleNamespace(update=lambda data, raw: shown.append(data))
    module = types.SimpleNamespace(display=lambda data, raw, display_id: handle)
    shell = types.SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell))
    monkeypatch.setitem(sys.modules, "IPython.display", module)
    monkeypatch.setattr("lippmann.progress_bar.NOTEBOOK_INTERVAL", 0.0)
    with show_progress(None) as told:
        told(Progress("trace", 1, 2, "<b>"))
    assert shown == [
        {"text/plain": "32 % tracing <b>", "text/html": '<progress value="0.320"></progress> 32 % tracing &lt;b&gt;'},
        {"text/plain": ""},
    ]


def test_plain_lines_do_not_repeat_themselves(monkeypatch, capsys):
    monkeypatch.setattr("lippmann.progress_bar.PLAIN_INTERVAL", 0.0)
    tell = PlainProgress()
    tell(Progress("trace", 0, 2))  # of what has only begun there is nothing to say
    for left in (9, 9, 8):
        tell(Progress("trace", 1, 2, f"about {left} s left"))
    assert capsys.readouterr().err.splitlines() == [f"32 %: tracing, about {left} s left" for left in (9, 8)]
