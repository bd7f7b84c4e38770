"""A slanted lenticular monitor by the numbers that its calibration finds: pitch, slope, centre, order of sub-pixels.

The published formula for panels whose sub-pixels have places of their own, with x and y in [0, 1] from the lower left
corner, W x H pixels, ``pitch`` in lenses per inch of the panel as seen from the viewing distance, at right angles to
the lenses, and (dx, dy) the place of a sub-pixel from the middle of its pixel, right and up, in pixels::

    pitch' = pitch (W / DPI) cos(atan(1 / slope))       lenses along the panel's width
    tilt = H / (W slope)                                by how much they lean
    phase = ((x + dx / W) + (y + dy / H) tilt) pitch' - center

The same in pixels, as it is computed here: a sub-pixel ``u`` pixels from the left edge and ``w`` above the lower one
has the phase ``u A + w B - center`` with A = (pitch / DPI) cos(atan(1 / slope)) and B = A / slope.

The phase mod 1 is the place of the sub-pixel under its lens, from the left edge (0) to the right (1). A
sub-pixel on the right under a lens is seen from the left: the view is 1 - (phase mod 1), from 0, the leftmost, to 1.

The slope is that of the phase: lenses lean by -atan(1 / slope) from the vertical. It is infinite for upright lenses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lippmann.display.array_ops import NUMPY
from lippmann.display.display import Display
from lippmann.display.formats.recorded_depth import default_aperture
from lippmann.display.lens_array import LensArray
from lippmann.display.panel import Panel
from lippmann.display.validation import check_text, finite, number, positive
from lippmann.errors import DisplayError

_INCH = 25.4

#: A lens may lean by less than 80 degrees from the vertical.
STEEPEST_SLOPE = 0.18

#: Lenses per inch, far beyond any that is made.
PITCHES = (1.0, 1000.0)

#: Degrees between the outermost views.
CONES = (1.0, 150.0)

#: Default viewing distance, mm.
DEFAULT_DISTANCE = 600.0

DEFAULT_CONE = 35.0


#: Digits of a centre that is computed from a display; further ones are rounding noise.
_DIGITS = 12
#: Relative rounding error of numbers that are computed from a display.
_ROUNDING = 1e-12

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Monitor:
    """A screen behind a sheet of slanted cylindrical lenses.

    Parameters
    ----------
    name, title:
        As a display's.
    panel:
        Its pixels, with the places of the sub-pixels.
    pitch:
        Lenses per inch of the panel, at right angles to the lenses, as seen from the viewing distance: what makes
        test patterns stand still. 1 to 1000.
    slope:
        Of the phase, see above; at least 0.18 in size, ``math.inf`` for upright lenses.
    center:
        In lenses; whole lenses more or less make no difference.
    view_cone:
        Degrees between the outermost views for an eye that moves sideways, 1 to 150.
    viewing_distance:
        Millimetres in front of the lens plane; ``math.inf`` allowed.

    Raises
    ------
    DisplayError
        If a value is out of range; ``where`` names it.
    """

    name: str
    panel: Panel
    pitch: float
    slope: float
    center: float
    view_cone: float = DEFAULT_CONE
    viewing_distance: float = DEFAULT_DISTANCE
    title: str = ""

    def __post_init__(self) -> None:
        check_text(self.name, "name", empty=False)
        check_text(self.title, "title")
        object.__setattr__(self, "pitch", _within(self.pitch, "pitch", PITCHES, "lenses per inch"))
        object.__setattr__(self, "slope", _validate_slope(self.slope))
        object.__setattr__(self, "center", finite(self.center, "center"))
        object.__setattr__(self, "view_cone", _within(self.view_cone, "view_cone", CONES, "degrees"))
        if self.viewing_distance != math.inf:
            object.__setattr__(self, "viewing_distance", positive(self.viewing_distance, "viewing_distance"))

    @property
    def lenses_right(self) -> float:
        """A of the formula: lenses per pixel to the right."""
        return self.panel.pixel_pitch / _INCH * self.pitch * math.cos(math.atan(1 / self.slope))

    @property
    def lenses_up(self) -> float:
        """B of the formula: lenses per pixel upwards."""
        return self.lenses_right / self.slope

    def phase(self, column: Real, row: Real, channel: int) -> Real:
        """Phase in lenses of the sub-pixel ``channel`` (0 R, 1 G, 2 B) of pixels, row 0 on top; arrays of one shape."""
        u, v = np.asarray(column) + 0.5, np.asarray(row) + 0.5
        right, down = self.panel.subpixel_offset(u, v, channel, NUMPY)
        phase: Real = (u + right) * self.lenses_right + (self.panel.height - v - down) * self.lenses_up - self.center
        return phase

    def display(self) -> Display:
        """The display with these lenses.

        Raises
        ------
        DisplayError
            If a lens covers less than a pixel, or more than the panel.
        """
        slant = -math.atan(1 / self.slope)
        apparent_pitch = _INCH / self.pitch
        gap = apparent_pitch / (math.cos(slant) * 2 * math.tan(math.radians(self.view_cone) / 2))
        magnification = 1 + gap / self.viewing_distance
        panel = self.panel
        middle = panel.width / 2 * self.lenses_right + panel.height / 2 * self.lenses_up - self.center
        axis = (0.5 - middle % 1.0) * apparent_pitch / (math.cos(slant) * magnification)
        aperture = default_aperture(
            self.viewing_distance, lens_pitch=apparent_pitch, gap=gap, pixel_pitch=panel.pixel_pitch
        )
        return Display(
            name=self.name,
            title=self.title,
            panel=panel,
            lens_array=LensArray("lenticular", apparent_pitch / magnification, math.degrees(slant), (axis, 0.0)),
            gap=gap,
            viewing_distance=self.viewing_distance,
            aperture_distance=aperture,
        )

    @staticmethod
    def of_display(display: Display) -> Monitor:
        """The numbers of any display with cylindrical lenses, the centre in [0, 1).

        Raises
        ------
        DisplayError
            If the lenses are not cylindrical, or a number is out of this class's range.
        """
        if display.lens_array.layout != "lenticular":
            rule = "pitch, slope and centre are those of cylindrical lenses"
            raise DisplayError(f"the display {display.name} has {display.lens_array.layout} lenses", rule=rule)
        lattice, panel = display.lattice, display.panel
        slant = math.radians(lattice.slant)
        apparent_pitch = lattice.pitch * display.magnification
        monitor = Monitor(
            name=display.name,
            title=display.title,
            panel=panel,
            pitch=_snap_to_limit(_INCH / apparent_pitch, *PITCHES),
            slope=_snap_to_limit(-1 / math.tan(slant), -STEEPEST_SLOPE, STEEPEST_SLOPE) if slant else math.inf,
            center=0.0,
            view_cone=_snap_to_limit(
                math.degrees(2 * math.atan(apparent_pitch / (math.cos(slant) * 2 * display.gap))), *CONES
            ),
            viewing_distance=display.viewing_distance,
        )
        middle = panel.width / 2 * monitor.lenses_right + panel.height / 2 * monitor.lenses_up
        center = (middle + lattice.origin_x / lattice.pitch - 0.5) % 1.0
        return replace(monitor, center=round(center, _DIGITS) % 1.0)


def _snap_to_limit(value: float, *limits: float) -> float:
    """``value``, or the limit that it misses by rounding alone."""
    return next((limit for limit in limits if math.isclose(value, limit, rel_tol=_ROUNDING)), value)


def _within(value: object, key: str, limits: tuple[float, float], unit: str) -> float:
    checked = finite(value, key)
    if not limits[0] <= checked <= limits[1]:
        rule = f"it must lie between {limits[0]:g} and {limits[1]:g} {unit}"
        raise DisplayError(f"{key} is {checked:g}", where=key, rule=rule)
    return checked


def _validate_slope(value: object) -> float:
    rule = f"it must be at least {STEEPEST_SLOPE:g} in size"
    slope = number(value, "slope", rule=rule)
    if abs(slope) < STEEPEST_SLOPE:
        raise DisplayError(f"slope is {slope:g}", where="slope", rule=rule, fix="upright lenses have an infinite one")
    return abs(slope) if math.isinf(slope) else slope
