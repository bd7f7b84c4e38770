"""When the command began: limits of time count from there, not from when all is loaded."""

from __future__ import annotations

import time

_began: list[float] = []


def start() -> None:
    """Say that a command begins now."""
    _began[:] = [time.perf_counter()]


def began() -> float | None:
    """Seconds of :func:`time.perf_counter` at which the command began; None outside of one."""
    return _began[0] if _began else None
