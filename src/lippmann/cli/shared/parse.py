"""From what people type to values: sizes, triples, colours, placements, amounts of memory."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Literal

from lippmann.errors import UsageError

if TYPE_CHECKING:
    from lippmann.cli.shared.console import Console
    from lippmann.display import Display
    from lippmann.scene.light_options import LightOptions
    from lippmann.scene.placement import PlacementOptions
    from lippmann.scene.splat_selection import Crop

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


def steps(text: str, option: str) -> list[float]:
    """Equal steps of ``FIRST:LAST:COUNT``, such as ``-40:40:9``; COUNT is 1 to 9999."""
    parts = text.split(":")
    rule = "FIRST:LAST:COUNT, such as -40:40:9"
    if len(parts) != 3 or not re.fullmatch(r"\d{1,4}", parts[2].strip()) or int(parts[2]) < 1:
        raise UsageError(f"'{text}'", where=option, rule=f"must be {rule}")
    first, last = numbers(f"{parts[0]},{parts[1]}", option, (2,))
    count = int(parts[2])
    # Rounded, so that a step of 0.1 is said as such.
    return [round(first + (last - first) * k / max(count - 1, 1), 9) for k in range(count)]


def size(text: str, option: str, rule: str = "width x height in pixels, such as 512x512") -> tuple[int, int]:
    """Width and height in pixels, such as ``512x512``; or columns and rows, as ``rule`` says."""
    match = re.fullmatch(r"(\d{1,6})[xX](\d{1,6})", text.strip())
    if match is None or "0" in (match[1].lstrip("0") or "0", match[2].lstrip("0") or "0"):
        raise UsageError(f"'{text}' is no size", where=option, rule=rule)
    return int(match[1]), int(match[2])


def memory(text: str | None, option: str = "--memory") -> int | None:
    """Bytes of an amount such as ``2G``, ``512M`` or a plain number of bytes."""
    if text is None:
        return None
    match = re.fullmatch(r"(\d{1,20}(?:\.\d{1,20})?)\s*([kmgt]?)(?:i?b)?", text.strip().lower())
    amount = 0 if match is None else int(float(match[1]) * _MEMORY_UNITS[match[2]])
    if amount <= 0:
        raise UsageError(f"'{text}' is no amount of memory", where=option, rule="a number with K, M or G, such as 2G")
    return amount


def exposure(text: str) -> float | Literal["auto"]:
    """Stops, or ``auto``."""
    return "auto" if text == "auto" else number(text, "--exposure", "auto, or a number of stops")


def quality(asked: float | None, former: float | None, console: Console) -> float | None:
    """The quality of the whole picture, also by the former name of its option."""
    if former is None:
        return asked
    console.remark("--quality-mean is called --quality now")
    if asked is not None:
        raise UsageError("is what --quality asks for", where="--quality-mean", rule="only one", fix="leave it out")
    return former


def number(text: str, option: str, rule: str) -> float:
    """One number; ``rule`` says what else could have been typed."""
    try:
        return float(text)
    except ValueError:
        raise UsageError(f"'{text}'", where=option, rule=f"must be {rule}") from None


def color(text: str | None) -> tuple[float, float, float] | None:
    """A background colour from what was typed."""
    return None if text is None else triple(text, "--background")


def crop(text: str | None) -> Crop | None:
    """A box from what was typed."""
    if text is None:
        return None
    x0, y0, z0, x1, y1, z1 = numbers(text, "--crop", (6,))
    return x0, y0, z0, x1, y1, z1


def window(text: str | None) -> tuple[float, float] | None:
    """Lowest and highest value from what was typed."""
    if text is None:
        return None
    low, high = numbers(text, "--window", (2,))
    return low, high


def display(name: str | None) -> Display | None:
    """The display of that name or file; None if no name is given."""
    from lippmann.display import load_display

    return None if name is None else load_display(name)


def placement(
    camera: str | None,
    place: str | None,
    turn: str | None,
    shift: str | None,
    scale: float,
    depth_scale: str,
    pop_out: float | None,
) -> PlacementOptions:
    """Where the display is to stand, from the options of those names."""
    from lippmann.scene.placement import PlacementOptions

    return PlacementOptions.of(
        {
            "mode": place,
            "camera": camera,
            "turn": 0.0 if turn is None else angles(turn),
            "shift": (0.0, 0.0, 0.0) if shift is None else triple(shift, "--shift"),
            "scale": scale,
            "depth_scale": None if depth_scale == "auto" else number(depth_scale, "--depth-scale", "auto, or a factor"),
            "pop_out": pop_out,
        }
    )


def light(turn: str | None, strength: float, environment_strength: float) -> LightOptions:
    """Direction and strength of light, from the options of those names."""
    from lippmann.scene.light_options import LightOptions

    azimuth, *elevation = (0.0,) if turn is None else numbers(turn, "--light-turn", (1, 2))
    return LightOptions((azimuth, elevation[0] if elevation else 0.0), strength, environment_strength)


def angles(text: str) -> tuple[float, ...]:
    """Yaw, or yaw and pitch, or yaw, pitch and roll in degrees from what was typed."""
    yaw, *others = numbers(text, "--turn", (1, 2, 3))
    return math.fmod(yaw, 360.0), *others


def variants(texts: list[str] | None) -> dict[str, str]:
    """``SET=CHOICE``, as often as it was given; ``NAME`` alone is a material variant of glTF."""
    chosen = {}
    for text in texts or ():
        name, equals, choice = text.rpartition("=") if "=" in text else ("materials", "=", text)
        if not (name and equals and choice):
            rule = "SET=CHOICE, such as shading=red, or NAME of a material variant of glTF"
            raise UsageError(f"'{text}'", where="--variant", rule=rule)
        chosen[name] = choice
    return chosen
