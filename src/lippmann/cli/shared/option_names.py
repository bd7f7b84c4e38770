"""The library's parameters in the words of the command line.

Errors and notes name parameters as Python does: ``parameter="respect_gloss"``, ``method="full"``, ``resume=True``. Here
they become ``--respect-gloss``, ``--method full`` and ``--resume``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from lippmann.errors import LippmannError

if TYPE_CHECKING:
    import typer

#: Parameters whose options have other names than they have.
_OTHERWISE = {
    "layout": "--as",
    "grid": "--views",
}
#: ``name="value"``, ``name=True``, ``name=3.5`` or, for any value, ``name=...``.
_SETTING = re.compile(r"\b([a-z_]+)=(?:\"([^\"]*)\"|(\.\.\.|[\w+-]+(?:\.\w+)*))")


def in_options(error: LippmannError) -> str:
    """The line that says ``error`` on the command line."""
    where = ": ".join(part for part in (error.where, option_of(error.parameter)) if part)
    words = {name: translated(getattr(error, name)) for name in ("what", "rule", "fix")}
    return str(LippmannError(words["what"], where=where, rule=words["rule"], fix=words["fix"]))


def option_of(parameter: str) -> str:
    """The option of a parameter; its own name where it has none."""
    return _options().get(parameter, parameter) if parameter else ""


def translated(text: str) -> str:
    """``text`` with settings of parameters as options."""
    return _SETTING.sub(_as_option, text)


def _as_option(match: re.Match[str]) -> str:
    name, quoted, plain = match.groups()
    option = _options().get(name)
    if option is None:
        return match[0]
    if plain in ("True", "..."):
        return option
    if plain == "False":
        return f"--no-{option[2:]}"
    return f"{option} {plain if quoted is None else quoted}"


def commands_are(make_app: Callable[[], typer.Typer]) -> None:
    """Say which commands there are, once one has to know: their options are the words of what follows."""
    _makers[:] = [make_app]
    _options.cache_clear()


_makers: list[Callable[[], typer.Typer]] = []


@cache
def _options() -> Mapping[str, str]:
    """Options by the names of their parameters, of all commands; arguments by theirs, in capitals."""
    import typer

    names: dict[str, str] = {}
    for command in (each for make in _makers for each in _commands(typer.main.get_command(make()))):
        for parameter in command.params:
            if parameter.name is not None:
                long = [option for option in parameter.opts if option.startswith("--")]
                names.setdefault(parameter.name, long[0] if long else parameter.name.upper())
    return names | _OTHERWISE


def _commands(command: Any) -> Iterator[Any]:
    """A command of click's, whose home moved between releases of typer, and those below it."""
    yield command
    for each in getattr(command, "commands", {}).values():
        yield from _commands(each)
