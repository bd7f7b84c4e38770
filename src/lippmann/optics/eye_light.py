"""The light that an eye gets through a lens: how much from which place of the panel, by the direction of its sight."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lippmann.display.display import Display
from lippmann.display.pixel_aperture import PixelAperture
from lippmann.errors import UsageError
from lippmann.optics.lens import Lens, Real
from lippmann.optics.light_table import light_table
from lippmann.optics.pixel_profile import Trapezoid, kernel, pixel_trapezoid
from lippmann.printable import shorten

#: Rows and columns of directions whose point spread is known: of cylinders, and of micro-lenses.
_DIRECTIONS, _ROUND_DIRECTIONS = (5, 33), (9, 9)

#: Places across a lens: of a cylinder, and most of a micro-lens, whose lit sub-pixels have six.
_PLACES, _ROUND_PLACES, _PER_SUBPIXEL = 481, 193, 6.0

#: Pitches to both sides of the middle of a lens's light that are looked at, and lenses beside the own one.
_REACH, _NEIGHBOURS = 0.75, 2

#: Share of the light of a direction that may be left out far away from its middle.
_LOST = 1e-3


@dataclass(frozen=True)
class EyeLight:
    """Weights of sub-pixels, by the slopes (x, y) of the direction in which the eye stands.

    Attributes
    ----------
    slopes_x, slopes_y:
        Evenly spaced slopes across and along a cylinder, or right and up.
    places:
        ``(rows, columns, 2)`` middle of the light in mm from the lens's axis, evenly spaced over the same slopes: one
        of each pair of slopes, or more.
    weights:
        ``(rows of slopes, columns of slopes, rows, columns)`` weights of a sub-pixel by the distance of its centre from
        that middle, in steps; an odd number of them, one row for a cylinder. All sub-pixels of an even panel together
        weigh 1 straight ahead.
    step:
        Distance between weights in mm.
    """

    slopes_x: Real
    slopes_y: Real
    places: Real
    weights: Real
    step: float

    def through_pupil(self, width: float) -> EyeLight:
        """The light of a pupil whose image on the panel is so many millimetres wide; this one's is a point."""
        shape, weights = _disc(width, self.step), self.weights
        for axis in (3,) if weights.shape[2] == 1 else (2, 3):
            weights = _convolve(weights, shape, axis=axis)
        return replace(self, weights=weights)

    def at(self, slope_x: Real, slope_y: Real) -> tuple[Real, Real]:
        """Places of directions among the rows and among the columns of slopes; beyond them, at their ends."""
        down, right = (
            np.clip((slope - slopes[0]) / (slopes[1] - slopes[0]), 0.0, len(slopes) - 1.0)
            for slope, slopes in ((slope_y, self.slopes_y), (slope_x, self.slopes_x))
        )
        return down, right

    def nearest(self, slope_x: Real, slope_y: Real) -> tuple[NDArray[np.int32], Real]:
        """Number of the nearest direction's weights, row by row, and ``(..., 2)`` middle of the light in mm."""
        down, right = self.at(slope_x, slope_y)
        number = (np.rint(down) * len(self.slopes_x) + np.rint(right)).astype(np.int32)
        return number, self.interpolate_places(down, right)

    def interpolate_places(self, down: Real, right: Real) -> Real:
        """Middle of the light ``(..., 2)`` in mm by bilinear interpolation, at places as of :meth:`at`."""
        rows, columns = (count - 1 for count in self.places.shape[:2])
        y, x = down * (rows / (len(self.slopes_y) - 1)), right * (columns / (len(self.slopes_x) - 1))
        low, left = np.minimum(y.astype(np.intp), rows - 1), np.minimum(x.astype(np.intp), columns - 1)
        part_y, part_x = (y - low)[..., None], (x - left)[..., None]
        lower, upper = (
            self.places[low + up, left] * (1.0 - part_x) + self.places[low + up, left + 1] * part_x for up in (0, 1)
        )
        middle: Real = lower * (1.0 - part_y) + upper * part_y
        return middle


def panel_frame(display: Display) -> Real:
    """Width and height of the panel in pixels, pixel pitch in mm, sine and cosine of the slant of its cylinders.

    What the kernels that gather light know of a display.
    """
    panel, is_cylinder = display.panel, display.lens_array.layout == "lenticular"
    slant = math.radians(display.lens_array.slant if is_cylinder else 0.0)
    return np.array([panel.width, panel.height, panel.pixel_pitch, math.sin(slant), math.cos(slant)])


def eye_light(
    display: Display, slopes_x: tuple[float, float], slopes_y: tuple[float, float], pupil: float = 0.0
) -> EyeLight:
    """The light of a display for directions between two slopes each way.

    Parameters
    ----------
    display:
        A display that gives its lens.
    slopes_x, slopes_y:
        Least and greatest slope of the directions to the right and up: tangents of angles.
    pupil:
        Diameter of the pupil over its distance.

    Raises
    ------
    DisplayError
        The display gives no lens.
    UsageError
        The display is none, or slopes are no two finite numbers.

    Examples
    --------
    >>> from lippmann.optics.eye_light import eye_light
    >>> display = lippmann.load_display("print-60lpi")
    >>> light = eye_light(display, (-0.1, 0.1), (0.0, 0.0), pupil=4 / 500)
    >>> len(light.slopes_x) > 1
    True
    """
    lens = Lens.of(display)
    rows, columns = _DIRECTIONS if lens.is_cylinder else _ROUND_DIRECTIONS
    across = np.linspace(*_checked_slopes("slopes_x", slopes_x), columns)
    along = np.linspace(*_checked_slopes("slopes_y", slopes_y), rows)
    lit = (display.pixel or PixelAperture()).lit_size(display.panel)
    needed = 2 * math.ceil(0.5 * _PER_SUBPIXEL * lens.pitch / min(lit)) + 1
    per_lens = _PLACES if lens.is_cylinder else min(_ROUND_PLACES, needed)
    places, spreads = _spreads(lens, across, along, per_lens)
    step, pixel = lens.pitch / per_lens, display.panel.pixel_pitch
    blur, eye = display.pixel.blur if display.pixel else 0.0, _disc(pupil * display.gap, step)
    # Density over millimetres, times the room that a sub-pixel of one colour has.
    if lens.is_cylinder:
        shape = np.convolve(kernel(pixel_trapezoid(display), blur, step), eye)
        room = pixel * math.cos(math.radians(display.lens_array.slant)) / step
        weights = _convolve(spreads, shape, axis=3) * room
    else:
        wide, high = (np.convolve(kernel(Trapezoid(side, side), blur, step), eye) for side in lit)
        weights = _convolve(_convolve(spreads, wide, axis=3), high, axis=2) * (pixel / step) ** 2
    return EyeLight(across, along, places, _trim(weights), step)


def _checked_slopes(name: str, slopes: tuple[float, float]) -> tuple[float, float]:
    try:
        pair = np.asarray(slopes, dtype=np.float64)
    except (TypeError, ValueError):
        pair = np.empty(0)
    if pair.shape != (2,) or not np.isfinite(pair).all():
        raise UsageError(shorten(slopes), where=name, rule="must be two finite numbers: tangents of angles")
    return float(pair[0]), float(pair[1])


def _spreads(lens: Lens, across: Real, along: Real, per_lens: int) -> tuple[Real, Real]:
    """Middles ``(slopes, slopes, 2)`` of the light in mm, and ``(slopes, slopes, rows, columns)`` shares about them.

    All light straight ahead is 1.
    """
    ahead = float(light_table(lens, 0.0, places_per_lens=per_lens, neighbours=_NEIGHBOURS).light[0])
    middles, spreads = np.zeros((len(along), len(across), 2)), []
    reach = round(_REACH * per_lens)
    for up, row in zip(along, middles, strict=True):
        table = light_table(lens, across, up, places_per_lens=per_lens, neighbours=_NEIGHBOURS)
        shares = table.shares[:, None] if table.squares is None else table.squares
        for middle, light in zip(row, shares / ahead, strict=True):
            for axis in (0,) if lens.is_cylinder else (0, 1):
                sums = light.sum(axis=axis)
                at = float(np.arange(len(sums)) @ sums / sums.sum()) if sums.any() else 0.5 * len(sums)
                middle[axis] = table.places[0] + at * lens.pitch / per_lens
                light = np.moveaxis(_about(np.moveaxis(light, 1 - axis, 0), at, reach), 0, 1 - axis)
            spreads.append(light)
    return middles, np.array(spreads).reshape(*middles.shape[:2], *spreads[0].shape)


def _about(lines: Real, middle: float, reach: int) -> Real:
    """``2 reach + 1`` rows of ``lines`` around a fractional row, linearly interpolated; 0 beyond the first and last."""
    first = math.floor(middle)
    index = first + np.arange(-reach, reach + 2)
    is_there = (index >= 0) & (index < len(lines))
    values = lines[np.where(is_there, index, 0)] * is_there[:, None]
    part = middle - first
    interpolated: Real = values[:-1] * (1.0 - part) + values[1:] * part
    return interpolated


def _convolve(values: Real, shape: Real, axis: int) -> Real:
    """Values convolved with a shape of an odd number of weights; longer by what that reaches beyond them."""
    from scipy.ndimage import convolve1d

    reach = len(shape) // 2
    pads = [(reach, reach) if each == axis else (0, 0) for each in range(values.ndim)]
    convolved: Real = convolve1d(np.pad(values, pads), shape, axis=axis, mode="constant")
    return convolved


def _disc(width: float, step: float) -> Real:
    """Shares of a disc so wide on lines ``step`` wide around its middle."""
    radius = 0.5 * width
    if radius <= 0.0:
        return np.ones(1)
    half = math.ceil(radius / step - 0.5)
    u = np.clip((np.arange(2 * half + 2) - half - 0.5) * step / radius, -1.0, 1.0)
    return np.diff((u * np.sqrt(1.0 - u * u) + np.arcsin(u)) / math.pi)


def _trim(weights: Real) -> Real:
    """Weights without the outer ones that hardly count in any direction, as many on both sides."""
    for axis in (2, 3):
        lines = weights.sum(axis=5 - axis)
        middle = lines.shape[2] // 2
        pairs = lines[..., middle + 1 :] + lines[..., middle - 1 :: -1] if middle else lines[..., 1:]
        beyond = np.cumsum(pairs[..., ::-1], axis=2)[..., ::-1]
        reach = int((beyond > _LOST * lines.sum(axis=2, keepdims=True)).any(axis=(0, 1)).sum())
        weights = np.take(weights, np.arange(middle - reach, middle + reach + 1), axis=axis)
    return np.ascontiguousarray(weights)
