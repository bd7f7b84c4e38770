"""A studio state as the words of a command that makes its picture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields

from lippmann.studio_app.state import StudioState

#: Settings that are said otherwise than by an option with their value.
_SCENE, _EYE, _SUBPIXELS = "scene", "eye", "subpixels"

#: What commands assume where a setting is not said, where that differs from a new studio.
_ASSUMED = {"integrator": "auto"}


def render_command(state: StudioState, output: str | None = None, *, allow_outside: bool = False) -> list[str]:
    """The words of the ``lippmann render`` command that renders a state; ``shlex.join`` makes a line of them."""
    words = ["lippmann", "render", *words_of_state(state), *(() if output is None else ("--output", output))]
    return [*words, "--allow-outside"] if allow_outside else words


def words_of_state(state: StudioState) -> list[str]:
    """The scene and the options of a state, those of a render alone; what commands assume anyway is left out."""
    words = [state.scene if not state.scene.startswith("-") else f"./{state.scene}"]
    for name, text in option_texts(state).items():
        option = f"--{name.replace('_', '-')}"
        if name == _SUBPIXELS:
            words.append(option if state.subpixels else f"--no-{name}")
        else:
            words += [option, text]
    return words


def option_texts(state: StudioState) -> Mapping[str, str]:
    """The values of a render's options as they are typed, by setting; what commands assume anyway is left out."""
    plain = StudioState()
    texts = {}
    for each in fields(StudioState):
        value = getattr(state, each.name)
        assumed = _ASSUMED.get(each.name, getattr(plain, each.name))
        if each.name not in (_SCENE, _EYE) and value is not None and value != assumed:
            texts[each.name] = _text(value)
    return texts


def _text(value: object) -> str:
    if isinstance(value, tuple):
        return ",".join(_text(part) for part in value)
    # The shortest text that is read as the same number.
    return repr(value).removesuffix(".0") if isinstance(value, float) else str(value)
