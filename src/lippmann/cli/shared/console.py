"""What the commands say: results on standard output, remarks and progress on standard error."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

from lippmann.cli.shared.option_names import translated
from lippmann.progress import Progress, ProgressCallback, silent

#: Seconds between two plain progress lines where output is not a terminal.
PLAIN_INTERVAL = 5.0

STAGE_NAMES = {
    "load": "loading",
    "build": "building the scene",
    "compile": "compiling",
    "probe": "trying a few pixels",
    "trace": "tracing",
    "tiles": "rendering tiles",
    "reuse": "reusing",
    "guides": "looking for guides",
    "denoise": "denoising",
    "layers": "adding layers",
    "read": "reading",
    "weave": "weaving",
    "draw": "drawing",
    "refocus": "refocusing",
    "sequence": "rendering frames",
    "write": "writing",
}


@dataclass(frozen=True)
class Console:
    """How one command talks: ``quiet`` says nothing but errors, ``as_json`` prints one object at the end."""

    quiet: bool = False
    as_json: bool = False

    def result(self, values: Mapping[str, object], lines: str = "") -> None:
        """The outcome: the object with ``--json``, else ``lines`` for people."""
        if self.as_json:
            print(json.dumps(values, ensure_ascii=False, allow_nan=False))
        elif lines and not self.quiet:
            print(lines)

    def remark(self, line: str) -> None:
        """One line that is no result: a note or a warning, its parameters as options."""
        if not self.quiet:
            print(translated(line), file=sys.stderr)

    @contextmanager
    def progress(self) -> Iterator[ProgressCallback]:
        """A progress bar on a terminal, a line now and then elsewhere, nothing when quiet."""
        if self.quiet:
            yield silent
        elif sys.stderr.isatty():
            with _bar() as callback:
                yield callback
        else:
            yield _PlainProgress()


@contextmanager
def _bar() -> Iterator[ProgressCallback]:
    # rich takes a tenth of a second to load, which --help should not cost.
    from rich.console import Console as RichConsole
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as RichProgress

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with RichProgress(*columns, console=RichConsole(stderr=True), transient=True) as bar:
        task = bar.add_task("starting", total=None, rate="")
        current = ""
        began = time.perf_counter()

        def report(progress: Progress) -> None:
            nonlocal current, began
            if progress.stage != current:
                current, began = progress.stage, time.perf_counter()
                bar.reset(task, description=STAGE_NAMES.get(current, current), total=progress.total, rate="")
            rate = progress.note
            if not rate and progress.stage == "trace" and progress.done:
                rate = f"{progress.done / max(time.perf_counter() - began, 1e-9) / 1e6:.1f} M samples/s"
            bar.update(task, completed=progress.done, total=progress.total, rate=rate)

        yield report


def estimate_in_words(estimate: Mapping[str, object], part: str = "micro-image") -> str:
    """What a picture says of its own error, as :attr:`Provenance.estimate` holds it; a quilt's parts are views."""
    from lippmann.rendering.estimate.psnr import Estimate

    return Estimate.from_dict(estimate).in_words(part)


class _PlainProgress:
    """A line of text every few seconds, so that logs stay short."""

    def __init__(self) -> None:
        self._last = time.perf_counter()

    def __call__(self, progress: Progress) -> None:
        now = time.perf_counter()
        if now - self._last < PLAIN_INTERVAL or progress.done == 0:
            return
        self._last = now
        share = 100 * progress.done / progress.total
        note = f", {progress.note}" if progress.note else ""
        print(f"{STAGE_NAMES.get(progress.stage, progress.stage)}: {share:.0f} %{note}", file=sys.stderr)
