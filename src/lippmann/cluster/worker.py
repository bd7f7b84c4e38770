"""A worker that joins a cluster: Dask's own, with the engine warm and the right number of threads."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from lippmann.cluster.address import (
    LOOPBACK,
    TlsFiles,
    checked_address,
    import_distributed,
    is_loopback,
    warn_of_exposure,
)
from lippmann.cluster.private_scratch import private_scratch
from lippmann.cluster.tasks import THREADS_VARIABLE
from lippmann.errors import ClusterError, UsageError
from lippmann.runtime import machine
from lippmann.runtime.child_python import spawn_safely

#: Seconds without a scheduler after which a worker gives up.
DEATH_SECONDS = 60


@dataclass(frozen=True)
class WorkerOptions:
    """How a worker runs.

    Parameters
    ----------
    address:
        The scheduler's.
    threads:
        Of the engine; None for all cores.
    memory:
        Bytes beyond which Dask kills the worker and starts a new one; None for the threads' share of what there is.
    host:
        The address by which others reach this worker. None is enough where the scheduler runs on this machine;
        elsewhere it must be given: nothing is opened to the network without being told.
    name:
        What the dashboard calls it.

    Raises
    ------
    UsageError
        The address is none, or ``host`` is missing.
    """

    address: str
    threads: int | None = None
    memory: int | None = None
    host: str | None = None
    name: str | None = None
    tls: TlsFiles = field(default_factory=TlsFiles)

    def __post_init__(self) -> None:
        checked_address(self.address, "SCHEDULER", "tcp://HOST:8786 or tls://HOST:8786")
        if self.threads is not None and self.threads < 1:
            raise UsageError(f"{self.threads} threads are too few", where="--threads", rule="at least 1")
        if self.host is None and not is_loopback(self.address):
            raise UsageError(
                "is missing",
                where="--host",
                rule="a worker of a scheduler on another machine has to be reached from there",
                fix="give this machine's address in the cluster's network",
            )


def serve(options: WorkerOptions, *, quiet: bool = False, remark: Callable[[str], None] = lambda line: None) -> None:
    """Work for a scheduler until it ends, or until SIGTERM or Ctrl-C.

    Dask's own log goes to standard error; ``quiet`` leaves only errors of it. ``remark`` is called with a warning, in
    one line, where connections are not authenticated.

    Raises
    ------
    ClusterError
        Dask is not installed, or no scheduler answers for :data:`DEATH_SECONDS`.
    """
    if quiet:
        # Read when Dask is first loaded, here and in the processes that it starts.
        os.environ.setdefault("DASK_DISTRIBUTED__LOGGING__DISTRIBUTED", "error")
    distributed = import_distributed()
    security = options.tls.security()
    warn_of_exposure(options.address, security, remark)
    with private_scratch() as folder, spawn_safely():
        asyncio.run(_serve(distributed, options, security, folder))


async def _serve(distributed: Any, options: WorkerOptions, security: Any, folder: str) -> None:
    import dask

    cores = machine.usable_cores()
    threads = options.threads or cores
    memory = options.memory or int(machine.total_memory() * min(1.0, threads / cores))
    ended = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, ended.set)
    try:
        nanny = await distributed.Nanny(
            options.address,
            # The engine spreads one tile at a time over all its threads; beside it the tile before is packed.
            nthreads=min(threads, 2),
            memory_limit=memory,
            host=options.host or LOOPBACK,
            name=options.name,
            security=security,
            local_directory=folder,
            death_timeout=DEATH_SECONDS,
            dashboard=False,
            preload=[*dask.config.get("distributed.worker.preload", []), "lippmann.cluster.worker_preload"],
            env={THREADS_VARIABLE: str(threads)},
        )
    except (OSError, TimeoutError, TypeError, ValueError, RuntimeError) as error:
        why = " ".join(str(error).split())[:200]
        raise ClusterError(
            f"cannot join {options.address} ({type(error).__name__}: {why})", fix="is a scheduler running there?"
        ) from None
    waits = [asyncio.ensure_future(nanny.finished()), asyncio.ensure_future(ended.wait())]
    try:
        await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for wait in waits:
            wait.cancel()
        await nanny.close(timeout=10)
