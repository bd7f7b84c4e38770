"""The commands by name. Each lives beside its kin; nothing heavy is loaded before one is called."""

from __future__ import annotations

from typing import Annotated

import typer

from lippmann._version import VERSION
from lippmann.cli import (
    calibrate_page,
    calibration,
    clusters,
    exchange,
    panels,
    pictures,
    planning,
    printing,
    quality,
    rendering,
    system,
    viewing,
)

app = typer.Typer(
    help="Render 3D scenes into the native pixels of integral-imaging displays.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)

app.command("render")(rendering.render)
app.command("preview")(rendering.preview)
app.command("plan")(planning.plan)
app.command("worker")(clusters.worker)
app.command("displays")(system.displays)
app.command("doctor")(system.doctor)
app.command("info")(pictures.info)
app.command("views")(pictures.views)
app.command("micro-images")(pictures.micro_images)
app.command("compose")(pictures.compose)
app.command("replay")(pictures.replay)
app.command("refocus")(pictures.refocus)
app.command("export")(exchange.export)
app.command("import")(exchange.import_)
app.command("view")(viewing.view)
app.add_typer(panels.quilt, name="quilt")
app.command("weave")(panels.weave)
calibration.calibrate.command("page")(calibrate_page.page)
app.add_typer(calibration.calibrate, name="calibrate")
app.command("pitch-test")(printing.pitch_test)
app.command("marks")(printing.marks)
app.command("compare")(quality.compare)
app.command("reproduce")(quality.reproduce)


@app.callback(invoke_without_command=True)
def top(
    version: Annotated[bool, typer.Option("--version", help="Print the version and leave.")] = False,
) -> None:
    """Render 3D scenes into the native pixels of integral-imaging displays."""
    if version:
        print(f"lippmann {VERSION}")
        raise typer.Exit
