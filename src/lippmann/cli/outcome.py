"""The end of a command: its exit code, and one line for an error.

0 is success, 1 a failure of the program or the machine, 2 bad input, 130 Ctrl-C.
"""

from __future__ import annotations

import errno
import re
import sys
from contextlib import suppress
from typing import Any

from typer import BadParameter

from lippmann.cli.shared import standard_streams
from lippmann.cli.shared.exit_codes import INTERRUPTED
from lippmann.errors import LippmannError, UsageError
from lippmann.printable import one_line
from lippmann.runtime import atomic_write
from lippmann.runtime.atomic_write import reason_and_fix

#: The base of all complaints about the command line itself; its home moved between releases of typer.
_ComplaintError = BadParameter.__mro__[2]


def run(words: list[str], *, debug: bool = False) -> int:
    """Run one command; errors become one line on standard error unless ``debug`` asks for the traceback."""
    standard_streams.begin_command()
    atomic_write.remark("")
    from lippmann.cli.app import app_of

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
        return _report_error(error)
    # Typer makes an exit code of most Ctrl-C.
    if code == INTERRUPTED:
        return stopped()
    return code if isinstance(code, int) else 0


def _report_error(error: Exception) -> int:
    """The exit code of an error, which is told in one line."""
    from lippmann.cli.shared.command_options import in_options

    if isinstance(error, LippmannError):
        line = in_options(error)
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
    if not text:
        return ""
    from lippmann.cli.shared.command_options import translated

    return translated(text)


def _is_interrupt(error: BaseException | None) -> bool:
    """Whether Ctrl-C is behind an error: typer passes it on as Abort, and Dr.Jit wraps what happens in its loops."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt) or type(error).__name__ == "Abort":
            return True
        error = error.__cause__ or error.__context__
    return False


#: How typer refuses a word that is not among those listed.
_NOT_LISTED = re.compile(r"Invalid value for '(--[\w-]+)'.*: (?:Value error, )?('.*?') is not one of (.*)\.")


#: How typer refuses a group of commands without one of them, and a word that is like none.
_NO_COMMAND = re.compile(r"Missing command\.|No such command '[^']*'\.")
_NO_SUCH = re.compile(r"No such option: (--[\w-]+)")
#: Options by the names that other programs give them.
_OTHER_NAMES = {
    "--dpi": "it is called --ppi here, pixels per inch",
    "--samples": "it is called --spp here, samples per pixel",
    "--out": "it is called --output or -o here",
}


def _usage(error: BaseException) -> str:
    message = " ".join(getattr(error, "format_message", error.__str__)().split())
    former = _NO_SUCH.search(message)
    if former is not None and former[1] in _OTHER_NAMES:
        return f"{former[1]}: {_OTHER_NAMES[former[1]]}"
    listed = _NOT_LISTED.fullmatch(message)
    if listed is not None:
        option, word, known = listed[1], listed[2].strip("'"), listed[3].replace("'", "").split(", ")
        return str(UsageError.unknown("value", word, known, where=option))
    context: Any = getattr(error, "ctx", None)
    command = getattr(context, "command_path", "lippmann")
    if " " in command and _NO_COMMAND.fullmatch(message):
        message += f" Known are {', '.join(context.command.commands)}."
    return f"{message} See '{command} --help'."


def _leave(line: str, code: int) -> int:
    with suppress(OSError):  # the terminal may be closed
        print(f"lippmann: {one_line(line)}", file=sys.stderr)
    return code
