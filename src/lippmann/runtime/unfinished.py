"""What this process has begun to write and not finished, and who puts it in order.

Who makes a temporary file or folder says beforehand how to undo it (:func:`undone`). It is undone where its block ends,
whatever ends it. An interrupt may strike in that very end; therefore the command line, before it leaves the process
after Ctrl-C, undoes what is left once more (:func:`undo_all`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

_undos: dict[object, Callable[[], None]] = {}
_remark = ""


class Unfinished:
    """Something that is undone by :func:`undo_all` unless it was settled before."""

    def __init__(self, undo: Callable[[], None]) -> None:
        self.undo = undo
        _undos[self] = undo

    def settle(self) -> None:
        """Nothing is left to undo."""
        _undos.pop(self, None)


@contextmanager
def undone(undo: Callable[[], None]) -> Iterator[None]:
    """Call ``undo`` at the end of the block. It may be called twice, and has nothing to do after a success.

    After an error it stays known to :func:`undo_all`: processes that were killed may have gone on for a moment.
    """
    begun = Unfinished(undo)
    try:
        yield
    finally:
        undo()
    begun.settle()


def undo_all() -> None:
    """Undo what is not finished, the last first."""
    while _undos:
        _, undo = _undos.popitem()
        with suppress(Exception):  # the others come all the same
            undo()


def remark(text: str) -> None:
    """Note what lies on disk on purpose if this process ends early, such as finished tiles; empty as work begins."""
    global _remark
    _remark = text


def last_remark() -> str:
    """What was noted last; empty if nothing was."""
    return _remark
