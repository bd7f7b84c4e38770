"""Checks of values, shared by the parts of a display; each failure is one :class:`DisplayError` that names the key."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Iterable, Mapping
from numbers import Integral, Real
from typing import Any, TypeAlias

from lippmann.errors import DisplayError

#: Pixels along one side, far beyond any panel or print; keeps every count exact in all that follows.
MAXIMUM_COUNT = 1_000_000

#: A table of a file before its values are checked: they may be of any type.
Table: TypeAlias = Mapping[str, object]

#: A table whose keys are known, as arguments of a constructor that checks each value itself. Hence ``Any``.
Arguments: TypeAlias = Mapping[str, Any]

#: Millimetres, far below any wavelength; keeps what is divided by a length finite.
LEAST_LENGTH = 1e-9

POSITIVE = "it must be a finite length above zero"


def number(value: object, key: str, *, rule: str) -> float:
    """``value`` as a float; refuses what is no number (booleans too) and NaN, lets infinities pass."""
    try:
        checked = math.nan if isinstance(value, bool) or not isinstance(value, Real) else float(value)
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


def positive(value: object, key: str) -> float:
    """``value`` as a finite float above zero."""
    checked = finite(value, key, rule=POSITIVE)
    if checked <= 0:
        raise DisplayError(f"{_last(key)} is {value!r}", where=key, rule=POSITIVE)
    if checked < LEAST_LENGTH:
        raise DisplayError(f"{_last(key)} is {value!r}", where=key, rule=f"it must be at least {LEAST_LENGTH:g} mm")
    return checked


def whole_count(value: object, key: str) -> int:
    """``value`` as an int of at least 1 and at most :data:`MAXIMUM_COUNT`."""
    if isinstance(value, bool) or not isinstance(value, Integral) or not 1 <= int(value) <= MAXIMUM_COUNT:
        rule = f"it must be a whole number from 1 to {MAXIMUM_COUNT}"
        raise DisplayError(f"{_last(key)} is {value!r}", where=key, rule=rule)
    return int(value)


def check_text(value: object, key: str, *, empty: bool = True) -> None:
    """Refuse a value that is no string, or an empty one where a name is needed."""
    if not isinstance(value, str) or not (empty or value):
        raise DisplayError(
            f"{key} is {value!r}", where=key, rule="it must be a text" + ("" if empty else ", not empty")
        )


def check_keys(values: object, kind: type, where: str) -> None:
    """Refuse a table whose keys are not the fields of the dataclass ``kind``, or that lacks one without a default."""
    if not isinstance(values, Mapping):
        raise DisplayError(f"{where or 'the display'} is {values!r}", where=where, rule="it must be a table of keys")
    fields = {field.name: field for field in dataclasses.fields(kind)}
    refuse_unknown(values, fields, where)
    for name, field in fields.items():
        if field.default is dataclasses.MISSING and name not in values:
            raise DisplayError(f"the key {name!r} is missing", where=where, rule="it has no default", fix="add it")


def refuse_unknown(given: Iterable[object], known: Collection[str], where: str = "") -> None:
    """Refuse a key that is not known, in the table ``where``."""
    for key in given:
        if key not in known:
            raise DisplayError.unknown("key", key, known, where=_join(where, key))


def _join(where: str, key: object) -> str:
    return f"{where}.{key}" if where else str(key)


def _last(key: str) -> str:
    return key.rpartition(".")[2]
