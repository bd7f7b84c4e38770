"""Options in words: values as JSON and TOML have them, and words of the command line as values.

``tomli-w`` does not take the place of :func:`toml_of`: it spreads lists over lines and makes sections of tables, and a
setting is one line, in the studio's files and in a picture's metadata.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from lippmann.errors import UsageError
from lippmann.options.option import Options, changed_options, kinds_of, options_of
from lippmann.printable import shorten


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
    """Options as a picture's metadata hold them: ``name = value`` in TOML, without defaults and folders of files."""
    files = {each.name for each, its in options_of(type(options)) if its.is_file}
    values = {
        name: Path(value).name if name in files and isinstance(value, (str, Path)) else value
        for name, value in changed_options(options).items()
    }
    return lines_of(values)


def lines_of(values: Mapping[str, object]) -> list[str]:
    """Settings as TOML, a line each; None, which TOML cannot say, is left out."""
    return [f"{name} = {toml_of(value)}" for name, value in values.items() if value is not None]


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
    raise UsageError(shorten(value), rule=rule)


_MEMORY_UNITS = {"k": 2**10, "m": 2**20, "g": 2**30, "t": 2**40}


def numbers(text: str, option: str, counts: tuple[int, ...] = (3,)) -> tuple[float, ...]:
    """Numbers separated by commas; ``counts`` says how many there may be."""
    parts = text.split(",")
    expected = f"{counts[0]} to {counts[-1]}" if len(counts) > 1 else counts[0]
    rule = f"{expected} numbers separated by commas" if counts != (1,) else "a number"
    try:
        values = tuple(float(part) for part in parts)
    except ValueError:
        raise UsageError(f"'{text}'", where=option, rule=f"must be {rule}") from None
    if len(values) not in counts or not all(abs(value) < float("inf") for value in values):
        raise UsageError(f"'{text}'", where=option, rule=f"must be {rule}")
    return values


def triple(text: str, option: str) -> tuple[float, float, float]:
    """Three numbers separated by commas."""
    x, y, z = numbers(text, option)
    return x, y, z


def number(text: str, option: str, rule: str) -> float:
    """One number; ``rule`` says what else could have been typed."""
    try:
        return float(text)
    except ValueError:
        raise UsageError(f"'{text}'", where=option, rule=f"must be {rule}") from None


def memory(text: str, option: str) -> int:
    """Bytes of an amount such as ``2G`` or ``512M``."""
    match = re.fullmatch(r"(\d{1,20}(?:\.\d{1,20})?)\s*([kmgt])(?:i?b)?", text.strip().lower())
    amount = 0 if match is None else int(float(match[1]) * _MEMORY_UNITS[match[2]])
    if amount <= 0:
        raise UsageError(f"'{text}' is no amount of memory", where=option, rule="a number with K, M or G, such as 2G")
    return amount


def exposure(text: str, option: str) -> float | Literal["auto"]:
    """Stops, or ``auto``."""
    return "auto" if text == "auto" else number(text, option, "auto, or a number of stops")


def depth_scale(text: str, option: str) -> float | None:
    """A factor; None for ``auto``."""
    return None if text == "auto" else number(text, option, "auto, or a factor")


def turn(text: str, option: str) -> tuple[float, ...]:
    """Yaw, or yaw and pitch, or yaw, pitch and roll in degrees."""
    yaw, *others = numbers(text, option, (1, 2, 3))
    return math.fmod(yaw, 360.0), *others


def light_turn(text: str, option: str) -> tuple[float, float]:
    """Azimuth, or azimuth and elevation in degrees."""
    azimuth, *elevation = numbers(text, option, (1, 2))
    return azimuth, elevation[0] if elevation else 0.0


def variants(texts: list[str], option: str) -> dict[str, str]:
    """``SET=CHOICE``, as often as it was given; ``NAME`` alone is a material variant of glTF."""
    chosen = {}
    for text in texts:
        name, equals, choice = text.rpartition("=") if "=" in text else ("materials", "=", text)
        if not (name and equals and choice):
            rule = "SET=CHOICE, such as shading=red, or NAME of a material variant of glTF"
            raise UsageError(f"'{text}'", where=option, rule=rule)
        chosen[name] = choice
    return chosen


def reader_options(texts: list[str], option: str) -> dict[str, str]:
    """``NAME=VALUE``, as often as it was given."""
    chosen = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise UsageError(f"'{text}'", where=option, rule="NAME=VALUE, an option of the plugin that reads the file")
        chosen[name] = value
    return chosen
