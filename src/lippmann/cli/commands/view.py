"""``lippmann view``: a picture in a browser, as its display shows it."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.commands.quilt import Aspect, Layout, layout_of
from lippmann.cli.shared import options, parse
from lippmann.cli.shared.command_options import in_options
from lippmann.cli.shared.console import Console
from lippmann.cli.shared.exit_codes import INTERRUPTED
from lippmann.errors import LippmannError, OutputError, UsageError
from lippmann.runtime.atomic_write import scratch_folder

if TYPE_CHECKING:
    from lippmann.display import Display
    from lippmann.quilts.quilt import QuiltLayout
    from lippmann.viewer.manifest import TileFormat
    from lippmann.viewer.request_guard import Application
    from lippmann.viewer.responses import Site
    from lippmann.viewer.served_picture import PictureFile

Other = Annotated[Path | None, typer.Argument(help="Second picture to compare, behind a divider.")]
Export = Annotated[
    Path | None,
    typer.Option("--export", help="Write a single HTML file that needs no server, and exit."),
]
Host = Annotated[str, typer.Option("--host", help="Address to listen on; the default admits this machine only.")]
Port = Annotated[int, typer.Option("--port", help="Port to listen on; 0 takes a free one.")]
NoBrowser = Annotated[bool, typer.Option("--no-browser", help="Do not open a browser.")]


def view(
    picture: options.Picture,
    other: Other = None,
    export: Export = None,
    layout: Layout = None,
    aspect: Aspect = None,
    display: options.PictureDisplay = None,
    host: Host = "127.0.0.1",
    port: Port = 0,
    no_browser: NoBrowser = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """View a picture in a browser as its display shows it."""

    console = Console(quiet, as_json)
    paths = [picture] if other is None else [picture, other]
    if export is not None:
        for name, is_given in (("--host", host != "127.0.0.1"), ("--port", port != 0), ("--no-browser", no_browser)):
            if is_given:
                raise UsageError("does not apply to --export", where=name, fix="leave it out")
    with scratch_folder("lippmann-view-") as folder:
        asked, target = layout_of(layout, aspect), parse.display(display)
        pictures = [_panel_picture(path, target, asked, Path(folder) / str(k)) for k, path in enumerate(paths)]
        if export is not None:
            _export(pictures, target, export, paths, console)
            return
        _serve_pictures(pictures, target, paths, console, host=host, port=port, browser=not no_browser)


def _panel_picture(path: Path, display: Display | None, layout: QuiltLayout | None, folder: Path) -> Path:
    """The picture itself; a quilt is woven for its display, into ``folder``."""
    from lippmann.quilts.files import is_quilt, read_quilt

    if layout is None and not is_quilt(path):
        return path
    from lippmann.quilts.weave import weave
    from lippmann.viewing.quilt_views import quilt_display

    folder.mkdir()
    woven = folder / f"{path.stem}.png"
    quilt = read_quilt(path, layout)
    weave(quilt, quilt_display(quilt, display, str(path))).save(woven)
    return woven


def _serve_pictures(
    pictures: list[Path],
    target: Display | None,
    paths: list[Path],
    console: Console,
    *,
    host: str,
    port: int,
    browser: bool,
) -> None:
    from lippmann.viewer.served_picture import PictureFile
    from lippmann.viewer.server import ViewerSite

    # Uncompressed tiles are fastest on one machine, PNG through a tunnel.
    tile_format: TileFormat = "png" if is_remote() else "rgb"
    files = [PictureFile(path, target, tile_format) for path in pictures]
    serve(
        ViewerSite(files),
        " and ".join(str(path) for path in paths),
        console,
        host=host,
        port=port,
        browser=browser,
        started=lambda: _read_ahead(files, console),
    )


def _read_ahead(files: list[PictureFile], console: Console) -> None:
    """Start reading the pictures while the browser starts; errors are printed, and shown on the page."""

    def read() -> None:
        for file in files:
            try:
                file.current()
            except LippmannError as error:
                console.remark(f"lippmann: {in_options(error)}")

    threading.Thread(target=read, daemon=True).start()


def _export(paths: list[Path], display: Display | None, output: Path, sources: list[Path], console: Console) -> None:
    from lippmann.image import open_file
    from lippmann.image.streamed import picture_of_file
    from lippmann.runtime.atomic_write import check_writable
    from lippmann.viewer.export import check_exportable, export_page

    if output.suffix.lower() not in (".html", ".htm"):
        raise OutputError(f"the ending is '{output.suffix}'", where=str(output), rule="a page ends in .html")
    files = [open_file(path) for path in paths]
    for file in files:
        check_exportable(file.metadata_for(display).display)
    check_writable(output)
    export_page([(file.path.name, picture_of_file(file, display, keeps_codes=True)) for file in files], output)
    size = output.stat().st_size
    names = " and ".join(str(path) for path in sources)
    console.result({"output": str(output), "bytes": size}, f"{output}: {names}, {size / 1e6:.1f} MB")


def serve(
    content: Site | Application,
    what: str,
    console: Console,
    *,
    host: str,
    port: int,
    browser: bool,
    folder: str = "",
    started: Callable[[], None] = lambda: None,
) -> None:
    """Serve a page until Ctrl-C, SIGTERM or SIGHUP, then exit with the code 130.

    Parameters
    ----------
    content:
        The pages to serve: a site, or an ASGI application.
    what:
        Title of the page in the printed line.
    console:
        Receives the address and remarks.
    host, port:
        Address and port to listen on; port 0 takes a free one.
    browser:
        Whether to open the page in a browser, if there is a screen.
    folder:
        Secret folder that the pages lie in; the printed address tells it.
    started:
        Called once the page can be opened.

    Raises
    ------
    UsageError
        If the address or the port cannot be used.
    """
    import webbrowser  # as socket below: not for --help

    from lippmann.runtime.machine import is_loopback
    from lippmann.viewer.http_server import WebServer

    with WebServer(content, host, port, folder=folder) as server:
        # The address is printed last: its reader may send Ctrl-C at once.
        if not is_loopback(host):
            console.remark("everyone who can reach this machine can open the page")
        elif is_remote():
            console.remark(f"from your own machine: {tunnel(server.port)}, then open the address there")
        console.remark("Ctrl-C ends it")
        console.result({"address": server.address}, f"{what}: {server.address}")
        sys.stdout.flush()
        started()
        if browser and has_screen():
            # Not in this thread: some browsers are waited for, and what is started there can swallow Ctrl-C.
            threading.Thread(target=webbrowser.open, args=(server.address,), daemon=True).start()
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            raise SystemExit(INTERRUPTED) from None  # the regular end of a page: no message


def open_file(path: Path) -> None:
    """Show a film in the program that the desktop opens such files with."""
    import webbrowser

    if has_screen():
        webbrowser.open(path.resolve().as_uri())


def is_remote() -> bool:
    """Whether the command runs in an SSH session."""
    return "SSH_CONNECTION" in os.environ


def has_screen() -> bool:
    """Whether there is a screen for a graphical browser."""
    if sys.platform in ("win32", "darwin"):
        return not is_remote()
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def tunnel(port: int) -> str:
    """The SSH command that forwards a port of this machine to another one."""
    import socket

    return f"ssh -L {port}:127.0.0.1:{port} {os.environ.get('USER', 'you')}@{socket.gethostname()}"
