"""``--state``: the settings of a studio's file in place of a command's own defaults."""

from __future__ import annotations

from pathlib import Path

import typer

#: Options of renders in frames have another eye than previews.
_OF_PREVIEWS = ("preview",)


def read_defaults(context: typer.Context, state: Path | None) -> Path | None:
    """Let what the file ``state`` says stand for options that are not given.

    Raises
    ------
    UsageError
        The file cannot be read, or a setting is out of its range.
    """
    if state is None or context.resilient_parsing:
        return state
    from lippmann.studio_app.command_line import option_values
    from lippmann.studio_app.state_toml import read_state

    read = read_state(state)
    known = {parameter.name for parameter in context.command.params}
    texts: dict[str, object] = {"scene": read.scene, **option_values(read)}
    if read.eye is not None and context.command.name in _OF_PREVIEWS:
        texts["eye"] = ",".join(repr(part) for part in read.eye)
    context.default_map = {name: text for name, text in texts.items() if name in known}
    return state
