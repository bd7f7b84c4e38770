"""Child Python processes that import nothing from the working directory.

``python -c`` puts the working directory first on ``sys.path``, and :mod:`multiprocessing` starts its children so: a
file ``socket.py`` beside a downloaded scene would run. Python 3.11 and newer omit the entry if ``PYTHONSAFEPATH`` is
set. For older versions the first statement of the child's code removes it.

Processes of :mod:`multiprocessing` do not hear Ctrl-C, which a terminal sends to all of a command's processes at once:
who started them ends them.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

VARIABLE = "PYTHONSAFEPATH"

_KNOWS_VARIABLE = sys.version_info >= (3, 11)

# ``sys`` is built into the interpreter: importing it searches no folder. ``-c`` adds the entry as an empty string.
_REMOVE_ENTRY = "import sys; sys.path[:1] == [''] and sys.path.pop(0)\n"

_lock = threading.Lock()
_users = 0
_undo: Callable[[], None] | None = None


def python_command(code: str, *arguments: str) -> tuple[list[str], dict[str, str]]:
    """Command line and environment of a child Python that runs ``code`` without the working directory on its path.

    The child inherits the environment, including ``PYTHONPATH``, and finds ``arguments`` in ``sys.argv[1:]``.
    """
    if not _KNOWS_VARIABLE:
        code = _REMOVE_ENTRY + code
    return [sys.executable, "-c", code, *arguments], {**os.environ, VARIABLE: "1"}


@contextmanager
def spawn_safely() -> Iterator[None]:
    """Context in which processes spawned by :mod:`multiprocessing` import nothing from the working directory, and are
    deaf to Ctrl-C.

    Once such a process has started, its ``sys.path`` is a copy of this process's, as usual. The setting belongs to the
    whole process: it begins with the first thread that enters and ends with the last that leaves.
    """
    global _users, _undo
    with _lock:
        _users += 1
        if _users == 1:
            # Children of ``python -E`` are started with ``-E``, too, and ignore the variable.
            reads_variable = _KNOWS_VARIABLE and not sys.flags.ignore_environment
            _undo = _wrap_spawn("" if reads_variable else _REMOVE_ENTRY)
    try:
        yield
    finally:
        with _lock:
            _users -= 1
            if _users == 0 and _undo is not None:
                _undo()


def _wrap_spawn(prefix: str) -> Callable[[], None]:
    """Wrap the one function by which multiprocessing starts children, resource tracker and fork server.

    They get :data:`VARIABLE`, ``prefix`` before their code, and a signal mask without SIGINT, which is inherited from
    the thread that starts them. The result undoes it.
    """
    from multiprocessing import util

    spawn: Any = util.spawnv_passfds
    saved = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = "1"

    def wrapped(path: Any, args: Any, passfds: Any) -> Any:
        words = list(args)
        words[words.index("-c") + 1] = prefix + words[words.index("-c") + 1]
        heard = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return spawn(path, words, passfds)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, heard)

    def undo() -> None:
        util.spawnv_passfds = spawn
        if saved is None:
            os.environ.pop(VARIABLE, None)
        else:
            os.environ[VARIABLE] = saved

    util.spawnv_passfds = wrapped
    return undo
