"""The commands by name. Each lives beside its kin; the module of one is loaded when it is called, or helped with."""

from __future__ import annotations

import importlib
import os
from collections.abc import Mapping, Sequence
from functools import cache, partial
from typing import Annotated

import typer

from lippmann._version import VERSION
from lippmann.cli.shared.command_options import commands_are
from lippmann.cli.shared.grouped_help import HelpfulCommand, HelpfulGroup

#: Set where a shell asks for what a line may go on with.
_COMPLETION = "_LIPPMANN_COMPLETE"

#: Commands by what one does with them: module and name of each command or group of commands, and the first line of
#: its help.
GROUPS: Mapping[str, Mapping[str, tuple[str, str, str]]] = {
    "Render": {
        "render": ("render", "render", "Render a scene into the native pixels of a display."),
        "preview": (
            "preview",
            "preview",
            "Show in a second or two what a display will show to an eye in front of its middle.",
        ),
        "plan": (
            "plan",
            "plan",
            "Say what 'render' will show and take, without rendering: depth, blur, rays, memory and time.",
        ),
        "proof": (
            "proof",
            "proof",
            "Prove a display: directions, crosstalk, depth, field, viewing zone and moire of its lenses and pixels.",
        ),
        "quilt": ("quilt", "quilt", "Quilts: all views side by side in one picture."),
    },
    "Look": {
        "studio": (
            "studio",
            "studio",
            "Set up a display by hand in a browser, see live what it will show, and render.",
        ),
        "view": ("view", "view", "View a picture in a browser as its display shows it."),
        "show": (
            "studio",
            "show",
            "Show a picture on the display itself: a window to put full screen there, native pixels one to one.",
        ),
        "replay": ("picture", "replay", "Simulate what an eye in front of the display sees."),
        "refocus": (
            "picture",
            "refocus",
            "Refocus on a plane, or on several, as a camera whose aperture is as wide as the field of view.",
        ),
        "info": ("picture", "info", "Show a picture's display, size and provenance."),
        "compare": (
            "compare",
            "compare",
            "Compare a picture with a reference: PSNR, worst micro-images, SSIM of views, the paper's metrics.",
        ),
    },
    "From and to other pictures": {
        "interlace": ("interlace", "interlace", "Interlace photographs or frames for a lenticular print or display."),
        "weave": ("quilt", "weave", "Make a display's native picture from a quilt or a folder of views."),
        "views": ("picture", "views", "Split a picture into views: one picture per direction, one pixel per lens."),
        "micro-images": ("picture", "micro_images", "Split a picture into micro-images: one picture per lens."),
        "compose": ("picture", "compose", "Join views or micro-images into the native picture."),
        "export": ("exchange", "export", "Export a picture to the layout of another light-field tool."),
        "import": ("exchange", "import_", "Import a light field of another tool as a picture for a display."),
    },
    "Displays and prints": {
        "displays": ("system", "displays", "List the bundled displays."),
        "calibrate": ("calibrate", "calibrate", "Calibrate the pitch, slope and centre of a slanted monitor."),
        "pitch-test": (
            "print",
            "pitch_test",
            "Write a pitch test: strips at slightly different print pitches, to find the sheet's.",
        ),
        "marks": (
            "print",
            "marks",
            "Add a margin with alignment marks to a picture for print, and write its job sheet.",
        ),
    },
    "Program": {
        "doctor": (
            "system",
            "doctor",
            "Check the rendering engine of this machine, say how to fix what is missing, and list plugins.",
        ),
        "worker": ("cluster", "worker", "Run a Dask worker for renders on a cluster, until its scheduler ends."),
        "reproduce": ("compare", "reproduce", "Reproduce the paper's tables and figures and write a report."),
    },
}
#: All of them.
COMMANDS = {name: entry for entries in GROUPS.values() for name, entry in entries.items()}
#: Heading of each command.
_GROUP_OF = {name: title for title, entries in GROUPS.items() for name in entries}


def app_of(words: Sequence[str]) -> typer.Typer:
    """The command line as far as these words need it: modules of other commands take time to load."""
    if _COMPLETION in os.environ:
        return make_app()
    first = words[0] if words else "--help"
    if first in ("--help", "--version"):
        return _outline()
    if first not in COMMANDS:
        return make_app()
    commands_are(partial(make_app, first), make_app)
    return make_app(first)


@cache
def make_app(command: str = "") -> typer.Typer:
    """The command line with all commands, or with this one alone."""
    app = _empty()
    for name in (command,) if command else COMMANDS:
        module, attribute, _ = COMMANDS[name]
        function = getattr(importlib.import_module(f"lippmann.cli.commands.{module}"), attribute)
        if isinstance(function, typer.Typer):
            app.add_typer(function, name=name, rich_help_panel=_GROUP_OF[name])
        else:
            app.command(name, cls=HelpfulCommand, rich_help_panel=_GROUP_OF[name])(function)
    return app


@cache
def _outline() -> typer.Typer:
    """The command line for its own help: commands have their names and the first line of theirs."""
    app = _empty()
    for name, (_, _, line) in COMMANDS.items():
        app.command(name, cls=HelpfulCommand, help=line, rich_help_panel=_GROUP_OF[name])(lambda: None)
    return app


def _empty() -> typer.Typer:
    app = typer.Typer(
        cls=HelpfulGroup,
        help="Render 3D scenes into the native pixels of integral-imaging displays.",
        add_completion=True,
        rich_markup_mode=None,
    )
    app.callback(invoke_without_command=True)(_top)
    return app


def _top(
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


commands_are(make_app)
