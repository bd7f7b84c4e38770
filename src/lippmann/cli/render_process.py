"""The command line in a child process of the studio: its progress is told often, and it ends with the studio."""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
import time
from contextlib import suppress

from lippmann import progress_bar

#: Seconds between two lines of progress; logs of the command line itself stay shorter.
_INTERVAL = 0.4
#: Seconds that a render whose studio is gone has to remove its temporary files. A long kernel hears nothing.
_GRACE = 1.0


def main() -> None:
    """Run the command of the words after the program's name."""
    threading.Thread(target=_end_with_studio, daemon=True).start()
    from lippmann.cli import main as run

    progress_bar.PLAIN_INTERVAL = _INTERVAL
    if hasattr(os, "nice"):
        os.nice(5)  # the live picture goes first
    run(sys.argv[1:])


def _end_with_studio() -> None:
    """Wait for the end of standard input, whose other end the system closes when the studio ends; then end too."""
    while os.read(0, 1):
        pass
    _thread.interrupt_main()
    time.sleep(_GRACE)
    if sys.platform != "win32":
        with suppress(ProcessLookupError):
            os.killpg(os.getpid(), signal.SIGKILL)  # the group that it leads: what it started ends with it
    os._exit(1)
