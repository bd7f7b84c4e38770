"""The sheet of lenses in front of the panel; its lens centres in the lens plane, and the lens that holds a point."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal, cast, get_args

from lippmann.display.array_ops import NUMPY, Array, ArrayOps
from lippmann.display.panel import Panel
from lippmann.display.validation import finite, positive
from lippmann.errors import DisplayError
from lippmann.runtime.engine_lock import cached_property

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


Rectangle = tuple[float, float, float, float]


@dataclass(frozen=True)
class Lattice:
    """Lenses at ``origin + indices * pitch``, column ``i`` counted to the right and row ``j`` downwards.

    ``(origin_x, origin_y)`` is the centre of lens (0, 0) in millimetres. For a lenticular sheet ``origin_x`` is the
    coordinate *across* the lenses, ``(x - y tan slant) cos slant``, of the axis of lens 0. Odd rows of a hexagonal
    array lie half a pitch further to the right. ``row_pitch`` is unused (infinite) for a lenticular sheet.

    ``tolerance`` is a length in units of the pitch, far below a pixel and far above rounding noise: a point nearer
    than that to a boundary counts as lying on it, and a point on a boundary belongs to the lens on its right, or to
    the lower one.
    """

    layout: Layout
    pitch: float
    row_pitch: float
    slant: float
    origin_x: float
    origin_y: float
    tolerance: float

    @property
    def rows_are_alike(self) -> bool:
        """Whether all rows of pixels see the same lens geometry, as under upright cylinders."""
        return self.layout == "lenticular" and self.slant == 0.0

    @cached_property
    def axis(self) -> tuple[float, float]:
        """Sine and cosine of the slant."""
        angle = math.radians(self.slant)
        return math.sin(angle), math.cos(angle)

    def across(self, x: Array, y: Array) -> Array:
        """Coordinate of a point across slanted lenses, in millimetres."""
        sin, cos = self.axis
        return x * cos - y * sin

    def along(self, x: Array, y: Array) -> Array:
        """Coordinate of a point along slanted lenses, in millimetres."""
        sin, cos = self.axis
        return x * sin + y * cos

    def from_axes(self, across: Array, along: Array) -> tuple[Array, Array]:
        """The point with these coordinates across and along slanted lenses."""
        sin, cos = self.axis
        return across * cos + along * sin, along * cos - across * sin

    def axis_at(self, i: Array, y: Array) -> Array:
        """The x at which the axis of the lenticular lens ``i`` passes the height ``y`` of the lens plane."""
        sin, cos = self.axis
        return (self.origin_x + i * self.pitch + y * sin) / cos

    def lens_at(self, x: Array, y: Array, ops: ArrayOps) -> tuple[Array, Array]:
        """Indices ``(i, j)``, reals that hold whole numbers, of the lens that contains a point of the lens plane."""
        if self.layout == "lenticular":
            i = self._nearest(self.across(x, y) - self.origin_x, self.pitch, ops)
            return i, i * 0.0
        down = self.origin_y - y
        if self.layout == "square":
            return self._nearest(x - self.origin_x, self.pitch, ops), self._nearest(down, self.row_pitch, ops)
        # The nearest centre lies in one of the two rows that enclose the point.
        upper_j = ops.floor(down / self.row_pitch)
        lower_j = upper_j + 1.0
        upper_i = self._nearest(x - self.origin_x - self._row_shift(upper_j, ops), self.pitch, ops)
        lower_i = self._nearest(x - self.origin_x - self._row_shift(lower_j, ops), self.pitch, ops)
        excess = self._squared_distance(lower_i, lower_j, x, y, ops)
        excess = excess - self._squared_distance(upper_i, upper_j, x, y, ops)
        # A step across the boundary changes this difference by twice the step times the centres' distance.
        is_lower = excess <= 2.0 * self.tolerance * self.pitch * self.pitch
        return ops.where(is_lower, lower_i, upper_i), ops.where(is_lower, lower_j, upper_j)

    def center(self, i: Array, j: Array, x: Array, y: Array, ops: ArrayOps) -> tuple[Array, Array]:
        """Centre of a lens; for a lenticular lens the point of its axis that is level with ``(x, y)`` along it."""
        if self.layout == "lenticular":
            return self.from_axes(self.origin_x + i * self.pitch, self.along(x, y))
        return self._center(i, j, ops)

    def from_corner_of(self, rectangle: Rectangle) -> tuple[Lattice, int, int]:
        """The same lenses, counted so that a rectangle's own begin at (0, 0), and its numbers of columns and rows.

        ``rectangle`` is (left, right, bottom, top) in millimetres of the lens plane; a lens is its own if it holds a
        point of the rectangle's inside.
        """
        _, rows = self._span(rectangle)
        # The first row is never the shifted one.
        is_shifted = self.layout == "hexagonal" and rows[0] % 2 != 0
        origin_x = self.origin_x + (0.5 * self.pitch if is_shifted else 0.0)
        origin_y = self.origin_y - (rows[0] * self.row_pitch if rows[0] else 0.0)
        lattice = replace(self, origin_x=origin_x, origin_y=origin_y)
        columns, _ = lattice._span(rectangle)
        lattice = replace(lattice, origin_x=origin_x + columns[0] * self.pitch)
        return lattice, columns[1] - columns[0] + 1, rows[1] - rows[0] + 1

    def _nearest(self, distance: Array, pitch: float, ops: ArrayOps) -> Array:
        return ops.floor(distance / pitch + (0.5 + self.tolerance))

    def _row_shift(self, j: Array, ops: ArrayOps) -> Array:
        is_odd = j - 2.0 * ops.floor(0.5 * j)
        return (0.5 * self.pitch) * is_odd

    def _center(self, i: Array, j: Array, ops: ArrayOps) -> tuple[Array, Array]:
        x = self.origin_x + i * self.pitch
        if self.layout == "hexagonal":
            x = x + self._row_shift(j, ops)
        return x, self.origin_y - j * self.row_pitch

    def _squared_distance(self, i: Array, j: Array, x: Array, y: Array, ops: ArrayOps) -> Array:
        center_x, center_y = self._center(i, j, ops)
        return (x - center_x) * (x - center_x) + (y - center_y) * (y - center_y)

    def _span(self, rectangle: Rectangle) -> tuple[tuple[int, int], tuple[int, int]]:
        """Smallest and largest column, smallest and largest row of lenses that hold a point inside a rectangle."""
        margin = 2.0 * self.tolerance * self.pitch  # a lens that only touches the edge has no point inside
        left, right, bottom, top = rectangle
        left, right, bottom, top = left + margin, right - margin, bottom + margin, top - margin
        points = [(x, y) for x in (left, right) for y in (bottom, top)]
        if self.layout == "hexagonal":
            # A cell is symmetric about its centre, so where it meets an edge, it does so level with its centre.
            points += [(x, y) for x in self._steps(self.origin_x, self.pitch / 2, left, right) for y in (bottom, top)]
            points += [(x, y) for y in self._steps(self.origin_y, self.row_pitch, bottom, top) for x in (left, right)]
        lenses = [self.lens_at(x, y, NUMPY) for x, y in points]
        columns, rows = [int(i) for i, _ in lenses], [int(j) for _, j in lenses]
        return (min(columns), max(columns)), (min(rows), max(rows))

    @staticmethod
    def _steps(origin: float, step: float, low: float, high: float) -> Iterable[float]:
        first, last = math.ceil((low - origin) / step), math.floor((high - origin) / step)
        return (origin + k * step for k in range(first, last + 1))


#: A point nearer to a boundary between micro-images than this counts as lying on it, in pixels. Rounding noise of
#: double precision stays below 1e-10 pixels on a panel of 100 000 pixels; no optics is made to a billionth of a pixel.
BOUNDARY_TOLERANCE = 1e-9

#: A number of micro-images (or of pixels in one) that is whole to this is taken as whole.
WHOLE_TOLERANCE = 1e-6


@dataclass(frozen=True)
class LensGrid:
    """All lenses that own a point of the panel: ``columns`` x ``rows`` of them, counted from (0, 0) at the top left.

    The corners of a slanted or hexagonal array may hold indices of lenses that own none. A lenticular sheet has one
    row.
    """

    columns: int
    rows: int


def lattice_in_front_of(
    panel: Panel, lenses: LensArray, pixels_per_lens: tuple[float, float | None], magnification: float
) -> tuple[Lattice, LensGrid]:
    """The lattice of the lens centres, in millimetres of the lens plane, and the lenses that own a point of the panel.

    Parameters
    ----------
    panel, lenses:
        The parts of the display.
    pixels_per_lens:
        Pixels of a micro-image across and from row to row; None for the latter if lenticular.
    magnification:
        Size of a micro-image relative to its lens.
    """
    across, down = pixels_per_lens
    width, height = (side / magnification for side in panel.size_mm)
    pitch, origin_x = lenses.pitch, 0.0
    if lenses.slant == 0.0:
        pitch, origin_x = _align(lenses.pitch, panel.width / across, width)
    row_pitch, origin_y = math.inf, 0.0
    if down is not None:
        row_pitch, origin_y = _align(lenses.row_spacing, panel.height / down, height)
    tolerance = BOUNDARY_TOLERANCE / across
    lattice = Lattice(lenses.layout, pitch, row_pitch, lenses.slant, origin_x, origin_y, tolerance)
    if lenses.offset is not None:
        x, y = lenses.offset
        origin = {"origin_x": lattice.across(x, y)} if down is None else {"origin_x": x, "origin_y": y}
        lattice = replace(lattice, **origin)
    lattice, columns, rows = lattice.from_corner_of((-width / 2, width / 2, -height / 2, height / 2))
    return lattice, LensGrid(columns, rows)


def _align(pitch: float, count: float, extent: float) -> tuple[float, float]:
    """Pitch in effect and position of a lens centre, for ``count`` lenses over an extent centred on zero."""
    whole = round(count)
    if abs(count - whole) > WHOLE_TOLERANCE:
        return pitch, 0.0
    pitch = extent / whole
    return pitch, 0.5 * pitch if whole % 2 == 0 else 0.0
