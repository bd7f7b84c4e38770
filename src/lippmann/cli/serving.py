"""What commands share that serve a page: the address, the browser, Ctrl-C."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli import INTERRUPTED
from lippmann.cli.console import Console

if TYPE_CHECKING:
    from lippmann.viewer.web import Site

Host = Annotated[
    str, typer.Option("--host", help="The address to listen on. By default only this machine can open the page.")
]
Port = Annotated[int, typer.Option("--port", help="The port to listen on; 0 takes a free one.")]
NoBrowser = Annotated[bool, typer.Option("--no-browser", help="Only print the address.")]


def serve(
    site: Site,
    what: str,
    console: Console,
    *,
    host: str,
    port: int,
    browser: bool,
    started: Callable[[], None] = lambda: None,
) -> None:
    """Serve a page until Ctrl-C, which leaves with 130.

    Parameters
    ----------
    site:
        What is served.
    what:
        What the page shows, for people.
    host, port:
        Where, see :class:`~lippmann.viewer.web.WebServer`; raises as that.
    browser:
        Whether to open the page, where there is a screen.
    started:
        Called once the page can be opened.
    """
    import webbrowser  # as socket below: not for --help

    from lippmann.viewer.web import WebServer, is_loopback

    with WebServer(site, host, port) as server:
        # The address comes last: who reads it may send Ctrl-C at once.
        if not is_loopback(host):
            console.remark("everyone who can reach this machine can open the page")
        elif is_remote():
            console.remark(f"from your own machine: {tunnel(server.port)}, then open the address there")
        console.remark("Ctrl-C ends it")
        console.result({"address": server.address}, f"{what}: {server.address}")
        sys.stdout.flush()
        started()
        if browser and has_screen():
            webbrowser.open(server.address)
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            raise SystemExit(INTERRUPTED) from None  # that is how a page ends; no other word is needed


def is_remote() -> bool:
    """Whether the command is typed from another machine."""
    return "SSH_CONNECTION" in os.environ


def has_screen() -> bool:
    """Whether a browser could be seen; one that draws letters into the terminal does not count."""
    if sys.platform in ("win32", "darwin"):
        return not is_remote()
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def tunnel(port: int) -> str:
    """The command that brings a port of this machine to another one."""
    import socket

    return f"ssh -L {port}:127.0.0.1:{port} {os.environ.get('USER', 'you')}@{socket.gethostname()}"
