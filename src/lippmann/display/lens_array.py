"""The sheet of lenses in front of the panel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, cast, get_args

from lippmann.display.validation import finite, positive
from lippmann.errors import DisplayError

Layout = Literal["lenticular", "square", "hexagonal"]
LAYOUTS: tuple[Layout, ...] = get_args(Layout)

MAXIMUM_SLANT = 80.0


@dataclass(frozen=True)
class LensArray:
    """A lenticular sheet or an array of square or hexagonal micro-lenses.

    Parameters
    ----------
    layout:
        ``lenticular`` (cylindrical lenses), ``square`` or ``hexagonal``.
    pitch:
        Distance between neighbouring lens centres in the lens plane, across the lenses, in millimetres.
    slant:
        Angle of a lenticular sheet's lens axis from the vertical, in degrees, positive when the top leans to +x;
        below 80 in size. 0 for the other layouts.
    offset:
        Centre of one lens, ``(x, y)`` in millimetres; for a lenticular sheet a point of one lens axis. None aligns
        the array with the panel, see :class:`lippmann.display.Display`.
    row_pitch:
        Distance between the rows of a hexagonal array in millimetres, at least half the pitch; None is the regular
        ``pitch * sqrt(3) / 2``. None for the other layouts.

    Raises
    ------
    DisplayError
        If a value is out of its range or does not belong to the layout.

    Examples
    --------
    >>> lippmann.LensArray("lenticular", pitch=0.5, slant=10.0).layout
    'lenticular'
    """

    layout: Layout
    pitch: float
    slant: float = 0.0
    offset: tuple[float, float] | None = None
    row_pitch: float | None = None

    def __post_init__(self) -> None:
        if self.layout not in LAYOUTS:
            rule = f"the layouts are {', '.join(LAYOUTS)}"
            raise DisplayError(f"layout is {self.layout!r}", where="lens_array.layout", rule=rule)
        object.__setattr__(self, "pitch", positive(self.pitch, "lens_array.pitch"))
        object.__setattr__(self, "slant", self._validate_slant())
        object.__setattr__(self, "offset", self._validate_offset())
        object.__setattr__(self, "row_pitch", self._validate_row_pitch())

    def _validate_slant(self) -> float:
        key = "lens_array.slant"
        slant = finite(self.slant, key)
        if abs(slant) >= MAXIMUM_SLANT:
            rule = f"it must lie between -{MAXIMUM_SLANT:g} and {MAXIMUM_SLANT:g} degrees from the vertical"
            raise DisplayError(f"slant is {slant:g}", where=key, rule=rule, fix="turn the panel instead")
        if slant != 0 and self.layout != "lenticular":
            rule = f"only a lenticular sheet has a slant, this layout is {self.layout}"
            raise DisplayError(f"slant is {slant:g}", where=key, rule=rule, fix="leave the key out")
        return slant

    def _validate_offset(self) -> tuple[float, float] | None:
        if self.offset is None:
            return None
        key, rule = "lens_array.offset", "it must be two finite lengths, x and y"
        try:
            x, y = cast("tuple[object, object]", self.offset)
        except (TypeError, ValueError):
            raise DisplayError(f"offset is {self.offset!r}", where=key, rule=rule) from None
        return finite(x, key, rule=rule), finite(y, key, rule=rule)

    def _validate_row_pitch(self) -> float | None:
        if self.row_pitch is None:
            return None
        key = "lens_array.row_pitch"
        if self.layout != "hexagonal":
            rule = f"only a hexagonal array has a row pitch of its own, this layout is {self.layout}"
            raise DisplayError(f"row_pitch is {self.row_pitch!r}", where=key, rule=rule, fix="leave the key out")
        row_pitch = positive(self.row_pitch, key)
        # Nearer rows would make lenses two rows apart neighbours, and their cells no longer the hexagons meant.
        if row_pitch < 0.5 * self.pitch:
            rule = f"it must be at least half the pitch of {self.pitch:g} mm"
            raise DisplayError(f"row_pitch is {row_pitch:g} mm", where=key, rule=rule)
        return row_pitch

    @property
    def half_cell(self) -> tuple[float, float]:
        """Farthest distance in mm along x and y of a lens's edge from its centre; from its axis if lenticular."""
        half, slant = 0.5 * self.pitch, math.radians(self.slant)
        if self.layout == "lenticular":
            return half * math.cos(slant), half * abs(math.sin(slant))
        if self.layout == "square":
            return half, half
        # The upper corner of a cell, three of which meet.
        return half, 0.5 * self.row_spacing + half**2 / (2.0 * self.row_spacing)

    @property
    def row_spacing(self) -> float:
        """Distance between rows of lens centres in millimetres; infinite for a lenticular sheet, which has one row."""
        if self.layout == "lenticular":
            return math.inf
        if self.layout == "square":
            return self.pitch
        return self.pitch * math.sqrt(3) / 2 if self.row_pitch is None else self.row_pitch
