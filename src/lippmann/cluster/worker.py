"""A Dask worker that starts the engine in advance and divides threads between Dask and the engine."""

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
    is_on_this_machine,
    warn_of_exposure,
)
from lippmann.cluster.log_lines import drop_tracebacks
from lippmann.cluster.private_scratch import private_scratch
from lippmann.cluster.tasks import THREADS_VARIABLE
from lippmann.errors import ClusterError, UsageError
from lippmann.runtime import machine
from lippmann.runtime.child_python import spawn_safely

#: Time in seconds without a scheduler after which a worker ends.
DEATH_SECONDS = 60


@dataclass(frozen=True)
class WorkerOptions:
    """Settings of a worker.

    Parameters
    ----------
    address:
        Address of the scheduler, ``tls://HOST:PORT`` or ``tcp://HOST:PORT``.
    threads:
        Threads of the engine, at least 1; None for all cores.
    memory:
        Limit in bytes beyond which Dask restarts the worker. None: the share of the machine's memory that corresponds
        to ``threads``.
    host:
        Address of this machine in the cluster's network. None: loopback, for a scheduler on this machine.
    name:
        Name of the worker in the dashboard; None for Dask's own.
    tls:
        Certificates for ``tls://``.

    Raises
    ------
    UsageError
        If the address is invalid, ``threads`` is below 1, or ``host`` is missing for a scheduler on another machine.
    """

    address: str
    threads: int | None = None
    memory: int | None = None
    host: str | None = None
    name: str | None = None
    tls: TlsFiles = field(default_factory=TlsFiles)

    def __post_init__(self) -> None:
        checked_address(self.address, "scheduler", "tcp://HOST:8786 or tls://HOST:8786")
        if self.threads is not None and self.threads < 1:
            raise UsageError(f"{self.threads} is out of range", parameter="threads", rule="it must be at least 1")
        if self.host is None and not is_on_this_machine(self.address):
            raise UsageError(
                "is missing",
                parameter="host",
                rule="a worker of a scheduler on another machine has to be reached from there",
                fix="give this machine's address in the cluster's network",
            )


def serve(options: WorkerOptions, *, quiet: bool = False, remark: Callable[[str], None] = lambda line: None) -> None:
    """Run a worker until its scheduler ends, or until SIGTERM or Ctrl-C.

    Parameters
    ----------
    options:
        Settings of the worker.
    quiet:
        Reduce Dask's log on standard error to errors.
    remark:
        Called with a warning, one line, if connections are not authenticated.

    Raises
    ------
    ClusterError
        If Dask is not installed, or no scheduler answers for :data:`DEATH_SECONDS` seconds.
    UsageError
        If a TLS file is missing.
    """
    if quiet:
        # Dask reads the variable when it is loaded, here and in the processes that it starts.
        os.environ.setdefault("DASK_DISTRIBUTED__LOGGING__DISTRIBUTED", "error")
    distributed = import_distributed()
    drop_tracebacks()
    security = options.tls.security(options.address)
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
            # The engine renders one tile at a time on all its threads; the second thread encodes the previous tile.
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
