"""The command line in a child process of the studio, whose progress is told often enough for a bar."""

from __future__ import annotations

import os
import sys

from lippmann import progress_bar

#: Seconds between two lines of progress; logs of the command line itself stay shorter.
_INTERVAL = 0.4


def main() -> None:
    """Run the command of the words after the program's name."""
    from lippmann.cli import main as run

    progress_bar.PLAIN_INTERVAL = _INTERVAL
    if hasattr(os, "nice"):
        os.nice(5)  # the live picture goes first
    run(sys.argv[1:])
