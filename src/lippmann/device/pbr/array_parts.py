"""The arrays in nested dataclasses."""

from __future__ import annotations

from dataclasses import fields, is_dataclass


def arrays_of(whole: object) -> list[object]:
    """Dr.Jit arrays and Mitsuba's objects in a dataclass, in its parts and theirs, and in tuples of them, each once."""
    found: dict[int, object] = {}
    _collect(whole, found)
    return list(found.values())


def _collect(part: object, found: dict[int, object]) -> None:
    import drjit as dr
    import mitsuba as mi

    if is_dataclass(part):
        for field in fields(part):
            _collect(getattr(part, field.name), found)
    elif isinstance(part, tuple):
        for item in part:
            _collect(item, found)
    elif isinstance(part, mi.Object) or dr.is_array_v(part):
        found[id(part)] = part
