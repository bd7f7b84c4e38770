"""``lippmann worker``, and the cluster that commands render on."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.shared import options
from lippmann.cli.shared.command_options import only, with_options, without
from lippmann.cli.shared.console import Console
from lippmann.errors import UsageError
from lippmann.options import texts
from lippmann.options.outputs import ClusterOptions
from lippmann.options.quality import MachineOptions

if TYPE_CHECKING:
    from lippmann.cluster import TlsFiles
    from lippmann.tiles.tiled_render import Runner


class Cluster:
    """The cluster of ``--cluster`` and ``--tls-...``; true if it is to render."""

    def __init__(self, asked: ClusterOptions) -> None:
        self._asked = asked
        if asked.cluster is None:
            for name in ("tls_ca", "tls_cert", "tls_key"):
                if getattr(asked, name) is not None:
                    raise UsageError("applies to a cluster only", parameter=name, fix="add --cluster tls://HOST:8786")

    def __bool__(self) -> bool:
        return self._asked.cluster is not None

    @contextmanager
    def runner(self, console: Console, threads: int | None) -> Iterator[Runner | None]:
        """The runner that renders tiles on the cluster while the connection is open; None without a cluster.

        Raises
        ------
        UsageError
            If the cluster's address is invalid, or a TLS file is missing.
        ClusterError
            If the cluster cannot be reached.
        """
        if self._asked.cluster is None:
            yield None
            return
        from lippmann.cluster import connect, parse_target
        from lippmann.cluster.runner import runner_on

        target = parse_target(self._asked.cluster)
        with connect(target, _tls_files(self._asked), threads=threads, remark=console.remark) as cluster:
            yield runner_on(cluster)


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
