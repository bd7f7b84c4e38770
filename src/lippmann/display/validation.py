"""Values of a display's parts: checked numbers, and lengths with units. Each failure is one :class:`DisplayError`."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Collection, Iterable, Mapping
from numbers import Integral, Real
from typing import Any, TypeAlias, TypeVar

from lippmann.errors import DisplayError
from lippmann.printable import shorten

T = TypeVar("T")

#: Pixels along one side, far beyond any panel or print; keeps every count exact in all that follows.
MAXIMUM_COUNT = 1_000_000

#: A table of a file before its values are checked: they may be of any type.
Table: TypeAlias = Mapping[str, object]

#: A table whose keys are known, as arguments of a constructor that checks each value itself. Hence ``Any``.
Arguments: TypeAlias = Mapping[str, Any]

#: Millimetres, from far below any wavelength to beyond the Moon's orbit: keeps quotients and powers of lengths finite.
LENGTHS = (1e-9, 1e12)

POSITIVE = "it must be a finite length above zero"
LENGTH = 'a length is a number of millimetres or a string with a unit such as "6.8 mm"'


def is_real(value: object) -> bool:
    """Whether ``value`` is a real number, of Python or of another library; booleans are none."""
    return isinstance(value, Real) and not isinstance(value, bool)


def number(value: object, key: str, *, rule: str) -> float:
    """``value`` as a float; refuses what is no number (booleans too) and NaN, lets infinities pass."""
    try:
        checked = float(value) if isinstance(value, Real) and is_real(value) else math.nan
    except OverflowError:  # a whole number beyond all floats
        checked = math.inf
    if math.isnan(checked):
        raise DisplayError(f"{_last(key)} is {value!r}", where=key, rule=rule)
    return checked


def finite(value: object, key: str, *, rule: str = "it must be a finite number") -> float:
    """``value`` as a finite float."""
    checked = number(value, key, rule=rule)
    if math.isinf(checked):
        raise DisplayError(f"{_last(key)} is {checked!r}", where=key, rule=rule)
    return checked


def positive(value: object, key: str, rule: str = POSITIVE) -> float:
    """``value`` as a finite float above zero."""
    checked = finite(value, key, rule=rule)
    if checked <= 0:
        raise DisplayError(f"{_last(key)} is {value!r}", where=key, rule=rule)
    if not LENGTHS[0] <= checked <= LENGTHS[1]:
        rule = "it must lie between {:g} and {:g} mm".format(*LENGTHS)
        raise DisplayError(f"{_last(key)} is {value!r}", where=key, rule=rule)
    return checked


def whole_count(value: object, key: str) -> int:
    """``value`` as an int of at least 1 and at most :data:`MAXIMUM_COUNT`."""
    if isinstance(value, bool) or not isinstance(value, Integral) or not 1 <= int(value) <= MAXIMUM_COUNT:
        rule = f"it must be a whole number from 1 to {MAXIMUM_COUNT}"
        raise DisplayError(f"{_last(key)} is {value!r}", where=key, rule=rule)
    return int(value)


def check_kind(value: object, kind: type, key: str, fix: str = "") -> None:
    """Refuse a value that is no ``kind``."""
    if not isinstance(value, kind):
        raise DisplayError(shorten(value), where=key, rule=f"it must be a {kind.__name__}", fix=fix)


def check_text(value: object, key: str, *, empty: bool = True) -> None:
    """Refuse a value that is no string, or an empty one where a name is needed."""
    if not isinstance(value, str) or not (empty or value):
        raise DisplayError(
            f"{key} is {value!r}", where=key, rule="it must be a text" + ("" if empty else ", not empty")
        )


def check_keys(values: object, kind: type, where: str) -> Arguments:
    """``values`` as a table whose keys are fields of the dataclass ``kind``, with all that have no default."""
    fields = {field.name: field.default for field in dataclasses.fields(kind)}
    return table_of(values, where, fields, [name for name, default in fields.items() if default is dataclasses.MISSING])


def table_of(value: object, where: str, known: Collection[str], needed: Iterable[str] = ()) -> Arguments:
    """``value`` as a table, called ``where``, with all keys that are needed and none that is not known."""
    if not isinstance(value, Mapping):
        raise DisplayError(f"{where or 'the display'} is {value!r}", where=where, rule="it must be a table of keys")
    refuse_unknown(value, known, where)
    for key in needed:
        if key not in value:
            raise DisplayError(f"the key {key!r} is missing", where=where, rule="it has no default", fix="add it")
    return value


def refuse_unknown(given: Iterable[object], known: Collection[str], where: str = "") -> None:
    """Refuse a key that is not known, in the table ``where``."""
    for key in given:
        if key not in known:
            raise DisplayError.unknown("key", key, known, where=_join(where, key))


def _join(where: str, key: object) -> str:
    return f"{where}.{key}" if where else str(key)


def _last(key: str) -> str:
    return key.rpartition(".")[2]


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
#: ISO 216: sides in mm from that of A0 on, so A4 is 210 x 297.
_PAPER = (1189.0, 841.0, 594.0, 420.0, 297.0, 210.0, 148.0, 105.0)
_SIZE = re.compile(rf"({_NUMBER})\s*([^\W\d]+?)?\s*[xX]\s*({_NUMBER})\s*([^\W\d]+)?")


def length(
    text: str,
    key: str,
    scales: Mapping[str, float] = MILLIMETRES,
    per_inch: tuple[str, ...] = (),
    unit: str = "mm",
    rule: str = LENGTH,
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
        Unit of a bare number; empty where it needs one.
    rule:
        What is said of a text that is no length.

    Raises
    ------
    DisplayError
        If the text is no length, its unit is missing or unknown, or a count per inch is not above zero.
    """
    match = _QUANTITY.fullmatch(text.strip())
    if match is None:
        raise DisplayError(f"{text!r} is not a length", where=key, rule=rule)
    amount, symbol = float(match[1]), match[2] or unit
    if not symbol:
        raise _no_unit(match[1], key, "mm", "cm", "mil", "in")
    if symbol in scales:
        return amount * scales[symbol]
    if symbol in per_inch:
        spacing = INCH / amount if amount > 0 else 0.0
        if not 0 < spacing < math.inf:
            raise DisplayError(f"{text!r} is no length", where=key, rule=f"{symbol} must be above zero")
        return spacing
    raise DisplayError.unknown("unit", symbol, [*scales, *per_inch], where=key)


def millimetres(
    value: T, key: str, scales: Mapping[str, float] = MILLIMETRES, per_inch: tuple[str, ...] = ()
) -> T | float:
    """:func:`length` of a text; any other value stays as it is, for the constructors to check."""
    return length(value, key, scales, per_inch) if isinstance(value, str) else value


def size(text: str, key: str) -> tuple[float, float]:
    """Width and height in millimetres of a text such as ``200x300mm``, ``8x10in``, ``8 in x 25 cm`` or ``A4``.

    A unit at the end counts for both. Papers stand upright.

    Raises
    ------
    DisplayError
        If the text is no size, or a unit is missing or unknown.
    """
    if paper := re.fullmatch("[aA]([0-6])", text.strip()):
        return _PAPER[int(paper[1]) + 1], _PAPER[int(paper[1])]
    match = _SIZE.fullmatch(text.strip())
    if match is None:
        rule = "a size is width x height with a unit, such as 200x300mm or 8x10in, or A0 to A6"
        raise DisplayError(f"{text!r} is not a size", where=key, rule=rule)
    unit_of_height = match[4] or match[2]
    if not unit_of_height:
        raise _no_unit(f"{match[1]}x{match[3]}", key, "mm", "cm", "in")
    sides = []
    for amount, unit in ((match[1], match[2] or unit_of_height), (match[3], unit_of_height)):
        if unit not in MILLIMETRES:
            raise DisplayError.unknown("unit", unit, MILLIMETRES, where=key)
        sides.append(float(amount) * MILLIMETRES[unit])
    return sides[0], sides[1]


#: Digits of a number that an error repeats.
_MOST_DIGITS = 20


def _no_unit(bare: str, key: str, *units: str) -> DisplayError:
    quoted = bare if len(bare) <= _MOST_DIGITS else f"{bare[:_MOST_DIGITS]}..."
    *others, last = (quoted + unit for unit in units)
    return DisplayError(f"{quoted!r} has no unit", where=key, fix=f"say {', '.join(others)} or {last}")


def plain_number(text: str, key: str) -> float:
    """The finite number of a text; a :class:`DisplayError` if it is none."""
    value = float(text) if re.fullmatch(_NUMBER, text.strip()) else math.inf
    if math.isinf(value):  # also of more digits than numbers have
        raise DisplayError(f"{text[:60]!r} is not a number", where=key, rule="it must be a number without a unit")
    return value
