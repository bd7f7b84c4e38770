"""A connection to a cluster, or to one started here, for as long as pictures are rendered on it."""

from __future__ import annotations

import copy
import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any

from lippmann.cluster.address import (
    LOOPBACK,
    Target,
    TlsFiles,
    import_distributed,
    temporary_security,
    warn_of_exposure,
)
from lippmann.cluster.private_scratch import private_scratch
from lippmann.cluster.tasks import THREADS_VARIABLE
from lippmann.cluster.worker_roster import Roster
from lippmann.errors import ClusterError, UsageError
from lippmann.runtime import machine
from lippmann.runtime.child_python import spawn_safely

#: Seconds to wait for a scheduler to answer.
CONNECT_SECONDS = 20

_LOGGERS = ("distributed", "distributed.client", "distributed.nanny", "distributed.scheduler", "distributed.worker")


@dataclass(frozen=True)
class Cluster:
    """A connected cluster; :func:`lippmann.cluster.runner.run_on` renders on it.

    Attributes
    ----------
    client:
        The ``distributed.Client``.
    roster:
        Who may take part.
    name:
        What messages call it.
    remark:
        Called with one line about what happens on the way.
    parts:
        Dask's futures of the scene's parts that are there, by content hash.
    """

    client: Any
    roster: Roster
    name: str
    remark: Callable[[str], None]
    parts: dict[str, Any] = field(default_factory=dict)


@contextmanager
def connect(
    target: Target,
    tls: TlsFiles | None = None,
    *,
    threads: int | None = None,
    remark: Callable[[str], None] = lambda line: None,
) -> Iterator[Cluster]:
    """Connect to a scheduler, or start workers on this machine that only this process can use.

    Parameters
    ----------
    tls:
        Certificates for a scheduler's ``tls://`` address. Workers that are started here have a certificate of their
        own, made for the occasion.
    threads:
        Of workers that are started here, all together; by default all cores.
    remark:
        Called with one line about what happens on the way, and with a warning of connections that are not
        authenticated.

    Raises
    ------
    ClusterError
        Dask is not installed, or the scheduler does not answer.
    UsageError
        Files for encryption are missing, or are given for workers that are started here.
    """
    distributed = import_distributed()
    _hush()
    tls = tls or TlsFiles()
    if target.local is not None:
        for option, path in tls.options().items():
            if path is not None:
                raise UsageError("is for tls://HOST:8786", where=option, rule="local:N makes its own certificate")
        with _started_here(distributed, target.local, threads) as client, _watched(client) as roster:
            yield Cluster(client, roster, f"local:{target.local}", remark)
        return
    assert target.address is not None
    security = tls.security()
    # Before there is a connection: whoever listens there can send code as soon as it stands.
    warn_of_exposure(target.address, security, remark)
    try:
        client = distributed.Client(
            target.address, security=security, timeout=CONNECT_SECONDS, set_as_default=False, name="lippmann"
        )
    except (OSError, TimeoutError, TypeError, ValueError, RuntimeError) as error:
        why = " ".join(str(error).split())[:200]
        raise ClusterError(
            f"no scheduler answers at {target.address} ({type(error).__name__}: {why})",
            where="--cluster",
            fix="start one: dask scheduler",
        ) from None
    try:
        with _watched(client) as roster:
            _say_dashboard(client, remark)
            yield Cluster(client, roster, target.address, remark)
    finally:
        client.close(timeout=5)


@contextmanager
def _started_here(distributed: Any, count: int, threads: int | None) -> Iterator[Any]:
    """A client of workers that other accounts of this machine can neither use nor feed with files."""
    import dask

    each = max(1, (threads or machine.usable_cores()) // count)
    security = temporary_security()
    with private_scratch() as folder, spawn_safely():
        # Dask's HTTP servers answer everyone, and cannot be left out: they have no pages.
        pages: dict[str, Any] = {"distributed.scheduler.http.routes": [], "distributed.worker.http.routes": []}
        with dask.config.set({"temporary-directory": folder, **pages}):
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
                # Workers that are started later, in place of others, are set up alike.
                config=copy.deepcopy(dask.config.config),
            )
        with cluster, distributed.Client(cluster, set_as_default=False, name="lippmann") as client:
            # It would take copies of the scene away from workers between two tiles.
            client.amm.stop()
            yield client


@contextmanager
def _watched(client: Any) -> Iterator[Roster]:
    roster = Roster(client)
    try:
        yield roster
    finally:
        roster.close()


def _say_dashboard(client: Any, remark: Callable[[str], None]) -> None:
    if find_spec("bokeh") and client.dashboard_link:
        remark(f"the cluster's dashboard: {client.dashboard_link}")


def _hush() -> None:
    """What goes wrong with workers is told in our own words; Dask's would break into the progress bar."""
    if not sys.flags.dev_mode:
        for name in _LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL)
