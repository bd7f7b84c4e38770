"""Lenticular sheets by their lenses per inch: typical figures of extruded sheets, certified by no maker.

Crest radius, thickness and index differ by several percent between makers and batches; those of a sheet at hand are on
its data sheet. The table is the one that the optics of this project is checked with, see docs/background/optics.md.
"""

from __future__ import annotations

from dataclasses import dataclass

from lippmann.errors import DisplayError


@dataclass(frozen=True)
class TypicalSheet:
    """Lenses per inch, crest radius and thickness in millimetres, and refractive index of a sheet."""

    lpi: float
    radius: float
    thickness: float
    index: float


#: By name.
TYPICAL_SHEETS = {
    f"{sheet.lpi:g}lpi": sheet
    for sheet in (
        TypicalSheet(18, 1.2319, 3.03, 1.5865),
        TypicalSheet(25, 1.7088, 3.92, 1.5865),
        TypicalSheet(32, 1.2049, 3.16, 1.5865),
        TypicalSheet(42, 0.7846, 2.01, 1.5865),
        TypicalSheet(50, 0.2707, 0.5895, 1.6357),
        TypicalSheet(75, 0.2279, 0.5281, 1.6357),
        TypicalSheet(100, 0.1493, 0.4078, 1.6357),
        TypicalSheet(161, 0.0995, 0.2456, 1.6357),
    )
}


def typical_sheet(name: str) -> TypicalSheet:
    """The sheet of that name, such as ``75lpi``; a :class:`DisplayError` that lists them if there is none."""
    if name not in TYPICAL_SHEETS:
        rule = f"typical sheets are {', '.join(TYPICAL_SHEETS)}"
        raise DisplayError.unknown("sheet", name, TYPICAL_SHEETS, where="sheet", rule=rule)
    return TYPICAL_SHEETS[name]
