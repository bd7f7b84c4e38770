"""How long work reports how far it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """One report: ``done`` of ``total`` units of work of one stage (``load``, ``build``, ``trace``, ``write``, ...)."""

    stage: str
    done: float
    total: float
    note: str = ""


ProgressCallback = Callable[[Progress], None]


def silent(_: Progress) -> None:
    """The callback of those who do not want to know."""
