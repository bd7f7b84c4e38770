"""``lippmann worker``, and the options of commands that render on a cluster."""

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
        help="Render the picture's tiles on a Dask cluster: tls://HOST:8786 of its scheduler (tcp:// without "
        "certificates: open to all who reach it), or local:N for N workers here (extra 'cluster').",
    ),
]
TlsCa = Annotated[
    Path | None, typer.Option("--tls-ca", help="Certificate of the authority that all trust (PEM), for tls://.")
]
TlsCert = Annotated[Path | None, typer.Option("--tls-cert", help="This machine's certificate (PEM).")]
TlsKey = Annotated[Path | None, typer.Option("--tls-key", help="Its key (PEM).")]


@dataclass(frozen=True)
class Asked:
    """What ``--cluster`` and the options beside it ask for; true where a cluster is to render."""

    name: str | None
    tls_ca: Path | None = None
    tls_cert: Path | None = None
    tls_key: Path | None = None

    def __post_init__(self) -> None:
        for option in ("tls_ca", "tls_cert", "tls_key"):
            if self.name is None and getattr(self, option) is not None:
                name = f"--{option.replace('_', '-')}"
                raise UsageError("is for clusters", where=name, fix="add --cluster tls://HOST:8786")

    def __bool__(self) -> bool:
        return self.name is not None

    @contextmanager
    def runner(self, console: Console, threads: int | None) -> Iterator[Runner | None]:
        """What renders tiles, for as long as the connection stands; None where this process does.

        Raises
        ------
        UsageError
            The cluster's name is none, or files for encryption are missing.
        ClusterError
            It cannot be reached.
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
    scheduler: Annotated[str, typer.Argument(help="The scheduler's address: tls://HOST:8786, or tcp://.")],
    threads: options.Threads = None,
    memory: Annotated[
        str | None, typer.Option("--memory", help="Beyond this, such as 8G, the worker is started anew.")
    ] = None,
    host: Annotated[
        str | None,
        typer.Option("--host", help="This machine's address for the others; loopback unless given."),
    ] = None,
    name: Annotated[str | None, typer.Option("--name", help="What the dashboard calls this worker.")] = None,
    tls_ca: TlsCa = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
    quiet: options.Quiet = False,
) -> None:
    """Work for a cluster: a Dask worker with the engine warm, until its scheduler ends."""
    from lippmann.cluster.address import TlsFiles
    from lippmann.cluster.worker import WorkerOptions, serve

    wanted = WorkerOptions(scheduler, threads, parse.memory(memory), host, name, TlsFiles(tls_ca, tls_cert, tls_key))
    remark = Console(quiet).remark
    remark(f"working for {scheduler}")
    serve(wanted, quiet=quiet, remark=remark)
