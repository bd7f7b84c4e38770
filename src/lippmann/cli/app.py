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
    studio,
    system,
    view,
)
from lippmann.cli.commands import print as printing
from lippmann.cli.shared.grouped_help import HelpfulCommand, HelpfulGroup
from lippmann.cli.shared.option_names import commands_are

app = typer.Typer(
    cls=HelpfulGroup,
    help="Render 3D scenes into the native pixels of integral-imaging displays.",
    add_completion=True,
    rich_markup_mode=None,
)

app.command("render", cls=HelpfulCommand)(render.render)
app.command("preview", cls=HelpfulCommand)(preview.preview)
app.command("plan", cls=HelpfulCommand)(plan.plan)
app.command("worker", cls=HelpfulCommand)(cluster.worker)
app.command("displays", cls=HelpfulCommand)(system.displays)
app.command("doctor", cls=HelpfulCommand)(system.doctor)
app.command("info", cls=HelpfulCommand)(picture.info)
app.command("views", cls=HelpfulCommand)(picture.views)
app.command("micro-images", cls=HelpfulCommand)(picture.micro_images)
app.command("compose", cls=HelpfulCommand)(picture.compose)
app.command("replay", cls=HelpfulCommand)(picture.replay)
app.command("refocus", cls=HelpfulCommand)(picture.refocus)
app.command("export", cls=HelpfulCommand)(exchange.export)
app.command("import", cls=HelpfulCommand)(exchange.import_)
app.command("studio", cls=HelpfulCommand)(studio.studio)
app.command("show", cls=HelpfulCommand)(studio.show)
app.command("view", cls=HelpfulCommand)(view.view)
app.add_typer(quilt.quilt, name="quilt")
app.command("weave", cls=HelpfulCommand)(quilt.weave)
app.command("interlace", cls=HelpfulCommand)(interlace.interlace)
app.add_typer(calibrate.calibrate, name="calibrate")
app.command("pitch-test", cls=HelpfulCommand)(printing.pitch_test)
app.command("marks", cls=HelpfulCommand)(printing.marks)
app.command("compare", cls=HelpfulCommand)(compare.compare)
app.command("reproduce", cls=HelpfulCommand)(compare.reproduce)


@app.callback(invoke_without_command=True)
def top(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and leave.")] = False,
) -> None:
    """Render 3D scenes into the native pixels of integral-imaging displays."""
    if version:
        print(f"lippmann {VERSION}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        print(context.get_help())
        raise typer.Exit


commands_are(app)
