"""The lenses in front of a panel: aligned with it, and counted from its top left corner."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from lippmann.display.lattice import Lattice
from lippmann.display.lens_array import LensArray
from lippmann.display.panel import Panel

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
