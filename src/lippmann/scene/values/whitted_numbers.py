"""Vectors, colours and the checks of numbers that all parts of a Whitted-style scene share."""

from __future__ import annotations

import math

from lippmann.errors import SceneError

Vector = tuple[float, float, float]
Color = tuple[float, float, float]


def check(valid: bool, what: str, rule: str) -> None:
    """Raise :class:`SceneError` unless ``valid``."""
    if not valid:
        raise SceneError(what, rule=rule)


def check_finite(name: str, *values: float) -> None:
    """Raise :class:`SceneError` if one of the numbers called ``name`` is not finite."""
    for value in values:
        check(math.isfinite(value), f"{name} is {value}", "numbers are finite")
