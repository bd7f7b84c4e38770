"""The commands by name, and the end of one: its exit code, and one line for an error.

Each lives beside its kin; the module of one is loaded when it is called, or helped with. Exit code 0 is success, 1 a
failure of the program or the machine, 2 bad input, 130 Ctrl-C.
"""

from __future__ import annotations

import errno
import importlib
import os
import re
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache, partial
from typing import Annotated, Any

import typer
from typer import BadParameter

from lippmann._version import VERSION
from lippmann.cli.shared import standard_streams
from lippmann.cli.shared.command_options import (
    HelpfulCommand,
    HelpfulGroup,
    commands_are,
    in_options,
    translate,
)
from lippmann.cli.shared.exit_codes import INTERRUPTED
from lippmann.errors import LippmannError, UsageError
from lippmann.printable import one_line
from lippmann.runtime import atomic_write
from lippmann.runtime.atomic_write import reason_and_fix

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
            "Show in a few seconds what a display will show to an eye in front of its middle.",
        ),
        "plan": (
            "plan",
            "plan",
            "Say what 'render' will show and take, without rendering: depth, blur, rays, memory and time.",
        ),
        "proof": (
            "proof",
            "proof",
            "Say what a display's lenses can show: directions, crosstalk, depth, field, viewing zone and moire.",
        ),
        "quilt": ("quilt", "quilt", "Render, pack and unpack quilts: all views side by side in one picture."),
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
        "replay": ("replay", "replay", "Simulate what an eye in front of the display sees."),
        "refocus": (
            "replay",
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
    if first in ("--help", "-h", "--version", "help"):
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
        context_settings={"help_option_names": ["--help", "-h"]},
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


#: The base of all complaints about the command line itself; its home moved between releases of typer.
_ComplaintError = BadParameter.__mro__[2]


def run(words: list[str], *, debug: bool = False) -> int:
    """Run one command; errors become one line on standard error unless ``debug`` asks for the traceback."""
    standard_streams.begin_command()
    atomic_write.remark("")
    if words[:1] == ["help"]:  # as of git, gh and uv
        words = [*words[1:], "--help"]
    try:
        code = app_of(words)(words, prog_name="lippmann", standalone_mode=False)
        sys.stdout.flush()
    except SystemExit:
        raise
    except BaseException as error:
        if _is_interrupt(error):
            return stopped()
        if debug or not isinstance(error, Exception):
            raise
        return _report_error(error, words)
    # Typer makes an exit code of most Ctrl-C.
    if code == INTERRUPTED:
        return stopped()
    return code if isinstance(code, int) else 0


def _report_error(error: Exception, words: list[str]) -> int:
    """The exit code of an error, which is told in one line."""
    if isinstance(error, LippmannError):
        line = in_options(error, words)
        left = "" if "--resume" in line else _left()
        return _leave(f"{line}; {left}" if left else line, error.exit_code)
    if isinstance(error, _ComplaintError):
        return _leave(_usage(error), 2)
    if _is_out_of_memory(error):
        return _leave("out of memory; lower --memory, close other programs, or raise the limit (ulimit -v)", 1)
    if isinstance(error, OSError):
        if error.errno == errno.ENAMETOOLONG:
            return _leave(f"{str(error.filename)[:60]}...: no file can have a name that long", 2)
        if error.errno == errno.EPIPE:  # who read standard output has read enough
            return 1
        reason, fix = reason_and_fix(error)
        return _leave("; ".join(part for part in (f"{error.filename or 'the system'}: {reason}", fix) if part), 1)
    what = " ".join(f"{type(error).__name__}: {error}".split())
    return _leave(f"internal error: {what}; run again with --debug and report it", 1)


#: Messages of libraries where no memory is left, beside MemoryError.
_NO_MEMORY = re.compile(
    r"bad_alloc|can't start new thread|cannot allocate memory|failed to map segment|out of memory", re.IGNORECASE
)


def _is_out_of_memory(error: BaseException | None) -> bool:
    while error is not None:
        if isinstance(error, MemoryError) or _NO_MEMORY.search(str(error)):
            return True
        error = error.__cause__ or error.__context__
    return False


def stopped() -> int:
    """The exit code of Ctrl-C, which is told in one line, with what is left on disk on purpose."""
    return _leave(f"stopped; {_left() or 'nothing was written'}", INTERRUPTED)


def _left() -> str:
    text = atomic_write.last_remark()
    return translate(text) if text else ""


def _is_interrupt(error: BaseException | None) -> bool:
    """Whether Ctrl-C is behind an error: typer passes it on as Abort, and Dr.Jit wraps what happens in its loops."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt) or type(error).__name__ == "Abort":
            return True
        error = error.__cause__ or error.__context__
    return False


#: How typer refuses a word that is not among those listed.
_NOT_LISTED = re.compile(r"Invalid value for '(--[\w-]+)'.*: (?:Value error, )?('.*?') is not one of (.*)\.")


#: How typer refuses what is no number.
_NO_NUMBER = re.compile(r"Invalid value for '(--[\w-]+)'.*: ('.*') is not a valid (int|float)\.")
#: How typer refuses a group of commands without one of them, and a word that is like none.
_NO_COMMAND = re.compile(r"Missing command\.|No such command '[^']*'\.")
#: How it refuses one argument too many, here a file to write.
_EXTRA = re.compile(r"Got unexpected extra argument(?:\(s\))? \((\S+\.\w+)\)")
_NO_SUCH = re.compile(r"No such option: (--[\w-]+)")
#: Options by the names that other programs, or other commands, give them.
_OTHER_NAMES = {
    "--dpi": "it is called --ppi here, pixels per inch",
    "--samples": "it is called --spp here, samples per pixel",
    "--out": "it is called --output or -o here",
    "--lpi": "this command takes a print in one word: print:lpi=60,ppi=720,size=200x300mm",
}


def _usage(error: BaseException) -> str:
    message = " ".join(getattr(error, "format_message", error.__str__)().split())
    former = _NO_SUCH.search(message)
    if former is not None and former[1] in _OTHER_NAMES:
        return f"{former[1]}: {_OTHER_NAMES[former[1]]}"
    number = _NO_NUMBER.fullmatch(message)
    if number is not None:
        rule = "must be a whole number" if number[3] == "int" else "must be a number"
        fix = "for a map of depths --depth-map" if number[1] == "--depth" else ""
        return str(UsageError(number[2], where=number[1], rule=rule, fix=fix))
    listed = _NOT_LISTED.fullmatch(message)
    if listed is not None:
        option, word, known = listed[1], listed[2].strip("'"), listed[3].replace("'", "").split(", ")
        return str(UsageError.unknown("value", word, known, where=option))
    extra = _EXTRA.fullmatch(message)
    context: Any = getattr(error, "ctx", None)
    command = getattr(context, "command_path", "lippmann")
    if extra is not None and any(each.name == "output" for each in context.command.params):
        message = f"Got unexpected extra argument {extra[1]}; outputs are named by -o: -o {extra[1]}."
    if " " in command and _NO_COMMAND.fullmatch(message):
        message += f" Known are {', '.join(context.command.commands)}."
    return f"{message.rstrip('.')}; see '{command} --help'"


def _leave(line: str, code: int) -> int:
    with suppress(OSError):  # the terminal may be closed
        print(f"lippmann: {one_line(line)}", file=sys.stderr)
    return code
