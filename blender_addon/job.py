# SPDX-License-Identifier: GPL-3.0-or-later
"""A run of the command, watched from outside: how far it is, and what it said last."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
from collections import deque

_PROGRESS = re.compile(r"(\d{1,3}) %: (.{1,200})")
#: Lines of what it says that are kept.
_LINES = 20
#: Seconds from an interrupt to the end by force.
_PATIENCE = 5.0


def parse_progress(line: str) -> tuple[float, str] | None:
    """Share done, 0 to 1, and the stage of a line of progress; None of another line."""
    told = _PROGRESS.match(line)
    return None if told is None else (min(1.0, int(told[1]) / 100.0), told[2].strip())


class Job:
    """The command at work, in a process of its own; a thread reads what it says.

    Attributes
    ----------
    share, stage:
        How far it is, 0 to 1.
    is_cancelled:
        Whether :meth:`cancel` ended it.
    """

    def __init__(self, words: list[str]) -> None:
        self.share = 0.0
        self.stage = "starting"
        self.is_cancelled = False
        self._said: deque[str] = deque(maxlen=_LINES)
        environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
        self._process = subprocess.Popen(
            words,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            errors="replace",
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def status(self) -> int | None:
        """Exit status; None while it runs."""
        return None if self._reader.is_alive() else self._process.poll()

    @property
    def error(self) -> str:
        """Its one line on what went wrong."""
        line = self._said[-1] if self._said else f"exit status {self._process.returncode}"
        return line.removeprefix("lippmann: ").removeprefix("error: ")

    def cancel(self) -> None:
        """End it as Ctrl-C does; by force if it does not listen."""
        self.is_cancelled = True
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM if sys.platform == "win32" else signal.SIGINT)

    def close(self) -> None:
        """End it, and wait for its end."""
        self.cancel()
        try:
            self._process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join()

    def _read(self) -> None:
        assert self._process.stderr is not None
        with self._process.stderr as lines:
            for line in lines:
                told = parse_progress(line)
                if told is not None:
                    self.share, self.stage = max(self.share, told[0]), told[1]
                elif line.strip():
                    self._said.append(line.strip()[:500])
        self._process.wait()
