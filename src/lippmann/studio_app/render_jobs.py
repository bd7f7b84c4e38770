"""Full renders beside the live picture: each is a command line, run in a process of its own.

A process can be stopped at once, keeps what it needs of memory to itself, and leaves the engine of the studio to the
live picture. What is run is what the page shows to copy. It ends with the studio, however that ends: its standard input
is a pipe that the studio holds open (see :mod:`lippmann.cli.render_process`).
"""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from lippmann.errors import UsageError
from lippmann.options.forms import LEFT_OUT
from lippmann.options.option import kinds_of, options_of
from lippmann.options.quality import QualityOptions
from lippmann.progress_bar import STAGE_NAMES
from lippmann.runtime.child_python import python_command
from lippmann.studio_app.output_names import OutputClaim, claim_output, frames_of, is_unfinished
from lippmann.studio_app.page_values import shell_line

Kind = Literal["picture", "quilt", "turntable", "print"]
Shows = Literal["picture", "image", "film"]
Phase = Literal["running", "done", "failed", "cancelled"]

KINDS: tuple[Kind, ...] = ("picture", "quilt", "turntable", "print")
#: The command that makes quilts and stereo pairs.
QUILT_RENDER = ("lippmann", "quilt", "render")

#: Frames of a turntable; a loop of two seconds.
TURNTABLE_FRAMES = 48
#: Margin with alignment marks around a print.
PRINT_MARGIN = "10mm"

#: Seconds that a cancelled render is given to end by itself.
PATIENCE = 5.0

ENDINGS: dict[Kind, str] = {"picture": ".png", "quilt": ".png", "turntable": ".mp4", "print": ".tif"}

_SHOWS: dict[Kind, Shows] = {"picture": "picture", "quilt": "image", "turntable": "film", "print": "picture"}

#: Share, stage and remark of a line of progress.
_PROGRESS = re.compile(r"(\d{1,3}) %: ([^,\n]{1,80})(?:, (.{1,200}))?")
#: Stages of a render for those who make no renderers; others are told as they are.
_STAGE_WORDS = {
    "load": "Opening the scene",
    "build": "Preparing the scene",
    "compile": "Preparing the scene",
    "probe": "Looking at some pixels",
    "trace": "Tracing light",
    "tiles": "Tracing light",
    "denoise": "Removing noise",
    "sequence": "Rendering the film",
    "draw": "Drawing the marks",
    "write": "Saving the file",
}
_WORDS_OF = {STAGE_NAMES[stage]: words for stage, words in _STAGE_WORDS.items()}
#: A rate is known from so many seconds and such a share on: kernels are compiled first.
_RATE_SECONDS, _RATE_SHARE = 4.0, 0.05
_FORESEEN = re.compile(r"about (\d{1,9}) s left")

_CODE = "from lippmann.cli.render_process import main; main()"


@dataclass(frozen=True)
class Job:
    """A full render.

    Attributes
    ----------
    number:
        Counted from 1.
    kind, words:
        What is made, and its command line from ``lippmann`` on.
    settings:
        Command line of the state that is rendered, as the page shows it.
    output:
        The file that it makes.
    phase, share, stage, seconds_left:
        How far it is: ``share`` is 0 to 1; it and the time left are None while they are unknown.
    line:
        The last line of an ended one: its result, or what went wrong.
    can_resume:
        Whether a cancelled or failed one has finished parts, with which it goes on.
    """

    number: int
    kind: Kind
    words: tuple[str, ...]
    output: Path
    settings: str = ""
    phase: Phase = "running"
    share: float | None = None
    stage: str = ""
    seconds_left: float | None = None
    line: str = ""
    can_resume: bool = False

    @property
    def shows(self) -> Shows:
        """How the page shows the output: as its display does, as it is, or as a film."""
        return _SHOWS[self.kind]

    def message(self) -> dict[str, object]:
        """The job as a message for the page."""
        return {
            "type": "job",
            "number": self.number,
            "kind": self.kind,
            "name": self.output.name,
            "phase": self.phase,
            "share": self.share,
            "stage": self.stage,
            "seconds_left": self.seconds_left,
            "settings": self.settings,
            "line": self.line,
            "can_resume": self.can_resume,
            "shows": self.shows,
            "command": shlex.join(self.words),
        }


def command_of(kind: Kind, words: list[str], output: Path) -> tuple[str, ...]:
    """Command line that makes ``output``.

    Parameters
    ----------
    kind:
        What to make.
    words:
        ``lippmann render`` of the state, with all its options; of an eye-tracked monitor ``lippmann quilt render``.
    output:
        A new file.
    """
    count = words.index("render") + 1
    head, options = words[:count], _without(words[count:], ("-o", "--output"), has_value=True)
    if kind == "quilt":
        return (*QUILT_RENDER, *of_quilts(options), "-o", str(output))
    if kind == "turntable":
        frames = frames_of(output)
        film = ("--turntable", str(TURNTABLE_FRAMES), "--video", str(output), "--resume")
        return (*head, *options, *film, "-o", str(frames))
    if kind == "print":
        return (*head, *options, "--marks", PRINT_MARGIN, "-o", str(output))
    return (*head, *options, "--resume", "-o", str(output))


def of_quilts(words: list[str]) -> list[str]:
    """Options of a picture without those that a quilt has not."""
    for each, its in options_of(QualityOptions):
        if each.name in LEFT_OUT["quilt"]:
            flag, is_switch = its.flag_of(each.name), bool in kinds_of(each.type)
            words = _without(words, (flag, f"--no-{flag[2:]}"), has_value=not is_switch)
    return words


class JobRunner:
    """Runs one full render at a time.

    Parameters
    ----------
    folder:
        Where outputs are written. The files that command lines name are found from the working directory of now.
    changed:
        Called with the job after every change, in a thread of the runner.
    """

    def __init__(self, folder: Path, changed: Callable[[Job], None]) -> None:
        self._folder = folder
        self._start = Path.cwd()
        self._changed = changed
        self._lock = threading.Lock()
        self._process: subprocess.Popen[str] | None = None
        self._is_cancelled = False
        self._jobs: list[Job] = []
        self._claim: OutputClaim | None = None

    @property
    def last(self) -> Job | None:
        """The last job."""
        return self._jobs[-1] if self._jobs else None

    def finished(self, number: int) -> Job | None:
        """The job of this number if it is done."""
        with self._lock:
            job = self._jobs[number - 1] if 1 <= number <= len(self._jobs) else None
        return job if job is not None and job.phase == "done" else None

    def start(self, kind: Kind, words: list[str], stem: str, ending: str | None = None) -> None:
        """Begin a render.

        Parameters
        ----------
        kind, words:
            As for :func:`command_of`.
        stem, ending:
            Beginning and end of the output's name; a number comes between them where that name is not free.

        Raises
        ------
        UsageError
            If one is running.
        OutputError
            If the folder cannot be written to.
        """
        with self._lock:
            self._check_idle()
            claim = claim_output(self._folder, stem, ending or ENDINGS[kind])
            self._release_claim()
            self._claim = claim
            self._jobs.append(
                Job(len(self._jobs) + 1, kind, command_of(kind, words, claim.output), claim.output, shell_line(words))
            )
            self._launch()

    def resume(self) -> None:
        """Go on with the last render, if it can be; a UsageError otherwise."""
        with self._lock:
            self._check_idle()
            job = self.last
            if job is None or not job.can_resume:
                raise UsageError("there is nothing to go on with", fix="start a render")
            self._jobs[-1] = replace(
                job, phase="running", share=None, stage="", seconds_left=None, line="", can_resume=False
            )
            self._launch()

    def cancel(self) -> None:
        """End the render that runs, as Ctrl-C does; one that is not heard is killed soon.

        A long kernel hears nothing. What is killed can go on as after a power cut: finished tiles are kept.
        """
        with self._lock:
            process = self._process
            if process is None or self._is_cancelled:
                return
            self._is_cancelled = True
            self._jobs[-1] = job = replace(self._jobs[-1], share=None, stage="Cancelling", seconds_left=None)
            process.send_signal(signal.SIGINT if sys.platform != "win32" else signal.SIGTERM)
        self._changed(job)
        threading.Thread(target=_kill_late, args=(process,), daemon=True).start()

    def close(self) -> None:
        """End the render that runs, and wait for its end."""
        self.cancel()
        process = self._process
        if process is not None:
            try:
                process.wait(2 * PATIENCE)
            except subprocess.TimeoutExpired:
                _kill(process)
        with self._lock:
            self._release_claim()

    def _release_claim(self) -> None:
        if self._claim is not None:
            self._claim.release()

    def _check_idle(self) -> None:
        if self._process is not None:
            raise UsageError("a render is running", fix="cancel it, or wait for its end")

    def _launch(self) -> None:
        job = self._jobs[-1]
        command, environment = python_command(_CODE, *job.words[1:])
        self._is_cancelled = False
        self._process = subprocess.Popen(
            command,
            cwd=self._start,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            errors="replace",
            # Ctrl-C in the terminal is for the studio, which ends its render; and what a render starts ends with it.
            start_new_session=True,
        )
        threading.Thread(target=self._watch, args=(self._process,), daemon=True).start()
        self._changed(job)

    def _watch(self, process: subprocess.Popen[str]) -> None:
        """Read what the process says until it ends."""
        said, began = "", time.monotonic()
        assert process.stderr is not None
        with process.stderr:
            for line in process.stderr:
                match = _PROGRESS.match(line)
                if match is None:
                    said = line.strip()[:500] or said
                else:
                    share, name, remark = min(1.0, int(match[1]) / 100), match[2].strip(), match[3] or ""
                    left = seconds_left(share, time.monotonic() - began, remark)
                    self._update(share, _WORDS_OF.get(name, name.capitalize()), left)
        code = process.wait()
        with self._lock:
            self._process = None
            if process.stdin is not None:
                process.stdin.close()
            job = self._jobs[-1]
            is_done = code == 0 and job.output.exists()
            phase: Phase = "done" if is_done else "cancelled" if self._is_cancelled else "failed"
            line = said.removeprefix("lippmann: ") if phase == "failed" else str(job.output) if is_done else ""
            can_resume = not is_done and "--resume" in job.words and is_unfinished(job.output)
            job = self._jobs[-1] = replace(job, phase=phase, line=line, can_resume=can_resume)
            if not can_resume:
                self._release_claim()
        self._changed(job)

    def _update(self, share: float, stage: str, seconds_left: float | None) -> None:
        with self._lock:
            if self._is_cancelled:
                return
            job = self._jobs[-1] = replace(self._jobs[-1], share=share, stage=stage, seconds_left=seconds_left)
        self._changed(job)


def seconds_left(share: float, elapsed: float, remark: str) -> float | None:
    """Seconds that a render still takes: as its own ``remark`` foresees, or as its share and its time so far tell."""
    foreseen = _FORESEEN.search(remark)
    if foreseen is not None:
        return float(foreseen[1])
    if share < _RATE_SHARE or elapsed < _RATE_SECONDS:
        return None
    return elapsed * (1.0 - share) / share


def _kill_late(process: subprocess.Popen[str]) -> None:
    try:
        process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        _kill(process)


def _kill(process: subprocess.Popen[str]) -> None:
    """End a process and all that it started."""
    if sys.platform == "win32":
        process.kill()
    else:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def _without(words: list[str], options: tuple[str, ...], *, has_value: bool = False) -> list[str]:
    """The words without these options and, if they have some, their values."""
    kept: list[str] = []
    skips = False
    for word in words:
        if skips:
            skips = False
        elif word in options:
            skips = has_value
        else:
            kept.append(word)
    return kept
