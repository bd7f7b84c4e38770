"""Studio states as TOML files: a line for each setting, by the names of the options of ``lippmann render``.

Names have ``_`` for ``-``, and several numbers are a list::

    scene = "models/dragon.glb"     # beside this file, or absolute, or a bundled scene's name
    display = "looking-glass-portrait"
    turn = [30.0, 10.0, 0.0]
    light_turn = [20.0, 0.0]
    exposure = 0.5

What a file does not say is as in a new studio. Files that a state names are found beside it. ``tomli-w`` would write a
setting over several lines, see :mod:`lippmann.options.texts`.
"""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from lippmann.errors import UsageError
from lippmann.options.option import changed_options, options_of
from lippmann.options.texts import from_plain, lines_of
from lippmann.runtime.regular_file import read_small_text
from lippmann.studio_app.state import FILES, StudioState

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

_MOST_BYTES = 1_000_000  # a picture given by mistake is not read to its end
_KIND = "a state is a TOML file that the studio wrote"

#: Settings that every file says, before the others.
_FIRST = ("scene", "display")


def read_state(path: Path) -> StudioState:
    """The state of a file.

    Raises
    ------
    UsageError
        The file cannot be read, is no TOML, or holds a setting that is unknown or out of its range; with file and line.
    """
    text = read_small_text(path, _MOST_BYTES, UsageError, _KIND)
    return state_of_text(text, where=str(path), folder=path.parent)


def state_of_text(text: str, *, where: str = "state", folder: Path | None = None) -> StudioState:
    """The state that a text describes; ``folder`` is where the files that it names are found.

    Raises
    ------
    UsageError
        As :func:`read_state`; ``where`` stands for the file.
    """
    try:
        values = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also numbers of absurd length, lists in lists in lists
        raise _syntax_error(str(error), where) from None
    kinds = {each.name: each.type for each, _ in options_of(StudioState)}
    settings: dict[str, Any] = {}
    for name, value in values.items():
        place = f"{where}:{_line_of(text, name)}"
        if name not in kinds:
            rule = "settings are the options of lippmann render with _ for -"
            raise UsageError.unknown("setting", name, kinds, where=place, rule=rule, fix="leave it out")
        try:
            settings[name] = from_plain(kinds[name], value)
            # Alone, so that the line of what is wrong is known; what goes together is checked below.
            StudioState(**{name: settings[name]}) if name != "pop_out" else None
        except UsageError as error:
            what = error.what if error.what else repr(value)
            raise UsageError(what, where=place, parameter=name, rule=error.rule, fix=error.fix) from None
        if folder is not None and name in FILES:
            settings[name] = _resolve_file(settings[name], folder)
    try:
        return StudioState(**settings)
    except UsageError as error:
        line = _line_of(text, error.parameter if error.parameter in values else next(iter(values)))
        place = f"{where}:{line}"
        raise UsageError(error.what, where=place, parameter=error.parameter, rule=error.rule, fix=error.fix) from None


def text_of_state(state: StudioState) -> str:
    """A state as TOML: scene, display, and what differs from a new studio."""
    values = {name: getattr(state, name) for name in _FIRST} | changed_options(state)
    return "\n".join(lines_of(values)) + "\n"


def with_whole_paths(state: StudioState) -> StudioState:
    """The state with the whole paths of its files, for one that will lie in a folder that is not known."""
    names = {name: getattr(state, name) for name in FILES}
    whole: dict[str, Any] = {name: str(Path(value).resolve()) for name, value in names.items() if _is_file(value)}
    return replace(state, **whole)


def _is_file(name: str | None) -> bool:
    """Whether a setting names a file: bundled scenes and presets, whose names are plain words, come before such."""
    return name is not None and Path(name).exists() and (Path(name).name != name or "." in name)


def _resolve_file(name: str, folder: Path) -> str:
    """A file's name as seen from the working directory, if there is such a file in ``folder``; else the name itself."""
    path = folder / name
    return str(path) if not Path(name).is_absolute() and path.is_file() else name


def _syntax_error(message: str, where: str) -> UsageError:
    """One line for what the TOML parser says, which names the line last."""
    match = re.search(r"\(at line (\d+), column \d+\)", message)
    place = f"{where}:{match[1]}" if match else where
    return UsageError(f"not valid TOML: {message}", where=place, rule=_KIND)


def _line_of(text: str, name: str) -> int:
    for number, line in enumerate(text.split("\n"), start=1):
        if re.match(rf"\s*[\[\"']*{re.escape(name)}[\]\"']*\s*([=.]|$)", line):
            return number
    return 1
