"""Cores and memory that this process may use."""

from __future__ import annotations

import os
from pathlib import Path

_CONTROL_GROUP = Path("/sys/fs/cgroup")


def usable_cores() -> int:
    """Number of logical cores that this process may use, at least 1."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def total_memory() -> int:
    """Memory in bytes: that of the machine, or the container's limit if that is lower."""
    import psutil

    limit = _limit()
    total = int(psutil.virtual_memory().total)
    return total if limit is None else min(total, limit)


def available_memory() -> int:
    """Memory in bytes that is available now without swapping, within the container's limit."""
    import psutil

    available = int(psutil.virtual_memory().available)
    limit = _limit()
    if limit is None:
        return available
    return max(0, min(available, limit - _used()))


def _limit() -> int | None:
    """Memory limit of the container in bytes (control groups, version 2 or 1); None without one."""
    for name in ("memory.max", "memory/memory.limit_in_bytes"):
        try:
            text = (_CONTROL_GROUP / name).read_text().strip()
        except OSError:
            continue
        # "max" in version 2, a number near 2^63 in version 1: no limit.
        return int(text) if text.isdigit() and int(text) < 1 << 60 else None
    return None


def _used() -> int:
    """Memory in bytes that counts against the container's limit and cannot be reclaimed."""
    for usage, statistics, key in (
        ("memory.current", "memory.stat", "inactive_file"),
        ("memory/memory.usage_in_bytes", "memory/memory.stat", "total_inactive_file"),
    ):
        try:
            used = int((_CONTROL_GROUP / usage).read_text())
            fields = dict(line.split() for line in (_CONTROL_GROUP / statistics).read_text().splitlines())
        except OSError:
            continue
        return max(0, used - int(fields.get(key, 0)))
    return 0
