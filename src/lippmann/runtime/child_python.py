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
from collections.abc import Callable, Container, Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

VARIABLE = "PYTHONSAFEPATH"

#: Seconds that a killed process may take to be gone: it may wait for a disk.
_END_SECONDS = 1.0

_KNOWS_VARIABLE = sys.version_info >= (3, 11)

# ``sys`` is built into the interpreter: importing it searches no folder. ``-c`` adds the entry as an empty string.
_REMOVE_ENTRY = "import sys; sys.path[:1] == [''] and sys.path.pop(0)\n"

# The process that removes the semaphores of those that were killed would warn of each.
_BE_QUIET = "import warnings; warnings.simplefilter('ignore')\n"

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


def end_children(others: Container[object] = (), *, for_good: bool = False) -> None:
    """Kill the processes of :mod:`multiprocessing` but ``others``, and wait until they are gone.

    ``for_good``: this process ends; threads that would start new ones cannot.
    """
    import multiprocessing.util

    if for_good:
        util: Any = multiprocessing.util
        util.spawnv_passfds = _refuse
    children = [child for child in multiprocessing.active_children() if child not in others]
    for child in children:
        child.kill()
    for child in children:
        child.join(_END_SECONDS)


def _refuse(*_: object) -> NoReturn:
    raise OSError("this process is ending")


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
        place = words.index("-c") + 1
        words[place] = prefix + (_BE_QUIET if "resource_tracker" in words[place] else "") + words[place]
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
