"""``lippmann calibrate page``: turning a monitor's values until its test pattern stands still."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli import options, serving
from lippmann.cli.console import Console

if TYPE_CHECKING:
    from lippmann.display.monitor import Monitor


def page(
    display: Annotated[str, typer.Argument(help="The display to start from, as for --display.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The display file that the page saves: .toml.")],
    host: serving.Host = "127.0.0.1",
    port: serving.Port = 0,
    no_browser: serving.NoBrowser = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Turn pitch, slope and centre in a browser on the monitor itself, and save them as a display file."""
    from lippmann.atomic import check_writable
    from lippmann.display import load_display
    from lippmann.display.monitor import Monitor
    from lippmann.errors import OutputError
    from lippmann.viewer.calibrate.site import CalibrationSite

    console = Console(quiet, as_json)
    if output.suffix != ".toml":
        raise OutputError(f"the ending is '{output.suffix}'", where=str(output), rule="display files end in .toml")
    check_writable(output)
    monitor = Monitor.of_display(load_display(display))
    site = CalibrationSite(monitor, output, lambda turned: console.remark(_saved(output, turned)))
    serving.serve(site, f"calibrate {monitor.name}", console, host=host, port=port, browser=not no_browser)


def _saved(output: Path, monitor: Monitor) -> str:
    values = f"pitch {monitor.pitch:.6g} lpi, slope {monitor.slope:.6g}, center {monitor.center:.4g}"
    return f"{output}: {values}; use it as --display {output}"
