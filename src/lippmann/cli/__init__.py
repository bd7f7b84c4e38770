"""The command line: parse, call the library, leave with an exit code (:mod:`~lippmann.cli.outcome`).

Nothing is imported here that takes time: Ctrl-C is one line from the first moment.
"""

from __future__ import annotations

# signal, threading, typing and contextlib take as long as the interpreter.
import _signal  # type: ignore[import-not-found]
import _thread
import os
import sys
import time

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import NoReturn


def main(arguments: list[str] | None = None) -> None:
    """Run one command and leave the process with its exit code."""
    # A process that was started with interrupts ignored leaves them so.
    is_heard = _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler
    if is_heard:
        _signal.signal(_signal.SIGINT, _leave_early)
    from lippmann.cli import app, outcome
    from lippmann.cli.shared import standard_streams
    from lippmann.cli.shared.exit_codes import INTERRUPTED

    standard_streams.complete()
    words = list(sys.argv[1:] if arguments is None else arguments)
    debug = "--debug" in words
    words = [word for word in words if word != "--debug"]
    app.app_of(words)  # while an interrupt still ends the process at once
    try:
        if is_heard:
            sys.unraisablehook = _hear_again
            _signal.signal(_signal.SIGINT, _signal.default_int_handler)
        code = outcome.run(words, debug=debug)
    except KeyboardInterrupt:
        code = outcome.stopped()
    if is_heard:
        _signal.signal(_signal.SIGINT, lambda *_: os._exit(code))
    if code == INTERRUPTED:
        _end_at_once(code)
    sys.exit(code)


def run(words: list[str], *, debug: bool = False) -> int:
    """Run one command; errors become one line on standard error unless ``debug`` asks for the traceback."""
    from lippmann.cli import outcome

    return outcome.run(words, debug=debug)


def _leave_early(*_: object) -> NoReturn:
    """Ctrl-C before a command has begun."""
    try:
        os.write(2, b"lippmann: stopped; nothing was written\n")
    finally:
        os._exit(130)


def _hear_again(error: sys.UnraisableHookArgs) -> None:
    """An interrupt that struck where nothing can be raised, such as in a destructor, comes again."""
    if issubclass(error.exc_type, KeyboardInterrupt):
        _thread.start_new_thread(_interrupt_soon, ())
    else:
        sys.__unraisablehook__(error)


def _interrupt_soon() -> None:
    time.sleep(0.01)  # in the hook itself nothing can be raised either
    os.kill(os.getpid(), _signal.SIGINT)


def _end_at_once(code: int) -> NoReturn:
    """Leave the process without taking the interpreter down.

    Wherever Ctrl-C struck, files and folders are in order again by now; but an engine that was stopped in the middle of
    loading or compiling may still be at work in threads of its own, and breaks an interpreter that ends under it.
    """
    import multiprocessing

    for child in multiprocessing.active_children():
        child.kill()
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            continue
    os._exit(code)
