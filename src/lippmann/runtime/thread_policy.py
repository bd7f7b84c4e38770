"""The scheduling of this process's threads: kept while a library starts threads of its own, or behind all others."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_THREADS = Path("/proc/self/task")
#: Steps of niceness: a tenth of the processor time of a thread that competes.
_BEHIND = 10


def run_behind() -> None:
    """Let the calling thread, and those that it starts, have the processor time that other threads leave (Linux).

    A parallel stage of a renderer ends with its last thread: an encoder that takes a core by turns from one of them
    costs the stage more than the encoder's own time. Elsewhere nothing is done: niceness is of whole processes there.
    """
    if sys.platform == "linux":
        os.nice(_BEHIND)


@contextmanager
def keep_policy() -> Iterator[None]:
    """Leave the scheduling policy of every thread as it was, and give new ones that of the calling thread (Linux).

    SVT-AV1, where the user may (as root), puts the thread that opens it into real time (``SCHED_FIFO``, priority 99),
    with all its own: the process, and all that it starts from then on, would take a core from every other program, and
    two threads that wait for each other on one core would wait for ever.

    Elsewhere nothing is done: no other system's schedulers are met this way.
    """
    if not hasattr(os, "sched_getscheduler") or not _THREADS.is_dir():
        yield
        return
    before, own = _policies(), _policy(0)
    try:
        yield
    finally:
        for thread, policy in _policies().items():
            kept = scheduler, priority = before.get(thread, own)
            if policy != kept:
                with suppress(OSError):  # it may have ended since
                    os.sched_setscheduler(thread, scheduler, os.sched_param(priority))


def _policies() -> dict[int, tuple[int, int]]:
    """The policy and priority of each thread, by its number."""
    policies = {}
    for name in os.listdir(_THREADS):
        with suppress(OSError):
            policies[int(name)] = _policy(int(name))
    return policies


def _policy(thread: int) -> tuple[int, int]:
    return os.sched_getscheduler(thread), os.sched_getparam(thread).sched_priority
