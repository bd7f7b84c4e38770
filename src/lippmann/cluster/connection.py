"""A connection to a cluster, or to one started here, for as long as pictures are rendered on it."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any

from lippmann import machine
from lippmann.cluster.address import LOOPBACK, Target, TlsFiles, import_distributed
from lippmann.cluster.roster import Roster
from lippmann.cluster.work import THREADS_VARIABLE
from lippmann.errors import ClusterError

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
    """Connect to a scheduler, or start workers on this machine that only it can reach.

    Parameters
    ----------
    threads:
        Of workers that are started here, all together; by default all cores.
    remark:
        Called with one line about what happens on the way.

    Raises
    ------
    ClusterError
        Dask is not installed, or the scheduler does not answer.
    UsageError
        Files for encryption are missing.
    """
    distributed = import_distributed()
    _hush()
    security = (tls or TlsFiles()).security()
    if target.local is not None:
        with _started_here(distributed, target.local, threads) as client, _watched(client) as roster:
            _say_dashboard(client, remark)
            yield Cluster(client, roster, f"local:{target.local}", remark)
        return
    assert target.address is not None
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
    each = max(1, (threads or machine.usable_cores()) // count)
    with (
        distributed.LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            host=LOOPBACK,
            # Without an address Dask's HTTP servers would be open to the network.
            dashboard_address=f"{LOOPBACK}:0",
            worker_dashboard_address=f"{LOOPBACK}:0",
            memory_limit=machine.total_memory() // count,
            silence_logs=logging.CRITICAL,
            env={THREADS_VARIABLE: str(each)},
        ) as cluster,
        distributed.Client(cluster, set_as_default=False, name="lippmann") as client,
    ):
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
