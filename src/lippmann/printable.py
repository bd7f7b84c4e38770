"""Text of files as a terminal may show it: what would command the terminal, or turn lines around, is spelt out."""

from __future__ import annotations

import re
import sys

# C0 and C1 controls, line and paragraph separators, and characters that change the direction of what follows.
_UNSAFE = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufeff]")
_UNSAFE_BUT_BREAKS = re.compile(_UNSAFE.pattern.replace("\x00-\x1f", "\x00-\x09\x0b-\x1f"))


def one_line(text: str) -> str:
    """``text`` as a single line; characters that are not to be shown as in Python's strings (``\\x1b``)."""
    return _UNSAFE.sub(_spelt, text)


def lines(text: str) -> str:
    """``text`` with its line breaks, otherwise as :func:`one_line`."""
    return _UNSAFE_BUT_BREAKS.sub(_spelt, text)


def shorten(value: object) -> str:
    """``value`` in an error message: as Python writes it, cut to 60 characters."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def json_text(text: str) -> str:
    """JSON whose strings hold none of these characters raw."""
    return _UNSAFE.sub(lambda match: f"\\u{ord(match[0]):04x}", text)


def _spelt(match: re.Match[str]) -> str:
    return ascii(match[0])[1:-1]


def print_fault(error: Exception, doing: str) -> None:
    """Print one line on a fault of the program, met while ``doing`` something, to standard error."""
    what = " ".join(f"{type(error).__name__}: {error}".split())
    print(one_line(f"lippmann: internal error while {doing}: {what}; report it"), file=sys.stderr)
