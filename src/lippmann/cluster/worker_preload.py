"""Preloaded by workers (``dask worker --preload lippmann.cluster.worker_preload`` does the same): starts the engine."""

from __future__ import annotations

from typing import Any

from lippmann.cluster.tasks import warm


def dask_setup(worker: Any) -> None:
    """Called by Dask when a worker starts."""
    del worker
    warm()
