"""Short forms of displays: ``print:lpi=60,ppi=720,size=8x10in`` and ``monitor:size=3840x2160,dpi=282,pitch=45.5,...``.

The kind, a colon, and ``key=value`` pairs with commas between them. The keys are those of
:func:`~lippmann.display.formats.print_sheet.print_of_texts` and
:func:`~lippmann.display.formats.monitor_toml.monitor_of_texts`.
"""

from __future__ import annotations

from collections.abc import Mapping

from lippmann.display.display import Display
from lippmann.display.formats.monitor_toml import monitor_of_texts
from lippmann.display.formats.print_sheet import print_of_texts
from lippmann.errors import DisplayError

#: Kinds of displays, before the colon.
KINDS = ("print", "monitor")


def is_short_form(name: str) -> bool:
    """Whether a display's name is a short form; the kind alone is one too."""
    return name.partition(":")[0] in KINDS


def display_of_short_form(name: str) -> Display:
    """The display of a short form.

    Raises
    ------
    DisplayError
        If a key is missing, doubled or unknown, or a value will not do; names the key.
    """
    kind, _, rest = name.partition(":")
    try:
        return display_of_texts(kind, _pairs(rest))
    except DisplayError as error:
        where = f"{kind}: {error.where}" if error.where else kind
        raise DisplayError(error.what, where=where, rule=error.rule, fix=error.fix) from None


def display_of_texts(kind: str, texts: Mapping[str, str]) -> Display:
    """The ``print`` or ``monitor`` of values by their keys; raises as :func:`display_of_short_form`."""
    return print_of_texts(texts).display() if kind == "print" else monitor_of_texts(texts).display()


def _pairs(text: str) -> dict[str, str]:
    pairs: dict[str, str] = {}
    for part in text.split(",") if text.strip() else []:
        key, equals, value = (piece.strip() for piece in part.partition("="))
        if not equals or not key or not value:
            raise DisplayError(f"{part.strip()!r} is no pair", rule="it must be key=value pairs with commas between")
        if key in pairs:
            raise DisplayError(f"{key} is given twice", where=key, fix="leave one out")
        pairs[key] = value
    return pairs
