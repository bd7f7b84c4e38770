"""Lengths and sizes as people write them: ``6.8 mm``, ``60 lpi``, ``200x300mm``."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from lippmann.display.panel import SubpixelOffsets
from lippmann.errors import DisplayError

INCH = 25.4

#: Millimetres of each unit of length.
MILLIMETRES = {
    "um": 1e-3,
    "µm": 1e-3,
    "mm": 1.0,
    "cm": 10.0,
    "m": 1000.0,
    "mil": 0.0254,
    "in": 25.4,
    "inch": 25.4,
}

# Digits can be matched in one way only: a long row of them must not take time that grows with its square.
_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_UNIT = r"[^\d\s.+-]\S*"
_QUANTITY = re.compile(rf"({_NUMBER})\s*({_UNIT})?")
_SIZE = re.compile(rf"({_NUMBER})\s*([^\W\d]+?)?\s*[xX]\s*({_NUMBER})\s*([^\W\d]+)?")


def length(
    text: str, key: str, scales: Mapping[str, float] = MILLIMETRES, per_inch: tuple[str, ...] = (), unit: str = "mm"
) -> float:
    """Millimetres of a text such as ``"6.8 mm"``.

    Parameters
    ----------
    text:
        A number, with a unit or without one.
    key:
        Key that errors name.
    scales, per_inch:
        Units with their millimetres, and units that count per inch, which give the distance from one to the next.
    unit:
        Unit of a bare number.

    Raises
    ------
    DisplayError
        If the text is no length, its unit is unknown, or a count per inch is not above zero.
    """
    match = _QUANTITY.fullmatch(text.strip())
    if match is None:
        rule = 'a length is a number of millimetres or a string with a unit such as "6.8 mm"'
        raise DisplayError(f"{text!r} is not a length", where=key, rule=rule)
    amount, symbol = float(match[1]), match[2] or unit
    if symbol in scales:
        return amount * scales[symbol]
    if symbol in per_inch:
        spacing = INCH / amount if amount > 0 else 0.0
        if not 0 < spacing < math.inf:
            raise DisplayError(f"{text!r} is no length", where=key, rule=f"{symbol} must be above zero")
        return spacing
    raise DisplayError.unknown("unit", symbol, [*scales, *per_inch], where=key)


def size(text: str, key: str) -> tuple[float, float]:
    """Width and height in millimetres of a text such as ``200x300mm``, ``8x10in`` or ``8 in x 25 cm``.

    A unit at the end counts for both.

    Raises
    ------
    DisplayError
        If the text is no size, or a unit is missing or unknown.
    """
    match = _SIZE.fullmatch(text.strip())
    if match is None:
        rule = "a size is width x height with a unit, such as 200x300mm or 8x10in"
        raise DisplayError(f"{text!r} is not a size", where=key, rule=rule)
    unit_of_height = match[4] or match[2]
    if not unit_of_height:
        bare = f"{match[1]}x{match[3]}"
        fix = f"say {bare}in or {bare}mm"
        raise DisplayError(f"{text!r} has no unit", where=key, rule="inches or millimetres?", fix=fix)
    sides = []
    for amount, unit in ((match[1], match[2] or unit_of_height), (match[3], unit_of_height)):
        if unit not in MILLIMETRES:
            raise DisplayError.unknown("unit", unit, MILLIMETRES, where=key)
        sides.append(float(amount) * MILLIMETRES[unit])
    return sides[0], sides[1]


def plain_number(text: str, key: str) -> float:
    """The finite number of a text; a :class:`DisplayError` if it is none."""
    value = float(text) if re.fullmatch(_NUMBER, text.strip()) else math.inf
    if math.isinf(value):  # also of more digits than numbers have
        raise DisplayError(f"{text[:60]!r} is not a number", where=key, rule="it must be a number without a unit")
    return value


def stripe(order: str, key: str) -> SubpixelOffsets:
    """Offsets of sub-pixels that stand side by side in this order, such as ``"rgb"``; ``"none"`` if they do not."""
    if order == "none":
        return (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)
    if sorted(order) != sorted("rgb"):
        rule = 'it must be an order of sub-pixels such as "rgb", "none", or three pairs [right, down] in pixels'
        raise DisplayError(f"subpixel_offsets is {order!r}", where=key, rule=rule)
    red, green, blue = ((order.index(color) - 1) / 3 for color in "rgb")
    return (red, 0.0), (green, 0.0), (blue, 0.0)
