"""Hints at the name that a misspelt one may stand for."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def closest_name_hint(name: str, known: Iterable[str]) -> str:
    """``is 'x' meant?`` with the known name that is most like ``name``; empty if none is like it."""
    close = difflib.get_close_matches(name, list(known), n=1)
    return f"is '{close[0]}' meant?" if close else ""
