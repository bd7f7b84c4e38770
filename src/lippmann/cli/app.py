"""The commands by name. Each lives beside its kin; nothing heavy is loaded before one is called."""

from __future__ import annotations

from typing import Annotated

import typer

from lippmann._version import VERSION
from lippmann.cli.commands import (
    calibrate,
    cluster,
    compare,
    exchange,
    interlace,
    picture,
    plan,
    preview,
    quilt,
    render,
    system,
    view,
)
from lippmann.cli.commands import print as printing
from lippmann.cli.shared.option_names import commands_are

app = typer.Typer(
    help="Render 3D scenes into the native pixels of integral-imaging displays.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)

app.command("render")(render.render)
app.command("preview")(preview.preview)
app.command("plan")(plan.plan)
app.command("worker")(cluster.worker)
app.command("displays")(system.displays)
app.command("doctor")(system.doctor)
app.command("info")(picture.info)
app.command("views")(picture.views)
app.command("micro-images")(picture.micro_images)
app.command("compose")(picture.compose)
app.command("replay")(picture.replay)
app.command("refocus")(picture.refocus)
app.command("export")(exchange.export)
app.command("import")(exchange.import_)
app.command("view")(view.view)
app.add_typer(quilt.quilt, name="quilt")
app.command("weave")(quilt.weave)
app.command("interlace")(interlace.interlace)
app.add_typer(calibrate.calibrate, name="calibrate")
app.command("pitch-test")(printing.pitch_test)
app.command("marks")(printing.marks)
app.command("compare")(compare.compare)
app.command("reproduce")(compare.reproduce)


@app.callback(invoke_without_command=True)
def top(
    version: Annotated[bool, typer.Option("--version", help="Print the version and leave.")] = False,
) -> None:
    """Render 3D scenes into the native pixels of integral-imaging displays."""
    if version:
        print(f"lippmann {VERSION}")
        raise typer.Exit


commands_are(app)
