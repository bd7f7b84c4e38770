"""Least squares of pictures under slanted cylinders, as an eye sees them: by as many rows as a lens crosses a pixel in.

Beside the sub-pixels of one row lie gaps under a slanted lens, which the rows about it fill: an eye takes them
together. As many rows as a lens takes to move by a pixel fill them all: a white panel is even in windows so high, and
uneven in others. So rows are not independent; but the shares of a pixel depend on its place under the lens alone. With
``W`` the shares of a row's pixels in the light of each lens and direction, ``T`` the light that is meant of them, and
``G`` the mean over a window of rows, all windows together are solved for: ``|G (W P - T)|`` is least. ``W'G'GW`` and
``W'G'G`` of the meant light are stencils, known by the place under the lens.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lippmann.display.display import Display
from lippmann.optics.eye_light import EyeLight, eye_light, panel_frame
from lippmann.optics.lens import Real
from lippmann.runtime.engine_lock import cached_property
from lippmann.runtime.machine import usable_cores
from lippmann.runtime.row_threads import Bands

Floats = NDArray[np.float32]
Offset = tuple[int, int, int]

#: Light ``(n,)`` that eyes see of each of the pictures ``(rows, width, 3)`` of the rows from a first one on.
Eyes = Callable[[Sequence[Floats], int], Sequence[Real]]

#: Directions, and places whose stencils are known, for each pixel under a lens; a sub-pixel is a third of one wide.
_DIRECTIONS, _PLACES = 8, 40

#: Parts of the panel, from left to right, whose lenses have the same directions.
_ZONES = 9

#: Entries of a stencil that are nowhere so large a share of the largest one are left out.
_LEAST = 2e-3

#: Steps of FISTA: 10 are within 0.1 dB of 100.
_STEPS = 10

#: Rows in which cylinders may cross a pixel: where they take more, eyes of fewer rows would see a worse picture.
MOST_ROWS = 16

#: Of the directions, and of the windows of rows, one of so many is judged.
_JUDGED = 3


def pixel_crossing(display: Display) -> float:
    """Rows in which slanted cylinders move by a pixel, at least 1."""
    return max(1.0, 1.0 / math.tan(math.radians(abs(display.lens_array.slant))))


@dataclass(frozen=True, eq=False)
class _Stencil:
    """Weights of the pixels about one, by the zone and place of that one.

    ``offsets`` is ``(n, 3)``: part of the pixel, rows down, columns to the right; ``weights`` ``(n, zones x places)``.
    """

    offsets: NDArray[np.int64]
    weights: Floats


@dataclass(frozen=True, eq=False)
class SlantedRows:
    """Rows of a display, solved and judged as an eye sees them.

    Parameters
    ----------
    display:
        A display of cylinders, whose pixels are all alike.
    offsets:
        Places (right, down) of the three colours in a pixel.
    parts:
        Places of the light that is meant, in pixels to the right of these; evenly spaced over a pixel.
    """

    display: Display
    offsets: tuple[tuple[float, float], ...]
    parts: tuple[float, ...]

    @property
    def window(self) -> float:
        """Rows that an eye sees together."""
        return pixel_crossing(self.display)

    @property
    def margin(self) -> int:
        """How many rows away a meant row still influences a corrected one."""
        return 2 * math.ceil(self.window)

    def solve(self, meant: Floats, channel: int, first: int) -> Floats:
        """Pixels ``(rows, width)`` of the meant light ``(parts, rows, width)`` of the rows from ``first`` on."""
        from lippmann.optics.correction_kernel import add_stencil, descend, fista_momenta

        # An eye sees no window of rows beside the panel: the outermost go on.
        meant = np.pad(meant, ((0, 0), (self.margin, self.margin), (0, 0)), mode="edge")
        bands, count = Bands(usable_cores()), meant.shape[1]
        numbers = self._numbers(channel, first - self.margin, count)
        normal, of_meant = self._stencils
        goal = np.zeros(meant.shape[1:], dtype=np.float32)
        solved: Floats = np.asarray(np.mean(meant, axis=0, dtype=np.float32))
        bands.lines(add_stencil, count, meant, numbers, of_meant.offsets, of_meant.weights, goal)
        step = np.float32(1.0) / normal.weights.sum(axis=0).max()
        now, ahead = solved[None].copy(), np.empty_like(solved[None])
        for speed in fista_momenta(_STEPS):
            bands.lines(
                descend, count, now, numbers, normal.offsets, normal.weights, goal, step, speed, solved, ahead[0]
            )
            now, ahead = ahead, now
        return solved[self.margin : -self.margin]

    def eyes(self, there: Display) -> Eyes:
        """The function from pictures to the light that eyes get of them, in the order of :meth:`light_meant`.

        ``display`` has the real lenses. Light is divided by that of a white panel, whose unevenness stays.
        """
        from lippmann.optics.eye_light_kernel import gather_light

        display, (axis, place) = self.display, self._judged_directions
        light = _even_light(self.display, there)
        number, middle = light.nearest(self._slopes(place), np.zeros_like(place))
        middle[..., 0] += axis
        tables = light.weights.reshape(-1, *light.weights.shape[2:])
        cells = np.array(((self.offsets,),), dtype=np.float64)

        def lights(pictures: Sequence[Floats], first: int) -> Sequence[Real]:
            count = self._judged_windows(len(pictures[0]))
            shape = (len(count), place.size)
            # A point a row, so that both few rows and few points are shared out between threads.
            points = len(count) * place.size, 1
            numbers = np.broadcast_to(number.ravel(), shape).reshape(points)
            places = np.broadcast_to(middle.reshape(-1, 2), (*shape, 2)).reshape(*points, 2)
            windows_of = count[:, None] + np.array([0.0, self.window]) + first
            lines = np.broadcast_to(windows_of[:, None], (*shape, 2)).reshape(*points, 2)
            values = np.stack([np.ones_like(pictures[0]), *pictures], axis=-1)
            gathered = np.zeros((*points, *values.shape[2:]), dtype=np.float32)
            geometry = panel_frame(display), cells, tables, light.step, numbers, places, lines
            Bands(usable_cores()).pixels(gather_light, len(gathered), values, first, *geometry, gathered)
            white, *sums = np.moveaxis(gathered.reshape(*shape, *values.shape[2:]), -1, 0)
            is_lit = white > 0.0
            return [np.divide(each, white, out=np.zeros_like(each), where=is_lit).ravel() for each in sums]

        return lights

    def light_meant(self, parts: Floats, first: int) -> Real:
        """Light ``(n,)`` that eyes are to see of ``(parts, rows, width, 3)``; NaN where a lens has not all rows."""
        axis, place = self._judged_directions
        n, count = len(self._row_shares), self._judged_windows(parts.shape[1])
        windows = np.empty((len(count), place.size, 3))
        for channel in range(3):
            goal, is_there = self._meant(parts[..., channel], channel, first, axis, place)
            for line, k in enumerate(count):
                inside = is_there[k : k + n].all(axis=0)
                windows[line, :, channel] = np.where(inside, self._row_shares @ goal[k : k + n], np.nan)
        return windows.ravel()

    @property
    def _judged_directions(self) -> tuple[Real, Real]:
        axis, place = self._directions(np.arange(self.display.lens_grid.columns, dtype=np.float64))
        return axis[:, ::_JUDGED], place[:, ::_JUDGED]

    def _judged_windows(self, rows: int) -> NDArray[np.int64]:
        """The first row of each window."""
        return np.arange(0, rows - len(self._row_shares) + 1, _JUDGED)

    @property
    def _row_shares(self) -> Real:
        """Share of each row in a window, which covers its last row in part."""
        shares: Real = np.minimum(self.window - np.arange(math.ceil(self.window)), 1.0) / self.window
        return shares

    def _directions(self, lens: Real) -> tuple[Real, Real]:
        """``(lenses, directions)``: axis in mm across, and place of each direction relative to it."""
        display = self.display
        per_lens = math.ceil(_DIRECTIONS * display.pixels_per_lens[0])
        steps = ((np.arange(per_lens) + 0.5) / per_lens - 0.5) * display.micro_image_pitch
        axis = (display.lattice.origin_x + lens * display.lattice.pitch)[:, None]
        return np.broadcast_to(axis, (len(lens), per_lens)), steps + axis * (display.magnification - 1.0)

    def _slopes(self, place: Real) -> Real:
        slopes: Real = -self.display.pinhole_place(place) / self.display.gap
        return slopes

    def _across(self, channel: int, rows: Real, columns: Real) -> Real:
        """Places across the lenses in mm of the middles of pixels."""
        right, down = self.offsets[channel]
        x, y = self.display.panel_point(columns + 0.5 + right, rows + 0.5 + down)
        across: Real = self.display.lattice.across(x, y)
        return across

    def _numbers(self, channel: int, first: int, count: int) -> NDArray[np.int32]:
        """Zone and place of pixels, as one number: ``(count, width)``."""
        display = self.display
        panel = display.panel
        numbers = np.empty((count, panel.width), dtype=np.int32)
        columns, places = np.arange(panel.width, dtype=np.float64), self._places
        for row, line in enumerate(numbers):
            across = self._across(channel, np.full_like(columns, first + row), columns) / display.magnification
            at = (across - display.lattice.origin_x) / display.lattice.pitch + 0.5
            lens = np.floor(at)
            zone = np.clip(lens * (_ZONES / display.lens_grid.columns), 0, _ZONES - 1).astype(np.int32)
            line[:] = zone * places + np.minimum((at - lens) * places, places - 1).astype(np.int32)
        return numbers

    @property
    def _places(self) -> int:
        return math.ceil(_PLACES * self.display.pixels_per_lens[0])

    def _meant(
        self, meant: Floats, channel: int, first: int, axis: Real, place: Real
    ) -> tuple[Real, NDArray[np.bool_]]:
        """Light ``(rows, lenses x directions)`` that is meant, by cubics through parts of the same lens and row.

        And whether the row has the lens.
        """
        display, panel = self.display, self.display.panel
        count, rows, width = meant.shape
        line = np.moveaxis(meant, 0, -1).reshape(rows, width * count)
        parts = np.arange(width * count)
        result, is_there = np.empty((rows, place.size)), np.empty((rows, place.size), dtype=bool)
        cosine = math.cos(math.radians(display.lens_array.slant)) * panel.pixel_pitch / count
        for row in range(rows):
            start = self._across(channel, np.array([first + row + 0.0]), np.array([self.parts[0]]))
            at = ((axis + place - start) / cosine).ravel()
            half, middle = (
                0.5 * display.micro_image_pitch / cosine,
                ((axis * display.magnification - start) / cosine).ravel(),
            )
            low, high = np.ceil(middle - half), np.floor(middle + half)
            is_there[row] = (low >= 0) & (high < len(parts))
            inside = np.clip(at, low, high)
            result[row] = sum(
                weight * line[row][np.clip(near, 0, len(parts) - 1).astype(np.int64)]
                for near, weight in _cubic(inside, low, high)
            )
        return result, is_there

    @cached_property
    def _stencils(self) -> tuple[_Stencil, _Stencil]:
        """Those of ``W'G'GW`` and of ``W'G'G`` of the meant light."""
        display, places, shares = self.display, self._places, self._row_shares
        light = _even_light(display, display)
        slant = math.radians(display.lens_array.slant)
        right, down = (display.panel.pixel_pitch * each for each in (math.cos(slant), math.sin(slant)))
        tables = light.weights.reshape(-1, light.weights.shape[3])
        half, reach = tables.shape[1] // 2, (0.5 * tables.shape[1] + 1.0) * light.step
        pitch, finer = display.micro_image_pitch, right / len(self.parts)

        def share(number: NDArray[np.int32], away: Real) -> Real:
            at = np.clip(away / light.step + half, 0.0, 2.0 * half - 1e-9)
            index = at.astype(np.int64)
            value = tables[number, index] * (1.0 - at + index) + tables[number, index + 1] * (at - index)
            shares: Real = np.where(np.abs(away) < reach, value, 0.0)
            return shares

        normal: dict[Offset, Real] = {}
        of_meant: dict[Offset, Real] = {}

        def add(to: dict[Offset, Real], key: Offset, at: NDArray[np.int64], values: Real) -> None:
            to.setdefault(key, np.zeros(_ZONES * places))
            to[key] += np.bincount(at, values, _ZONES * places)

        middles = (np.arange(places) + 0.5) / places - 0.5
        for zone in range(_ZONES):
            lens = np.array([(zone + 0.5) / _ZONES * display.lens_grid.columns - 0.5])
            axis, place = self._directions(lens)
            aside = float(axis[0, 0]) * (display.magnification - 1.0)
            number, middle = light.nearest(self._slopes(place), np.zeros_like(place))
            b, j, k = (each.ravel() for each in np.indices((places, 3, place.shape[1])))
            own = middles[b] * pitch - (j - 1) * pitch
            away = own + aside - middle[0, k, 0]
            is_lit = share(number[0, k], away) > 0.0
            b, k, own, away = b[is_lit], k[is_lit], own[is_lit], away[is_lit]
            at, numbers, value = zone * places + b, number[0, k], share(number[0, k], away)
            for rows, windows in enumerate(np.correlate(shares, shares, mode="full"), start=1 - len(shares)):
                nearest, beyond = -rows * down / right, 2.0 * reach / right
                for column in range(math.floor(nearest - beyond), math.ceil(nearest + beyond) + 1):
                    other = share(numbers, away + rows * down + column * right)
                    if other.any():
                        add(normal, (0, rows, column), at, windows * value * other)
                # Parts of the row that lie under the lens, counted from the first part of the pixel itself.
                start = own + rows * down + self.parts[0] * right
                edge = 0.5 * pitch - pitch / places
                low, high = np.ceil((-edge - start) / finer), np.floor((edge - start) / finer)
                part = np.clip((place[0, k] - aside - start) / finer, low, high)
                for near, weight in _cubic(part, low, high):
                    for each in np.unique(near):
                        chosen = near == each
                        right_of, which = divmod(int(each), len(self.parts))
                        add(of_meant, (which, rows, right_of), at[chosen], (windows * value * weight)[chosen])
        return _prune(normal), _prune(of_meant)


def _even_light(display: Display, there: Display) -> EyeLight:
    """Light of the lenses that are there, for the directions of a display; as bright in all of them."""
    tilt = 0.5 * display.size_mm[0] / display.viewing_distance
    reach = 0.5 * display.micro_image_pitch * display.edge_factor / display.gap + tilt
    # Cylinders are alike along: any two slopes do.
    light = eye_light(there, (-reach, reach), (-1e-3, 1e-3))
    room = display.panel.pixel_pitch * math.cos(math.radians(display.lens_array.slant)) / light.step
    return replace(light, weights=light.weights * (room / light.weights.sum(axis=3, keepdims=True)))


def _cubic(at: Real, low: Real, high: Real) -> Iterator[tuple[Real, Real]]:
    """The four whole numbers about ``at`` and their weights in Lagrange's cubic; none beyond ``low`` and ``high``."""
    first = np.floor(at)
    t = at - first
    before, here, after, beyond = t + 1.0, t, t - 1.0, t - 2.0
    weights = (
        -here * after * beyond / 6.0,
        before * after * beyond / 2.0,
        -before * here * beyond / 2.0,
        before * here * after / 6.0,
    )
    for step, weight in enumerate(weights, start=-1):
        yield np.clip(first + step, low, high), weight


def _prune(entries: dict[Offset, Real]) -> _Stencil:
    largest = max(float(weights.max()) for weights in entries.values())
    chosen = {key: weights for key, weights in sorted(entries.items()) if weights.max() >= _LEAST * largest}
    return _Stencil(np.array(list(chosen)), np.array(list(chosen.values()), dtype=np.float32))
