"""Light tables: the share of the light that leaves a lens in a direction and comes from a place of the panel.

The share of a flat, perfectly clear sheet is 1 in all: what a row lacks is reflected, or lies beyond the places.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lippmann.errors import UsageError
from lippmann.optics.lens import Lens, Real, check_lens
from lippmann.printable import shorten

#: Rays through a cylinder, and rows and columns of rays through a micro-lens.
_LINE_RAYS, _SQUARE_RAYS = 512, 96

#: Places of a table across one lens.
PLACES_PER_LENS = 96

#: Lenses to both sides of the own one whose places a table holds.
_NEIGHBOURS = 1


@dataclass(frozen=True)
class LightTable:
    """Shares of light by direction and place.

    Attributes
    ----------
    slopes:
        ``(directions, 2)`` slopes x and y of the directions.
    edges:
        ``(places + 1,)`` edges of the places in mm, relative to the lens's axis; of rows (upwards) as of columns.
    shares:
        ``(directions, places)`` across the lens; what a micro-lens shows is summed up along y.
    squares:
        ``(directions, rows, columns)`` of a micro-lens; None of a cylinder.

    Examples
    --------
    >>> from lippmann.optics.lens import Lens
    >>> from lippmann.optics.light_table import light_table
    >>> display = lippmann.load_display("print-60lpi")
    >>> table = light_table(Lens.of(display), [0.0, 0.2])
    >>> print([round(float(share), 2) for share in table.light])
    [0.95, 0.95]
    """

    slopes: Real
    edges: Real
    shares: Real
    squares: Real | None = None

    @property
    def places(self) -> Real:
        """Centres of the places in millimetres."""
        return 0.5 * (self.edges[1:] + self.edges[:-1])

    @property
    def light(self) -> Real:
        """Share of light of each direction that comes from these places."""
        light: Real = self.shares.sum(axis=1)
        return light

    @property
    def mean_places(self) -> Real:
        """Centre of the light of each direction, in mm; NaN where there is none."""
        with np.errstate(invalid="ignore"):
            mean: Real = self.shares @ self.places / self.light
        return mean

    def widths(self, share: float = 0.8) -> Real:
        """The point spread by direction: width in mm that holds so much of the light, with equal tails cut off."""
        sums = np.concatenate([np.zeros((len(self.shares), 1)), np.cumsum(self.shares, axis=1)], axis=1)
        ends = [np.interp(np.array([0.5 - 0.5 * share, 0.5 + 0.5 * share]) * row[-1], row, self.edges) for row in sums]
        return np.array([high - low for low, high in ends])


def light_table(
    lens: Lens,
    slopes: ArrayLike,
    along: float = 0.0,
    *,
    places_per_lens: int = PLACES_PER_LENS,
    neighbours: int = _NEIGHBOURS,
) -> LightTable:
    """The light table of a lens in directions of these slopes across it, and one slope along it.

    Parameters
    ----------
    slopes:
        One slope or an array of them: the tangents of angles.
    places_per_lens:
        Places across one lens.
    neighbours:
        Lenses to both sides of the own one whose places the table has.

    Raises
    ------
    DisplayError
        ``lens`` is no :class:`~lippmann.optics.lens.Lens`.
    UsageError
        ``slopes`` are not finite numbers, one or a row.

    Examples
    --------
    >>> from lippmann.optics.lens import Lens
    >>> from lippmann.optics.light_table import light_table
    >>> display = lippmann.load_display("print-60lpi")
    >>> light_table(Lens.of(display), [0.0, 0.2]).shares.shape
    (2, 288)
    """
    directions, edges = _frame(lens, slopes, along, places_per_lens, neighbours)
    from lippmann.optics.trace_kernel import fill_lines, fill_squares

    first, step = float(edges[0]), float(edges[1] - edges[0])
    places = len(edges) - 1
    if lens.is_cylinder:
        table = np.zeros((len(directions), places))
        fill_lines(directions, _nodes(lens), _shape(lens), lens.crests, first, step, table)
        return LightTable(directions, edges, table)
    squares = np.zeros((len(directions), places, places))
    x, y = lens.samples(_SQUARE_RAYS)
    fill_squares(directions, x, y, _shape(lens), lens.crests, first, step, squares)
    return LightTable(directions, edges, squares.sum(axis=1), squares)


def _frame(
    lens: Lens, slopes: ArrayLike, along: float, places_per_lens: int, neighbours: int
) -> tuple[NDArray[np.float64], Real]:
    check_lens(lens)
    try:
        across = np.atleast_1d(np.asarray(slopes, dtype=np.float64))
    except (TypeError, ValueError):
        across = np.array([math.nan])
    if across.ndim != 1 or not np.isfinite(across).all():
        rule = "must be a finite number, or a row of them: tangents of angles"
        raise UsageError(shorten(slopes), where="slopes", rule=rule)
    directions = np.ascontiguousarray(np.stack([across, np.full_like(across, along)], axis=1))
    lenses = 2 * neighbours + 1
    edges = (np.arange(lenses * places_per_lens + 1) / places_per_lens - 0.5 * lenses) * lens.pitch
    return directions, edges


def _nodes(lens: Lens) -> Real:
    return np.linspace(-0.5, 0.5, _LINE_RAYS + 1) * lens.pitch


def _shape(lens: Lens) -> Real:
    profile = lens.profile
    tangential = 0.0 if lens.is_cylinder else 1.0
    return np.array([profile.radius, profile.thickness, profile.index, profile.conic, lens.reach, lens.rim, tangential])
