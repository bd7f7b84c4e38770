"""Connections to Dask clusters: to a running scheduler, or to workers started on this machine."""

from __future__ import annotations

import copy
import logging
import multiprocessing
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from lippmann.cluster.address import (
    LOOPBACK,
    Target,
    TlsFiles,
    import_distributed,
    temporary_security,
    warn_of_exposure,
)
from lippmann.cluster.private_scratch import private_scratch
from lippmann.cluster.reachable import check_reachable
from lippmann.cluster.tasks import THREADS_VARIABLE
from lippmann.cluster.worker_roster import Roster
from lippmann.errors import ClusterError, UsageError
from lippmann.runtime import machine
from lippmann.runtime.child_python import end_children, spawn_safely

if TYPE_CHECKING:
    from distributed import Client, Future

#: Time limit in seconds for a scheduler to answer.
CONNECT_SECONDS = 20
#: Seconds in which a client and the workers of this machine may end by themselves.
CLOSE_SECONDS = 3

_LOGGERS = (
    *("distributed", "distributed.client", "distributed.nanny", "distributed.scheduler", "distributed.worker"),
    *("asyncio", "tornado.application"),
)


@dataclass(frozen=True)
class Cluster:
    """A connected cluster, on which :func:`lippmann.cluster.runner.run_on` renders.

    Attributes
    ----------
    client:
        The connected client.
    roster:
        The workers that take part.
    name:
        Name for messages: the scheduler's address, or ``local:N``.
    remark:
        Called with one line on each event, such as a lost worker.
    parts:
        Futures of the scene's parts on the cluster, by content hash.
    """

    client: Client
    roster: Roster
    name: str
    remark: Callable[[str], None]
    parts: dict[str, Future] = field(default_factory=dict)


@contextmanager
def connect(
    target: Target,
    tls: TlsFiles | None = None,
    *,
    threads: int | None = None,
    remark: Callable[[str], None] = lambda line: None,
) -> Iterator[Cluster]:
    """Connect to a scheduler, or start workers on this machine for this process alone.

    Parameters
    ----------
    target:
        The scheduler's address, or the number of workers to start.
    tls:
        Certificates for a ``tls://`` address. Workers of this machine get a temporary certificate of their own.
    threads:
        Threads of all workers of this machine together; None for all cores.
    remark:
        Called with one line on each event, and with a warning if connections are not authenticated.

    Yields
    ------
    The connected cluster.

    Raises
    ------
    ClusterError
        If Dask is not installed, or the scheduler does not answer.
    UsageError
        If a TLS file is missing, or TLS files are given for workers of this machine.
    """
    distributed = import_distributed()
    _silence_dask()
    tls = tls or TlsFiles()
    if target.local is not None:
        for name, path in tls.options().items():
            if path is not None:
                raise UsageError("is for tls://HOST:8786", parameter=name, rule="local:N makes its own certificate")
        with _started_here(distributed, target.local, threads) as client, _watch(client) as roster:
            yield Cluster(client, roster, f"local:{target.local}", remark)
        return
    assert target.address is not None
    security = tls.security(target.address)
    # Before connecting: whoever listens there can send code as soon as the connection is open.
    warn_of_exposure(target.address, security, remark)
    check_reachable(target.address, tls.ca, tls.certificate, tls.key)
    try:
        client = distributed.Client(
            target.address, security=security, timeout=CONNECT_SECONDS, set_as_default=False, name="lippmann"
        )
    except (OSError, TimeoutError, TypeError, ValueError, RuntimeError) as error:
        raise ClusterError(
            f"no scheduler answers at {target.address} ({_in_brief(error)})",
            parameter="cluster",
            fix="start one: dask scheduler",
        ) from None
    try:
        with _watch(client) as roster:
            _remark_on_dashboard(client, remark)
            yield Cluster(client, roster, target.address, remark)
    finally:
        client.close(timeout=CLOSE_SECONDS)


@contextmanager
def _started_here(distributed: Any, count: int, threads: int | None) -> Iterator[Client]:
    """A client of workers that other accounts of this machine can neither use nor give files to."""
    import dask

    each = max(1, (threads or machine.usable_cores()) // count)
    security = temporary_security()
    with private_scratch() as folder, spawn_safely(), ExitStack() as stack:
        stack.callback(end_children, frozenset(multiprocessing.active_children()))
        # Dask's HTTP servers answer everyone and cannot be disabled, so they get no pages.
        pages: dict[str, Any] = {"distributed.scheduler.http.routes": [], "distributed.worker.http.routes": []}
        with dask.config.set({"temporary-directory": folder, **pages}):
            try:
                cluster = distributed.LocalCluster(
                    n_workers=count,
                    threads_per_worker=1,
                    processes=True,
                    host=LOOPBACK,
                    security=security,
                    # Without an address the scheduler's HTTP server would be open to the network.
                    dashboard_address=f"{LOOPBACK}:0",
                    scheduler_kwargs={"dashboard": False},
                    worker_dashboard_address=None,
                    local_directory=folder,
                    memory_limit=machine.total_memory() // count,
                    silence_logs=logging.CRITICAL,
                    env={THREADS_VARIABLE: str(each)},
                    # Workers that are started later as replacements have the same configuration.
                    config=copy.deepcopy(dask.config.config),
                )
            except (OSError, TimeoutError, RuntimeError) as error:
                raise ClusterError(
                    f"the workers of this machine did not start ({_in_brief(error)})",
                    parameter="cluster",
                    fix="run it again, with fewer workers if memory is short",
                ) from None
        # Dask's own attempt at the end of the program would be another one, and a traceback where it fails, too.
        cluster.shutdown_on_close = False
        stack.callback(_in_time, cluster.close)
        client = distributed.Client(cluster, set_as_default=False, name="lippmann")
        stack.callback(_in_time, client.close)
        # The active memory manager would remove copies of the scene from workers between tiles.
        client.amm.stop()
        yield client


def _in_time(close: Callable[[], object]) -> None:
    """Close something of Dask's; its own time limits do not hold where an event loop was interrupted."""
    thread = threading.Thread(target=_close_quietly, args=(close,), daemon=True)
    thread.start()
    thread.join(CLOSE_SECONDS / 2)


def _close_quietly(close: Callable[[], object]) -> None:
    with suppress(Exception):  # what is not closed is killed
        close()


@contextmanager
def _watch(client: Client) -> Iterator[Roster]:
    roster = Roster(client)
    try:
        yield roster
    finally:
        roster.close()


def _remark_on_dashboard(client: Client, remark: Callable[[str], None]) -> None:
    if find_spec("bokeh") and client.dashboard_link:
        remark(f"the cluster's dashboard: {client.dashboard_link}")


def _silence_dask() -> None:
    """Silence Dask's log, which would break the progress bar; failures of workers are reported as remarks."""
    if not sys.flags.dev_mode:
        for name in _LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL)


def _in_brief(error: Exception) -> str:
    """The error's kind and text on one line of limited length."""
    return f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
