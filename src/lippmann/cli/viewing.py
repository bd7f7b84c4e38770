"""``lippmann view``: a picture as its display would show it, in a browser."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli import options, serving
from lippmann.cli.console import Console
from lippmann.errors import LippmannError, UsageError

if TYPE_CHECKING:
    from lippmann.display import Display
    from lippmann.viewer.manifest import TileFormat
    from lippmann.viewer.shown import PictureFile

Other = Annotated[Path | None, typer.Argument(help="A second picture, beside the first behind a divider.")]
Export = Annotated[
    Path | None, typer.Option("--export", help="Write one HTML file that needs no server instead, and leave.")
]


def view(
    picture: options.Picture,
    other: Other = None,
    export: Export = None,
    display: options.PictureDisplay = None,
    host: serving.Host = "127.0.0.1",
    port: serving.Port = 0,
    no_browser: serving.NoBrowser = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Show a picture in a browser as its display would show it."""
    from lippmann.display import load_display

    console = Console(quiet, as_json)
    paths = [picture] if other is None else [picture, other]
    shown_on = None if display is None else load_display(display)
    if export is not None:
        for name, given in (("--host", host != "127.0.0.1"), ("--port", port != 0), ("--no-browser", no_browser)):
            if given:
                raise UsageError("has no meaning for a file", where=name, fix="leave --export or this out")
        _export(paths, shown_on, export, console)
        return
    from lippmann.viewer.server import ViewerSite
    from lippmann.viewer.shown import PictureFile

    # Bare bytes are quickest on one machine, packed ones through a tunnel.
    tile_format: TileFormat = "png" if serving.is_remote() else "rgb"
    files = [PictureFile(path, shown_on, tile_format) for path in paths]
    serving.serve(
        ViewerSite(files),
        " and ".join(str(path) for path in paths),
        console,
        host=host,
        port=port,
        browser=not no_browser,
        started=lambda: _read_ahead(files, console),
    )


def _read_ahead(files: list[PictureFile], console: Console) -> None:
    """Begin to read the pictures while the browser starts; what is wrong with one is said here and on the page."""

    def read() -> None:
        for file in files:
            try:
                file.current()
            except LippmannError as error:
                console.remark(f"lippmann: {error}")

    threading.Thread(target=read, daemon=True).start()


def _export(paths: list[Path], display: Display | None, output: Path, console: Console) -> None:
    from lippmann.atomic import check_writable
    from lippmann.image import read_metadata
    from lippmann.viewer.export import check_exportable, export_page
    from lippmann.viewer.shown import open_shown

    for path in paths:
        check_exportable(read_metadata(path, display=display).display)
    check_writable(output)
    export_page([(path.name, open_shown(path, display)) for path in paths], output)
    size = output.stat().st_size
    names = " and ".join(str(path) for path in paths)
    console.result({"output": str(output), "bytes": size}, f"{output}: {names}, {size / 1e6:.1f} MB")
