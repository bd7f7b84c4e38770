"""``lippmann calibrate``: finding a monitor's pitch, slope and centre."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lippmann.cli import options
from lippmann.cli.console import Console
from lippmann.errors import UsageError

if TYPE_CHECKING:
    from lippmann.display.monitor import Monitor

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
    from lippmann.atomic import check_writable
    from lippmann.calibration.patterns import Pattern
    from lippmann.calibration.patterns import fields as fields_of
    from lippmann.calibration.pictures import pattern_picture
    from lippmann.display import load_display
    from lippmann.display.monitor import Monitor
    from lippmann.image.formats import format_for

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
