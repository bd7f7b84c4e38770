"""A studio state as the words of a command that makes its picture."""

from __future__ import annotations

from collections.abc import Mapping

from lippmann.options.light import LightOptions
from lippmann.options.option import changed_options, default_of, options_of
from lippmann.options.placement import PlacementOptions
from lippmann.options.quality import QualityOptions
from lippmann.options.scene import SceneOptions
from lippmann.studio_app.state import StudioState

#: Settings that are no options of a render.
_OTHERS = ("scene", "eye")

#: Defaults of the commands, from which a new studio's may differ.
_ASSUMED = {
    each.name: default_of(each)
    for kind in (SceneOptions, PlacementOptions, LightOptions, QualityOptions)
    for each, _ in options_of(kind)
}


def render_command(state: StudioState, *, allow_outside: bool = False) -> list[str]:
    """The words of the ``lippmann render`` command that renders a state; ``shlex.join`` makes a line of them."""
    words = ["lippmann", "render", *words_of_state(state)]
    return [*words, "--allow-outside"] if allow_outside else words


def words_of_state(state: StudioState) -> list[str]:
    """The scene and the options of a state, those of a render alone; what commands assume anyway is left out."""
    words = [state.scene if not state.scene.startswith("-") else f"./{state.scene}"]
    flags = {each.name: its.flag_of(each.name) for each, its in options_of(StudioState)}
    for name, value in option_values(state).items():
        flag = flags[name]
        if isinstance(value, bool):
            words.append(flag if value else f"--no-{flag[2:]}")
        else:
            for text in [value] if isinstance(value, str) else value:
                words += [flag, text]
    return words


def option_values(state: StudioState) -> Mapping[str, str | bool | list[str]]:
    """The options of a render by name, as they are typed; switches are bool. What commands assume is left out."""
    given = changed_options(state, _ASSUMED)
    first = {name: given[name] for name in ("display",) if name in given}
    return {name: _spell(value) for name, value in (first | given).items() if name not in _OTHERS and value is not None}


def _spell(value: object) -> str | bool | list[str]:
    if isinstance(value, Mapping):
        return [f"{name}={choice}" for name, choice in value.items()]
    return value if isinstance(value, bool) else _text(value)


def _text(value: object) -> str:
    if isinstance(value, tuple):
        return ",".join(_text(part) for part in value)
    # The shortest text that is read as the same number.
    return repr(value).removesuffix(".0") if isinstance(value, float) else str(value)
