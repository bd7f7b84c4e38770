"""The commands by name. Each lives beside its kin; nothing heavy is loaded before one is called."""

from __future__ import annotations

from typing import Annotated

import typer

from lippmann._version import VERSION
from lippmann.cli import panels, pictures, quality, rendering, system

app = typer.Typer(
    help="Render 3D scenes into the native pixels of integral-imaging displays.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)

app.command("render")(rendering.render)
app.command("preview")(rendering.preview)
app.command("displays")(system.displays)
app.command("doctor")(system.doctor)
app.command("info")(pictures.info)
app.command("views")(pictures.views)
app.command("micro-images")(pictures.micro_images)
app.command("compose")(pictures.compose)
app.command("replay")(pictures.replay)
app.command("refocus")(pictures.refocus)
app.add_typer(panels.quilt, name="quilt")
app.command("weave")(panels.weave)
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
