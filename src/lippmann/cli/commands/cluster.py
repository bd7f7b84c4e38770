"""``lippmann worker``, and the cluster that commands render on."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.shared import options
from lippmann.cli.shared.command_options import only, with_options, without
from lippmann.cli.shared.console import Console
from lippmann.options import texts
from lippmann.options.outputs import ClusterOptions
from lippmann.options.quality import MachineOptions

if TYPE_CHECKING:
    from lippmann.cluster import Cluster, TlsFiles
    from lippmann.sequences.windows import WindowRunner
    from lippmann.tiles.tiled_render import Runner


@contextmanager
def runner_of(asked: ClusterOptions, console: Console, threads: int | None) -> Iterator[Runner | None]:
    """The runner that renders tiles on a cluster while the connection is open; None without a cluster.

    Raises
    ------
    UsageError
        If the cluster's address is invalid, or a TLS file is missing.
    ClusterError
        If the cluster cannot be reached.
    """
    with _connected(asked, console, threads) as cluster:
        if cluster is None:
            yield None
        else:
            from lippmann.cluster.runner import runner_on

            yield runner_on(cluster)


@contextmanager
def frame_runner_of(asked: ClusterOptions, console: Console, threads: int | None) -> Iterator[WindowRunner | None]:
    """As :func:`runner_of`, of the frames of a film."""
    with _connected(asked, console, threads) as cluster:
        if cluster is None:
            yield None
        else:
            from lippmann.cluster.runner import frame_runner_on

            yield frame_runner_on(cluster)


@contextmanager
def _connected(asked: ClusterOptions, console: Console, threads: int | None) -> Iterator[Cluster | None]:
    if not asked.cluster:
        yield None
        return
    from lippmann.cluster import connect, parse_target

    target = parse_target(asked.cluster)
    with connect(target, _tls_files(asked), threads=threads, remark=console.remark) as cluster:
        yield cluster


def _tls_files(asked: ClusterOptions) -> TlsFiles:
    from lippmann.cluster.address import TlsFiles

    return TlsFiles(asked.tls_ca, asked.tls_cert, asked.tls_key)


@with_options
def worker(
    scheduler: Annotated[str, typer.Argument(help="Address of the scheduler: tls://HOST:8786, or tcp://HOST:8786.")],
    memory: Annotated[
        str | None,
        typer.Option(
            "--memory",
            help="Memory limit, such as 8G, beyond which the worker restarts.",
        ),
    ] = None,
    host: Annotated[
        str | None,
        typer.Option("--host", help="Address of this machine in the cluster's network. Default: loopback."),
    ] = None,
    name: Annotated[str | None, typer.Option("--name", help="Name of this worker in the dashboard.")] = None,
    quiet: options.Quiet = False,
    *,
    tls: Annotated[ClusterOptions, without("cluster")],
    machine: Annotated[MachineOptions, only("threads")],
) -> None:
    """Run a Dask worker for renders on a cluster, until its scheduler ends."""
    from lippmann.cluster.worker import WorkerOptions, serve

    limit = None if memory is None else texts.memory(memory, "--memory")
    worker_options = WorkerOptions(scheduler, machine.threads, limit, host, name, _tls_files(tls))
    remark = Console(quiet).remark
    remark(f"working for {scheduler}")
    serve(worker_options, quiet=quiet, remark=remark)
