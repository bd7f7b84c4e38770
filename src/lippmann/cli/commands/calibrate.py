"""``lippmann calibrate``: pitch, slope and centre of a slanted lenticular monitor."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lippmann.cli.commands import view as viewing
from lippmann.cli.shared import options
from lippmann.cli.shared.command_options import HelpfulCommand, HelpfulGroup
from lippmann.cli.shared.console import Console
from lippmann.errors import OutputError, UsageError

if TYPE_CHECKING:
    from lippmann.display.formats.monitor import Monitor

calibrate = typer.Typer(
    cls=HelpfulGroup, help="Calibrate the pitch, slope and centre of a slanted monitor.", rich_markup_mode=None
)


@calibrate.command("pattern", cls=HelpfulCommand)
def pattern(
    name: Annotated[
        str,
        typer.Argument(
            help="stripes: one colour per view; pitch, slope, center: one value per field, of which one is right."
        ),
    ],
    output: options.Output,
    display: options.DisplayName,
    pitch: Annotated[
        str | None,
        typer.Option("--pitch", metavar="LPI", help="Visual pitch in lenses per inch. Default: the display's."),
    ] = None,
    slope: Annotated[
        str | None,
        typer.Option(
            "--slope",
            metavar="NUMBER|infinite",
            help="Slope of the lenses: they lean by -atan(1/slope) from the vertical. Default: the display's.",
        ),
    ] = None,
    center: Annotated[
        str | None, typer.Option("--center", metavar="LENSES", help="Centre in lenses. Default: the display's.")
    ] = None,
    views: Annotated[int | None, typer.Option("--views", help="Number of views, for stripes. Default: 3.")] = None,
    fields: Annotated[
        int | None, typer.Option("--fields", help="Number of fields, for the other patterns. Default: 11.")
    ] = None,
    step: Annotated[
        float | None,
        typer.Option(
            "--step",
            help="Step between fields: pitch in lpi, slope in 1/slope, center in lenses. Default: half a lens or less "
            "over the panel; of center one lens over all fields.",
        ),
    ] = None,
    bits: options.Bits = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Write a native test pattern for a lenticular display."""
    from lippmann.calibration.pattern_files import pattern_picture
    from lippmann.calibration.patterns import Pattern
    from lippmann.calibration.patterns import fields as fields_of
    from lippmann.display import load_display
    from lippmann.display.formats.monitor import Monitor
    from lippmann.image.write import check_output

    console = Console(quiet, as_json)
    check_output(output, bits)
    counts = {key: count for key, count in (("views", views), ("fields", fields)) if count is not None}
    chosen = Pattern(name, step=step, **counts)  # type: ignore[arg-type]  # it is checked there
    others = {"--fields": fields, "--step": step} if name == "stripes" else {"--views": views}
    for flag, value in others.items():
        if value is not None:
            raise UsageError(f"does not apply to {name}", where=flag, fix="leave it out")
    monitor = _with_values(Monitor.of_display(load_display(display)), pitch, slope, center)
    with console.progress() as progress:
        image = pattern_picture(chosen, monitor, progress=progress)
    image.save(output, bits=bits)
    pattern_fields = [] if name == "stripes" else fields_of(chosen, monitor)
    values = [None if math.isinf(field.value) else field.value for field in pattern_fields]
    json_slope = None if math.isinf(monitor.slope) else monitor.slope
    result: dict[str, Any] = {"output": str(output), "size": [monitor.panel.width, monitor.panel.height]}
    result |= {"pitch": monitor.pitch, "slope": json_slope, "center": monitor.center, "pattern": name, "fields": values}
    lines = [f"{output}: {name}, pitch {monitor.pitch:.6g} lpi, slope {monitor.slope:.6g}, center {monitor.center:.4g}"]
    if pattern_fields:
        order = "left to right" if name == "slope" else "top to bottom"
        lines.append(f"fields from {order}: {', '.join(field.text for field in pattern_fields)}")
    console.result(result, "\n".join(lines))


@calibrate.command("page", cls=HelpfulCommand)
def page(
    display: Annotated[str, typer.Argument(help="Display to start from: a name, a TOML file, or as for --display.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Display file to save (.toml).")],
    host: viewing.Host = "127.0.0.1",
    port: viewing.Port = 0,
    no_browser: viewing.NoBrowser = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Adjust pitch, slope and centre in a browser on the monitor, and save a display file."""
    from lippmann.display import load_display
    from lippmann.display.formats.monitor import Monitor
    from lippmann.runtime.atomic_write import check_writable
    from lippmann.viewer.calibrate.site import CalibrationSite

    console = Console(quiet, as_json)
    if output.suffix != ".toml":
        raise OutputError(f"the ending is '{output.suffix}'", where=str(output), rule="display files end in .toml")
    check_writable(output)
    monitor = Monitor.of_display(load_display(display))
    site = CalibrationSite(monitor, output, lambda calibrated: console.remark(_describe(output, calibrated)))
    viewing.serve(site, f"calibrate {monitor.name}", console, host=host, port=port, browser=not no_browser)


def _with_values(monitor: Monitor, pitch: str | None, slope: str | None, center: str | None) -> Monitor:
    """The monitor with the options' values."""
    from lippmann.display.display import INFINITE
    from lippmann.display.validation import plain_number

    changed: dict[str, float] = {}
    for option, text in (("--pitch", pitch), ("--slope", slope), ("--center", center)):
        if text is not None:
            is_upright = option == "--slope" and text == INFINITE
            changed[option[2:]] = math.inf if is_upright else plain_number(text, option)
    return replace(monitor, **changed)  # type: ignore[arg-type]


def _describe(output: Path, monitor: Monitor) -> str:
    values = f"pitch {monitor.pitch:.6g} lpi, slope {monitor.slope:.6g}, center {monitor.center:.4g}"
    return f"{output}: {values}; use it as --display {output}"
