"""Values of options as JSON and TOML have them: numbers, texts, lists and tables."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from lippmann.errors import UsageError
from lippmann.options.option import Options, default_of, kinds_of, options_of


def to_plain(value: object) -> object:
    """A value as JSON has it."""
    if isinstance(value, tuple):
        return [to_plain(part) for part in value]
    return dict(value) if isinstance(value, Mapping) else value


def toml_of(value: object) -> str:
    """A value as TOML has it; of an object that is no plain value its kind."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (str, Path)):
        # JSON's strings are TOML's, but for this one control character.
        return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, tuple):
        return f"[{', '.join(toml_of(float(part)) for part in value)}]"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{toml_of(name)} = {toml_of(each)}' for name, each in value.items())}}}"
    return repr(value) if isinstance(value, (int, float)) else toml_of(f"({type(value).__name__})")


def settings_of(options: Options) -> list[str]:
    """What a picture's metadata say of options: ``name = value`` in TOML, without defaults and folders of files."""
    lines = []
    for each, its in options_of(type(options)):
        value = getattr(options, each.name)
        if value is None or (isinstance(value, type(default_of(each))) and value == default_of(each)):
            continue
        if its.is_file and isinstance(value, (str, Path)):
            value = Path(value).name
        lines.append(f"{each.name} = {toml_of(value)}")
    return lines


def from_plain(kind: Any, value: object) -> Any:
    """``value`` of JSON or TOML as the annotated type ``kind``; choices are left to the option's own check.

    Raises
    ------
    UsageError
        It is of another type.
    """
    kinds = kinds_of(kind)
    if value is None and type(None) in kinds:
        return None
    errors = []
    for each in kinds:
        try:
            return _from_plain(each, value)
        except UsageError as error:
            errors.append(error)
    raise next(error for error in errors if error.rule)


def _from_plain(kind: Any, value: object) -> object:
    origin, parts = get_origin(kind), get_args(kind)
    rule = ""
    if kind is bool:
        rule = "true or false"
        if isinstance(value, bool):
            return value
    elif kind is int:
        rule = "a whole number"
        if isinstance(value, int) and not isinstance(value, bool):
            return value
    elif kind is float:
        rule = "a number"
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            try:
                return float(value)
            except OverflowError:  # a whole number of hundreds of digits
                rule = "a number below 1.8e308"
    elif kind is str or origin is Literal:
        rule = "a text in quotation marks"
        # Beside numbers a word has to be one of its choices.
        if isinstance(value, str):
            return value
    elif origin is tuple:
        rule = f"a list of {len(parts)} numbers"
        if isinstance(value, (list, tuple)) and len(value) == len(parts):
            return tuple(from_plain(part, each) for part, each in zip(parts, value, strict=True))
    elif origin is not None and isinstance(value, Mapping) and all(isinstance(each, str) for each in value.values()):
        return dict(value)
    elif origin is not None:
        rule = "a table of texts"
    raise UsageError(_shown(value), rule=rule)


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
