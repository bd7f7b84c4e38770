"""Ctrl-C in a terminal while a picture is rendered by workers of this machine: what is said, and how long it takes.

Time on two cores: an estimated 15 minutes.

Each command runs in a terminal of its own (a pty), whose Ctrl-C goes to the command and to all processes that it has
started. It is pressed at delays spread evenly, half of the times from the start, half from when the first worker
starts; in every third run twice more, while the command puts its files in order. Counted are commands that do not end
within the limit, that say more than one line, and files that are left but those that the line names: the tiles that
--resume goes on with, or the whole picture.

python benchmarks/cluster_interrupts.py [COUNT [LONGEST_DELAY]]
"""

from __future__ import annotations

import os
import pty
import re
import select
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from harness import save

COUNT, LONGEST_DELAY = 48, 16.0
#: Seconds that the interpreter gets to load the first lines of the program, once it has started itself.
_FIRST = 0.1
#: Seconds in which a command has to end, and after which it is killed.
LIMIT, HANG = 5.0, 40.0
#: Seconds between two presses.
PAUSE = 0.15
PICTURE = "x.tif"
#: What a terminal shows of the keys and moves the cursor with; and the lines of a progress bar.
_CONTROL = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]|(\^C)+")
_BAR = re.compile(r"\d %|[━╸╺]")
WORDS = ("render", "primitives", "--cluster", "local:2", "--integrator", "direct", "--spp", "128", "-o")


def main(count: int, longest: float) -> None:
    outcomes: Counter[str] = Counter()
    runs = []
    for number in range(count):
        delay, with_workers = _FIRST + longest * number / count, bool(number % 2)
        presses = 3 if number % 3 == 2 else 1
        found = _interrupt(delay, with_workers, presses)
        runs.append({"delay": round(delay, 2), "with_workers": with_workers, "presses": presses, **found})
        outcomes[found["outcome"]] += 1
        print(f"{delay:5.2f} s: {found['outcome']}, {found['seconds']} s, exit code {found['code']}", flush=True)
    seconds = [run["seconds"] for run in runs if run["outcome"] != "finished before"]
    save(
        "cluster_interrupts",
        {
            "command": " ".join(("lippmann", *WORDS, PICTURE)),
            "limit_s": LIMIT,
            "counts": dict(outcomes),
            "slowest_s": max(seconds),
            "median_s": sorted(seconds)[len(seconds) // 2],
            "runs": runs,
        },
    )


def _interrupt(delay: float, with_workers: bool, presses: int) -> dict[str, Any]:
    """One command that gets Ctrl-C after so many seconds, as often as that."""
    import psutil

    with tempfile.TemporaryDirectory() as folder:
        has_started, starts = os.pipe()
        process, terminal = pty.fork()
        if not process:
            os.environ["TMPDIR"] = folder
            signal.signal(signal.SIGINT, signal.SIG_DFL)  # a shell lets what runs in the background ignore it
            # The end of a session's leader, which no command of a shell is, would end all who still print.
            signal.signal(signal.SIGHUP, signal.SIG_IGN)
            os.set_inheritable(starts, True)
            code = f"import os; os.close({starts}); from lippmann.cli import main; main()"
            os.execv(sys.executable, [sys.executable, "-c", code, *WORDS, f"{folder}/{PICTURE}"])
        os.close(starts)
        os.read(has_started, 1)  # until it is closed
        os.close(has_started)
        while with_workers and _is_running(process) and not psutil.Process(process).children():
            _read(terminal, time.monotonic() + 0.1)
        _read(terminal, time.monotonic() + delay)
        began = time.monotonic()
        if not _is_running(process):
            return {"outcome": "finished before", "seconds": 0.0, "code": 0, "said": []}
        said = ""
        for press in range(presses):
            os.write(terminal, b"\x03")
            said += _read(terminal, began + (HANG if press == presses - 1 else PAUSE * (press + 1)))
        code = None
        status = os.waitpid(process, os.WNOHANG)
        while not status[0] and time.monotonic() < began + HANG:
            time.sleep(0.02)
            status = os.waitpid(process, os.WNOHANG)
        seconds = round(time.monotonic() - began, 2)
        if status[0]:
            code = os.waitstatus_to_exitcode(status[1])
        else:
            os.kill(process, signal.SIGKILL)
            os.waitpid(process, 0)
        os.close(terminal)
        time.sleep(0.3)
        left = sorted(path.name for path in Path(folder).rglob("*") if path.suffix not in (".nbi", ".nbc"))
        lines = [_CONTROL.sub("", line).strip() for line in said.replace("\r", "\n").split("\n")]
        lines = [line for line in lines if line and not _BAR.search(line)]
        return {"outcome": _outcome(code, seconds, lines, left), "seconds": seconds, "code": code, "said": lines[-12:]}


def _outcome(code: int | None, seconds: float, lines: list[str], left: list[str]) -> str:
    if code is None:
        return "hangs"
    if any("Traceback" in line for line in lines):
        return "traceback"
    if len(lines) != 1 or not lines[0].startswith("lippmann: stopped"):
        return "another line"
    if seconds > LIMIT:
        return "late"
    if code != 130:
        return f"exit code {code}"
    if left and f"kept in {left[-1]}:" in lines[0]:
        return "one line, tiles kept"
    if left == [PICTURE] and f"{PICTURE} was written" in lines[0]:
        return "one line, written"
    return f"left {left[0]}" if left else "one line"


def _is_running(process: int) -> bool:
    return not os.waitid(os.P_PID, process, os.WEXITED | os.WNOHANG | os.WNOWAIT)


def _read(terminal: int, until: float) -> str:
    """What is printed until then, or until all who print have ended."""
    said = b""
    while (left := until - time.monotonic()) > 0:
        if select.select([terminal], [], [], left)[0]:
            try:
                part = os.read(terminal, 1 << 16)
            except OSError:  # nobody has it open any more
                break
            if not part:
                break
            said += part
    return said.decode(errors="replace")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT, float(sys.argv[2]) if len(sys.argv) > 2 else LONGEST_DELAY)
