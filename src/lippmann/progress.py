"""How long work reports how far it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """One report: ``done`` of ``total`` units of work of one stage (``load``, ``build``, ``trace``, ``write``, ...).

    Examples
    --------
    >>> report = lippmann.Progress("trace", done=3, total=4)
    >>> f"{report.stage}: {report.done / report.total:.0%}"
    'trace: 75%'
    """

    stage: str
    done: float
    total: float
    note: str = ""


ProgressCallback = Callable[[Progress], None]


def silent(_: Progress) -> None:
    """The callback of those who do not want to know."""


def of_part(progress: ProgressCallback, before: float, share: float, total: float) -> ProgressCallback:
    """Reports of a part of the work, a ``share`` of all that comes after ``before``, as reports of ``total`` units."""
    return lambda inner: progress(Progress(inner.stage, total * (before + share * inner.done / inner.total), total))
