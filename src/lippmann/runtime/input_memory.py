"""How much memory may be taken for what a file holds, asked before it is taken.

A few bytes can stand for gigabytes: a header that names a size, or data that unpacks to a thousand times as much. Every
reader asks here before it allocates what a file wants.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from lippmann.errors import MemoryLimitError
from lippmann.runtime import machine

#: Bytes that are granted without a look at the machine, until as many were granted so.
_UNSEEN = 16 << 20


@dataclass
class _Limit:
    """``most`` bytes, of which ``granted`` were asked for in all, since the process had ``start``.

    What was granted may be free again, and what the process took besides may be libraries: the lesser of the two
    counts. ``unseen`` bytes were granted without a look.
    """

    most: int | None = None
    start: int = 0
    granted: int = 0
    unseen: int = 0

    @property
    def taken(self) -> int:
        """Bytes that are certainly taken for what files hold."""
        return min(self.granted, max(0, _resident() - self.start))


_limit: ContextVar[_Limit] = ContextVar("input memory")


@contextmanager
def limit_inputs(most: int | None) -> Iterator[None]:
    """Let what is read from files meanwhile take ``most`` bytes in all; None for all that is free."""
    before = _limit.set(_Limit(most, _resident() if most is not None else 0))
    try:
        yield
    finally:
        _limit.reset(before)


def check_input(size: int, what: str, *, where: str) -> None:
    """Ask for ``size`` bytes for something that a file holds.

    Parameters
    ----------
    what:
        What takes them, such as "texture 'wood.png'".
    where:
        The file.

    Raises
    ------
    MemoryLimitError
        There are not as many: neither free on the machine nor left of the limit of :func:`limit_inputs`.
    """
    limit = _current()
    limit.unseen += size
    if limit.unseen < _UNSEEN:
        limit.granted += size
        return
    limit.unseen = 0
    free, fix = _left(limit)
    limit.granted += size
    if size > free:
        took = f"{what} takes {_amount(size)} of memory"
        raise MemoryLimitError(took, where=where, rule=f"{_amount(free)} are left", fix=fix)


def input_memory_left() -> int:
    """Bytes that may still be taken for what files hold."""
    return _left(_current())[0]


def _current() -> _Limit:
    limit = _limit.get(None)
    if limit is None:
        limit = _Limit()
        _limit.set(limit)
    return limit


def _left(limit: _Limit) -> tuple[int, str]:
    """Bytes, and what gives more."""
    free = machine.available_memory()
    if limit.most is not None:
        left = max(0, limit.most - limit.taken)
        if left < free:
            return left, "allow more with memory=..."
    return free, "close other programs, or use a machine with more memory"


def _resident() -> int:
    import psutil

    return int(psutil.Process().memory_info().rss)


def _amount(size: int) -> str:
    return f"{size / 2**30:.1f} GiB" if size >= 1 << 30 else f"{max(1, round(size / 2**20))} MiB"
