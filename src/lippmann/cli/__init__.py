"""The command line: parse, call the library, leave with an exit code (:mod:`~lippmann.cli.app`).

Nothing is imported here that takes time: Ctrl-C is one line from the first moment. SIGTERM, and SIGHUP of a terminal
that is closed, end a command as Ctrl-C does.
"""

from __future__ import annotations

# signal, threading, typing and contextlib take as long as the interpreter.
import _signal  # type: ignore[import-not-found]
import _thread
import atexit
import gc
import os
import sys
import time

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import NoReturn

#: Signals that end a command, and what they do by default.
_ENDS = (
    (_signal.SIGINT, _signal.default_int_handler),
    *((getattr(_signal, name), _signal.SIG_DFL) for name in ("SIGTERM", "SIGHUP") if hasattr(_signal, name)),
)
#: Seconds after such a signal in which others are not heard, so that files and workers are put in order. After that the
#: end itself has come to a halt.
_DEAF = 5.0

_heard_at = -_DEAF


def main(arguments: list[str] | None = None) -> None:
    """Run one command and leave the process with its exit code."""
    # Signals that the process was started to ignore, as by nohup, stay ignored.
    ends = [number for number, default in _ENDS if _signal.getsignal(number) == default]
    _hear(ends, _leave_early)
    code = 1  # of a traceback, with --debug
    # The function registered first is called last: no one else has to hear of the end, and no caller goes on.
    if arguments is None and atexit._ncallbacks() == 0:
        atexit.register(lambda: _end_at_once(code))
    # What is loaded stays: the search for cycles among its 100 000 objects would take 2 to 4 % of a preview.
    gc.set_threshold(200_000)
    # NumPy's threads would wait for work with the processor at full load, and what they are given is small.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from lippmann.cli import app
    from lippmann.cli.shared import standard_streams
    from lippmann.cli.shared.exit_codes import INTERRUPTED

    standard_streams.complete()
    words = list(sys.argv[1:] if arguments is None else arguments)
    debug = "--debug" in words
    words = [word for word in words if word != "--debug"]
    app.app_of(words)  # while an interrupt still ends the process at once
    try:
        sys.unraisablehook = _hear_again
        _hear(ends, _interrupt)
        code = app.run(words, debug=debug)
    except KeyboardInterrupt:
        code = app.stopped()
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else int(error.code is not None)
        raise
    if code == INTERRUPTED:
        _put_in_order()
    _hear(ends, lambda *_: os._exit(code))
    if code == INTERRUPTED:
        _end_at_once(code)
    sys.exit(code)


def _hear(numbers: Sequence[int], handler: object) -> None:
    for number in numbers:
        _signal.signal(number, handler)


def _interrupt(*_: object) -> None:
    """Ctrl-C during a command."""
    global _heard_at
    if time.monotonic() - _heard_at >= _DEAF:
        _heard_at = time.monotonic()
        raise KeyboardInterrupt


def run(words: list[str], *, debug: bool = False) -> int:
    """Run one command; errors become one line on standard error unless ``debug`` asks for the traceback."""
    from lippmann.cli import app

    return app.run(words, debug=debug)


def _leave_early(*_: object) -> NoReturn:
    """Ctrl-C before a command has begun."""
    try:
        os.write(2, b"lippmann: stopped; nothing was written\n")
    finally:
        os._exit(130)


def _hear_again(error: sys.UnraisableHookArgs) -> None:
    """An interrupt that struck where nothing can be raised, such as in a destructor, comes again."""
    global _heard_at
    if issubclass(error.exc_type, KeyboardInterrupt):
        _heard_at = -_DEAF
        _thread.start_new_thread(_interrupt_soon, ())
    else:
        sys.__unraisablehook__(error)


def _interrupt_soon() -> None:
    time.sleep(0.01)  # in the hook itself nothing can be raised either
    os.kill(os.getpid(), _signal.SIGINT)


def _put_in_order() -> None:
    """End the processes and remove the files of a command that Ctrl-C has ended, where it struck in that very work."""
    from lippmann.runtime import atomic_write, child_python

    child_python.end_children(for_good=True)
    atomic_write.undo_all()


def _end_at_once(code: int) -> NoReturn:
    """Leave the process without taking the interpreter down.

    That takes a sixth of a second where an engine was loaded. One that was stopped in the middle of loading or
    compiling may still be at work in threads of its own, and breaks an interpreter that ends under it.
    """
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            continue
    os._exit(code)
