"""Short forms of displays: ``print:lpi=60,ppi=720,size=8x10in`` and ``monitor:size=3840x2160,dpi=282,pitch=45.5,...``.

The kind, a colon, and ``key=value`` pairs with commas between them. The keys are those of
:func:`~lippmann.display.formats.print_sheet.print_of_texts` and
:func:`~lippmann.display.formats.monitor_toml.monitor_of_texts`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from lippmann.display import units
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
        If a key is missing, doubled or unknown, or a value is out of its range; names the key.
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


@dataclass(frozen=True)
class ShortFormSize:
    """The size in a short form, and the text around it: ``head``, ``WxH``, ``tail`` is the form with another one.

    Attributes
    ----------
    width, height:
        Sides in ``unit``.
    unit:
        ``mm`` for prints, ``px`` for monitors.
    head, tail:
        Text before and after ``WxH``; ``tail`` begins with the unit of a print.
    """

    width: float
    height: float
    unit: Literal["mm", "px"]
    head: str
    tail: str


def size_of_short_form(name: str) -> ShortFormSize | None:
    """The size that a display's name sets; None for fixed devices, whose names are no short forms.

    Raises
    ------
    DisplayError
        As :func:`display_of_short_form`.
    """
    if not is_short_form(name):
        return None
    kind, _, rest = name.partition(":")
    parts = rest.split(",")
    at = next((k for k, part in enumerate(parts) if part.partition("=")[0].strip() == "size"), None)
    if at is None:
        raise DisplayError("size is missing", where=kind, rule="it has no default", fix="add it")
    text = parts[at].partition("=")[2].strip()
    head = f"{kind}:{','.join([*parts[:at], 'size='])}"
    tail = "".join(f",{part}" for part in parts[at + 1 :])
    if kind == "print":
        width, height = units.size(text, "size")
        return ShortFormSize(width, height, "mm", head, f"mm{tail}")
    panel = display_of_short_form(name).panel
    return ShortFormSize(panel.width, panel.height, "px", head, tail)


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
