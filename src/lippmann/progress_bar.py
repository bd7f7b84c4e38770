"""How far work is, for people: one bar in terminals and notebooks, a line now and then elsewhere.

The bar is that of the whole work and never runs backwards. Every stage has its share of it, by the time that it takes
as a rule; stages come back (samples are traced and denoised in turns), and only what is further than before counts.
"""

from __future__ import annotations

import html
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module

from lippmann.progress import Progress, ProgressCallback, silent

#: Seconds between two plain lines where output is not a terminal, and between two states of a notebook's bar.
PLAIN_INTERVAL, NOTEBOOK_INTERVAL = 5.0, 0.2

STAGE_NAMES = {
    "load": "loading",
    "build": "building the scene",
    "compile": "compiling",
    "probe": "trying pixels",
    "trace": "tracing",
    "tiles": "rendering tiles",
    "reuse": "reusing",
    "guides": "preparing the denoiser",
    "denoise": "denoising",
    "layers": "adding layers",
    "read": "reading",
    "compare": "comparing",
    "weave": "weaving",
    "draw": "drawing",
    "refocus": "refocusing",
    "sequence": "rendering frames",
    "write": "writing",
}
#: Shares of the whole, by stage; stages that do not come leave theirs to the end.
_SHARES = {"load": 4.0, "build": 4.0, "probe": 2.0, "guides": 8.0, "denoise": 10.0, "layers": 4.0, "write": 4.0}
_MAIN_SHARE = 64.0
#: Characters of a remark beside the bar, so that all fits 80 columns.
_REMARK = 24


class Overall:
    """The whole work's share done, 0 to 1, from reports of its stages: it never falls."""

    def __init__(self) -> None:
        self._furthest: dict[str, float] = {}
        self._main = 0.0

    def __call__(self, report: Progress) -> float:
        """The share after a report."""
        done = report.done / report.total if report.total > 0 else 0.0
        self._furthest[report.stage] = max(self._furthest.get(report.stage, 0.0), min(max(done, 0.0), 1.0))
        # Stages that are the work itself share what the others leave: the last one to move is the one that counts.
        main = [share for stage, share in self._furthest.items() if stage not in _SHARES]
        self._main = max(self._main, _MAIN_SHARE * (sum(main) / len(main) if main else 0.0))
        others = sum(_SHARES[stage] * share for stage, share in self._furthest.items() if stage in _SHARES)
        return (self._main + others) / (_MAIN_SHARE + sum(_SHARES.values()))


@contextmanager
def bar() -> Iterator[ProgressCallback]:
    """A bar on standard error that goes away when the work is done."""
    # rich takes a tenth of a second to load, which --help should not cost.
    from rich.console import Console
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as RichProgress

    columns = (
        TextColumn("{task.description:<18}"),
        BarColumn(bar_width=20),
        TaskProgressColumn(),
        TimeRemainingColumn(compact=True),
        TextColumn("{task.fields[remark]}"),
    )
    with RichProgress(*columns, console=Console(stderr=True), transient=True) as progress_bar:
        task = progress_bar.add_task("starting", total=1.0, remark="")
        overall = Overall()
        began = time.perf_counter()

        def report(progress: Progress) -> None:
            name, remark = _in_words(progress, began)
            progress_bar.update(task, completed=overall(progress), description=name, remark=remark[:_REMARK])

        yield report


@contextmanager
def notebook_bar() -> Iterator[ProgressCallback]:
    """A bar below a notebook's cell that goes away when the work is done. It is plain HTML: rich's needs ipywidgets."""
    shown = import_module("IPython.display").display({"text/plain": ""}, raw=True, display_id=True)
    overall, began, last = Overall(), time.perf_counter(), 0.0

    def report(progress: Progress) -> None:
        nonlocal last
        share, now = overall(progress), time.perf_counter()
        if now - last < NOTEBOOK_INTERVAL:
            return
        last = now
        line = " ".join((f"{100 * share:.0f} %", *_in_words(progress, began)))
        bar = f'<progress value="{share:.3f}"></progress> {html.escape(line)}'
        shown.update({"text/plain": line, "text/html": bar}, raw=True)

    try:
        yield report
    finally:
        shown.update({"text/plain": ""}, raw=True)


def _in_words(progress: Progress, began: float) -> tuple[str, str]:
    """Name of the stage, and a remark: its note, or the speed of tracing since ``began``."""
    remark = progress.note.split(", about ")[0]
    if not remark and progress.stage == "trace" and progress.done:
        remark = f"{progress.done / max(time.perf_counter() - began, 1e-9) / 1e6:.1f} M samples/s"
    return STAGE_NAMES.get(progress.stage, progress.stage), remark


class PlainProgress:
    """A line of text every few seconds, so that logs stay short; none that says what the last one said."""

    def __init__(self) -> None:
        self._last = time.perf_counter()
        self._line = ""
        self._overall = Overall()

    def __call__(self, progress: Progress) -> None:
        share = self._overall(progress)
        now = time.perf_counter()
        if now - self._last < PLAIN_INTERVAL or progress.done == 0:
            return
        note = f", {progress.note}" if progress.note else ""
        line = f"{100 * share:.0f} %: {STAGE_NAMES.get(progress.stage, progress.stage)}{note}"
        if line != self._line:
            self._last, self._line = now, line
            print(line, file=sys.stderr)


@contextmanager
def show_progress(progress: ProgressCallback | None) -> Iterator[ProgressCallback]:
    """The callback that was given; without one a bar in terminals and notebooks, and nothing elsewhere."""
    if progress is not None:
        yield progress
    elif in_notebook() or sys.stderr.isatty():
        with notebook_bar() if in_notebook() else bar() as callback:
            yield callback
    else:
        yield silent


def in_notebook() -> bool:
    """Whether a notebook's kernel runs this program."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return getattr(shell, "kernel", None) is not None
