"""Words of the command line as values of options."""

from __future__ import annotations

import math
import re
from typing import Literal

from lippmann.errors import UsageError

_MEMORY_UNITS = {"": 1, "k": 2**10, "m": 2**20, "g": 2**30, "t": 2**40}


def numbers(text: str, option: str, counts: tuple[int, ...] = (3,)) -> tuple[float, ...]:
    """Numbers separated by commas; ``counts`` says how many there may be."""
    parts = text.split(",")
    expected = " or ".join(str(count) for count in counts)
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
    """Bytes of an amount such as ``2G``, ``512M`` or a plain number of bytes."""
    match = re.fullmatch(r"(\d{1,20}(?:\.\d{1,20})?)\s*([kmgt]?)(?:i?b)?", text.strip().lower())
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
