"""The device arrays that an object holds."""

from __future__ import annotations

from dataclasses import is_dataclass

#: Integrators and materials are shallow; what lies deeper belongs to others.
_DEEPEST = 12


def arrays_of(whole: object) -> list[object]:
    """Dr.Jit arrays and Mitsuba's objects in an object, in its parts and theirs, each once.

    Parts are items of collections, fields of dataclasses and attributes of this project's objects.
    """
    found: list[object] = []
    _collect(whole, found, set(), 0)
    return found


def _collect(value: object, found: list[object], seen: set[int], depth: int) -> None:
    import drjit as dr
    import mitsuba as mi

    if id(value) in seen or depth > _DEEPEST:
        return
    seen.add(id(value))
    if isinstance(value, mi.Object) or type(value).__module__.split(".")[0] in ("drjit", "mitsuba"):
        # Arrays without entries have no variable behind them.
        if not dr.is_array_v(value) or dr.width(value) > 0:
            found.append(value)
    elif isinstance(value, dict):
        for item in value.values():
            _collect(item, found, seen, depth + 1)
    elif isinstance(value, (list, tuple, set, frozenset)):
        for item in value:
            _collect(item, found, seen, depth + 1)
    elif hasattr(value, "__dict__") and (is_dataclass(value) or type(value).__module__.startswith("lippmann.")):
        _collect(vars(value), found, seen, depth + 1)
