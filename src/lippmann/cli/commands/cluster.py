"""``lippmann worker``, and the options of commands that render on a Dask cluster."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.shared import options, parse
from lippmann.cli.shared.console import Console
from lippmann.errors import UsageError

if TYPE_CHECKING:
    from lippmann.tiles.tiled_render import Runner

ClusterName = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        help="Render on a Dask cluster: tls://HOST:8786 (scheduler; tcp:// is open to everyone who can reach it), or "
        "local:N (N workers on this machine). Needs the extra 'cluster'.",
    ),
]
TlsCa = Annotated[Path | None, typer.Option("--tls-ca", help="Certificate of the authority (PEM), for tls://.")]
TlsCert = Annotated[Path | None, typer.Option("--tls-cert", help="Certificate of this machine (PEM).")]
TlsKey = Annotated[Path | None, typer.Option("--tls-key", help="Private key of this machine (PEM).")]


@dataclass(frozen=True)
class ClusterOptions:
    """The values of ``--cluster`` and ``--tls-...``; true if a cluster is to render."""

    name: str | None
    tls_ca: Path | None = None
    tls_cert: Path | None = None
    tls_key: Path | None = None

    def __post_init__(self) -> None:
        for option in ("tls_ca", "tls_cert", "tls_key"):
            if self.name is None and getattr(self, option) is not None:
                name = f"--{option.replace('_', '-')}"
                raise UsageError("applies to a cluster only", where=name, fix="add --cluster tls://HOST:8786")

    def __bool__(self) -> bool:
        return self.name is not None

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
        if self.name is None:
            yield None
            return
        from lippmann.cluster import TlsFiles, connect, parse_target
        from lippmann.cluster.runner import runner_on

        target = parse_target(self.name)
        tls = TlsFiles(self.tls_ca, self.tls_cert, self.tls_key)
        with connect(target, tls, threads=threads, remark=console.remark) as cluster:
            yield runner_on(cluster)


def worker(
    scheduler: Annotated[str, typer.Argument(help="Address of the scheduler: tls://HOST:8786, or tcp://HOST:8786.")],
    threads: options.Threads = None,
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
    tls_ca: TlsCa = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
    quiet: options.Quiet = False,
) -> None:
    """Run a Dask worker for renders on a cluster, until its scheduler ends."""
    from lippmann.cluster.address import TlsFiles
    from lippmann.cluster.worker import WorkerOptions, serve

    worker_options = WorkerOptions(
        scheduler, threads, parse.memory(memory), host, name, TlsFiles(tls_ca, tls_cert, tls_key)
    )
    remark = Console(quiet).remark
    remark(f"working for {scheduler}")
    serve(worker_options, quiet=quiet, remark=remark)
