"""From what people type to values that are no options of a render: sizes, steps, displays."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from lippmann.errors import UsageError
from lippmann.options.texts import numbers

if TYPE_CHECKING:
    from lippmann.display import Display


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
    match = re.fullmatch(r"(\d{1,9})[xX](\d{1,9})", text.strip())
    if match is None or "0" in (match[1].lstrip("0") or "0", match[2].lstrip("0") or "0"):
        raise UsageError(f"'{text}'", where=option, rule=f"must be {rule}")
    return int(match[1]), int(match[2])


def display(name: str | None) -> Display | None:
    """The display of that name or file; None if no name is given."""
    from lippmann.display import load_display

    return None if name is None else load_display(name)
