"""Preload module of workers, as for ``dask worker --preload lippmann.cluster.worker_preload``: starts the engine."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lippmann.cluster.log_lines import drop_tracebacks
from lippmann.cluster.tasks import start_engine

if TYPE_CHECKING:
    from distributed import Worker


def dask_setup(worker: Worker) -> None:
    """Start the engine; Dask calls this function when a worker starts."""
    del worker
    drop_tracebacks()
    start_engine()
