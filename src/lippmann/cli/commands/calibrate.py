"""``lippmann calibrate``: finding a monitor's pitch, slope and centre."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lippmann.cli.commands import view as viewing
from lippmann.cli.shared import options
from lippmann.cli.shared.console import Console
from lippmann.errors import OutputError, UsageError

if TYPE_CHECKING:
    from lippmann.display.formats.monitor import Monitor

calibrate = typer.Typer(
    help="Find the pitch, slope and centre of a slanted monitor.", no_args_is_help=True, rich_markup_mode=None
)


@calibrate.command("pattern")
def pattern(
    name: Annotated[
        str,
        typer.Argument(
            help="stripes: every view a colour; pitch, slope, center: fields with a value each, of which one is right."
        ),
    ],
    output: options.Output,
    display: options.DisplayName,
    pitch: Annotated[
        str | None, typer.Option("--pitch", help="Lenses per inch as seen, in place of the display's.")
    ] = None,
    slope: Annotated[str | None, typer.Option("--slope", help="Slope in place of the display's, or infinite.")] = None,
    center: Annotated[str | None, typer.Option("--center", help="Centre in place of the display's, in lenses.")] = None,
    views: Annotated[int, typer.Option("--views", help="Views of stripes.")] = 3,
    fields: Annotated[int, typer.Option("--fields", help="Fields of the other patterns.")] = 11,
    step: Annotated[
        float | None,
        typer.Option("--step", help="From field to field: pitch in lpi, slope in 1/slope, center in lenses."),
    ] = None,
    bits: options.Bits = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Draw a native test pattern for a display with cylindrical lenses."""
    from lippmann.calibration.pattern_files import pattern_picture
    from lippmann.calibration.patterns import Pattern
    from lippmann.calibration.patterns import fields as fields_of
    from lippmann.display import load_display
    from lippmann.display.formats.monitor import Monitor
    from lippmann.image.write import format_for
    from lippmann.runtime.atomic_write import check_writable

    console = Console(quiet, as_json)
    format_for(output, bits)
    check_writable(output)
    chosen = Pattern(name, views, fields, step)  # type: ignore[arg-type]  # it is checked there
    if name == "stripes" and step is not None:
        raise UsageError("stripes have no fields", where="--step", fix="leave it out")
    monitor = _turned(Monitor.of_display(load_display(display)), pitch, slope, center)
    with console.progress() as progress:
        image = pattern_picture(chosen, monitor, progress=progress)
    image.save(output, bits=bits)
    drawn = [] if name == "stripes" else fields_of(chosen, monitor)
    values = [None if math.isinf(field.value) else field.value for field in drawn]
    written = None if math.isinf(monitor.slope) else monitor.slope
    result: dict[str, Any] = {"output": str(output), "size": [monitor.panel.width, monitor.panel.height]}
    result |= {"pitch": monitor.pitch, "slope": written, "center": monitor.center, "pattern": name, "fields": values}
    lines = [f"{output}: {name}, pitch {monitor.pitch:.6g} lpi, slope {monitor.slope:.6g}, center {monitor.center:.4g}"]
    if drawn:
        order = "left to right" if name == "slope" else "top to bottom"
        lines.append(f"fields from {order}: {', '.join(field.text for field in drawn)}")
    console.result(result, "\n".join(lines))


@calibrate.command("page")
def page(
    display: Annotated[str, typer.Argument(help="The display to start from, as for --display.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The display file that the page saves: .toml.")],
    host: viewing.Host = "127.0.0.1",
    port: viewing.Port = 0,
    no_browser: viewing.NoBrowser = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Turn pitch, slope and centre in a browser on the monitor itself, and save them as a display file."""
    from lippmann.display import load_display
    from lippmann.display.formats.monitor import Monitor
    from lippmann.runtime.atomic_write import check_writable
    from lippmann.viewer.calibrate.site import CalibrationSite

    console = Console(quiet, as_json)
    if output.suffix != ".toml":
        raise OutputError(f"the ending is '{output.suffix}'", where=str(output), rule="display files end in .toml")
    check_writable(output)
    monitor = Monitor.of_display(load_display(display))
    site = CalibrationSite(monitor, output, lambda turned: console.remark(_saved(output, turned)))
    viewing.serve(site, f"calibrate {monitor.name}", console, host=host, port=port, browser=not no_browser)


def _turned(monitor: Monitor, pitch: str | None, slope: str | None, center: str | None) -> Monitor:
    """The monitor with the values that were typed."""
    from lippmann.display.display import INFINITE
    from lippmann.display.units import plain_number

    changed: dict[str, float] = {}
    for option, text in (("--pitch", pitch), ("--slope", slope), ("--center", center)):
        if text is not None:
            is_upright = option == "--slope" and text == INFINITE
            changed[option[2:]] = math.inf if is_upright else plain_number(text, option)
    return replace(monitor, **changed)  # type: ignore[arg-type]


def _saved(output: Path, monitor: Monitor) -> str:
    values = f"pitch {monitor.pitch:.6g} lpi, slope {monitor.slope:.6g}, center {monitor.center:.4g}"
    return f"{output}: {values}; use it as --display {output}"
