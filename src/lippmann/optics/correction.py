"""Pictures made for the lens that is there: the pixels whose light through it comes nearest to the light that is meant.

Box-constrained least squares: with W the shares of pixels in the light of each direction, and T the light that is
meant, the pixels P between black and white that make ``|W P - T|`` least, by FISTA from the picture along true
directions. All rows under upright cylinders have the same ``W``; of it only ``W'W``, a band, is kept. Slanted ones are
those of :mod:`lippmann.optics.slanted_correction`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lippmann.display.display import Display
from lippmann.display.lens_profile import INDICES, LensProfile
from lippmann.errors import DisplayError
from lippmann.optics.lens import Lens
from lippmann.optics.pixel_shares import PixelShares, pixel_shares
from lippmann.optics.slanted_correction import MOST_ROWS, SlantedRows, pixel_crossing
from lippmann.runtime.engine_lock import cached_property
from lippmann.runtime.machine import usable_cores
from lippmann.runtime.row_threads import Bands

Floats = NDArray[np.float32]

#: Directions of light that is meant, for each pixel: with one, directions between them are lost; three gain no more.
PARTS = 2

#: Steps of FISTA: 15 are within 0.1 dB of 200.
_STEPS = 15

#: Relative errors of radius, thickness and index whose cost is told.
TOLERANCE = 0.03


#: Rows about the middle of a picture by which its correction is judged.
_REPORT_ROWS = 64


def parts_beside() -> tuple[float, ...]:
    """Middles of the parts of a pixel, in pixels to the right of the middle of its (sub-)pixel."""
    return tuple((part + 0.5) / PARTS - 0.5 for part in range(PARTS))


def report_rows(height: int) -> slice:
    """The rows of a picture by which its correction is judged."""
    first = max(0, (height - _REPORT_ROWS) // 2)
    return slice(first, min(height, first + _REPORT_ROWS))


_NO_LIMITS = (0.0, np.inf)


@dataclass(frozen=True, eq=False)
class LensCorrection:
    """The correction of pictures for a display with cylinders.

    Raises
    ------
    DisplayError
        If the display gives no lens, has other lenses or hardly slanted ones, or several kinds of pixels.
    """

    display: Display
    subpixels: bool = False

    def __post_init__(self) -> None:
        Lens.of(self.display)
        if self.display.lens_array.layout != "lenticular" or self.display.panel.subpixel_cells is not None:
            rule = "pictures are corrected for cylinders before pixels that are all alike"
        elif not self.display.lattice.rows_are_alike and pixel_crossing(self.display) > MOST_ROWS:
            rule = f"pictures are corrected for cylinders that are upright or cross a pixel within {MOST_ROWS} rows"
        else:
            return
        fix = "leave the correction out: its rays follow the true directions of the lens all the same"
        raise DisplayError("cannot be corrected for its lens", where=self.display.name, rule=rule, fix=fix)

    @property
    def margin(self) -> int:
        """Rows beyond which others have no say in a row."""
        return self._rows.margin

    def rows(self, parts: Sequence[Floats], first: int = 0) -> Floats:
        """Corrected pixels ``(rows, width, 3)`` of the rows from ``first`` on, as if there were no others.

        ``parts`` is the light that is meant, one such array for each part of a pixel. Light is linear, with white at 1.
        """
        meant = _clipped(parts)
        solved = [self._rows.solve(np.ascontiguousarray(meant[..., c]), c, first) for c in range(3)]
        return np.stack(solved, axis=-1)

    def eye_errors(
        self, pictures: Sequence[Floats], parts: Sequence[Floats], profile: LensProfile | None = None, first: int = 0
    ) -> list[float]:
        """Mean squared errors of the light that an eye sees of each picture, over all lenses and directions meant.

        ``profile`` is the lens that is there; by default the display's own. ``first`` is the number of the first row.
        """
        there = self.display if profile is None else replace(self.display, lens=profile)
        return self._rows.squared_errors(pictures, _clipped(parts), first, there)

    def describe(self, pixels: Floats, parts: Sequence[Floats], first: int = 0) -> tuple[dict[str, object], str]:
        """Metadata of corrected ``pixels``, and a line for people."""
        gains = self.gains(pixels, parts, first)
        limited = float(np.mean((pixels <= 0.0) | (pixels >= 1.0)))
        options: dict[str, object] = {"correct": "lens", "correction_limited": limited}
        options |= {f"correction_gain_{name}": gain for name, gain in gains.items()}
        worst = min(("radius", "thickness", "index"), key=lambda name: gains[name])
        return options, (
            f"corrected for its lens: {gains['exact']:+.1f} dB in the directions solved for, {gains[worst]:+.1f} dB "
            f"where the lens's {worst} is {TOLERANCE:.0%} off; {limited:.0%} of the values at black or white"
        )

    def gains(self, pixels: Floats, parts: Sequence[Floats], first: int = 0) -> dict[str, float]:
        """Decibels by which corrected ``pixels`` send light nearer to ``parts`` than the mean of these does.

        They are a bound from above: those of the very directions that were solved for, with their noise.
        Keys: ``exact``, and ``radius``, ``thickness`` and ``index``, each the worse of 3 % more and less.
        """
        before = np.mean(_clipped(parts), axis=0)

        def gain(profile: LensProfile | None) -> float:
            worse, better = self.eye_errors((before, pixels), parts, profile, first)
            return 10.0 * float(np.log10(max(worse, 1e-12) / max(better, 1e-12)))

        lens = Lens.of(self.display).profile
        gains = {"exact": gain(None)}
        for name, limits in (("radius", _NO_LIMITS), ("thickness", _NO_LIMITS), ("index", INDICES)):
            changed = np.clip([getattr(lens, name) * (1.0 + e) for e in (-TOLERANCE, TOLERANCE)], *limits)
            gains[name] = min(gain(replace(lens, **{name: float(value)})) for value in changed)
        return gains

    @cached_property
    def _rows(self) -> _UprightRows | SlantedRows:
        offsets = self.display.panel.subpixel_offsets if self.subpixels else ((0.0, 0.0),) * 3
        if self.display.lattice.rows_are_alike:
            return _UprightRows(self.display, tuple(right for right, _ in offsets))
        return SlantedRows(self.display, offsets, parts_beside())


def _clipped(parts: Sequence[Floats]) -> Floats:
    """``(parts, rows, width, 3)`` between black and white."""
    return np.stack([np.clip(part, 0.0, 1.0) for part in parts])


@dataclass(frozen=True, eq=False)
class _UprightRows:
    """Rows of a display of upright cylinders, one by one; its colours lie ``offsets`` pixels to the right."""

    display: Display
    offsets: tuple[float, ...]
    margin = 0

    def solve(self, meant: Floats, channel: int, first: int) -> Floats:
        """Pixels ``(rows, width)`` of the meant light ``(parts, rows, width)``."""
        from lippmann.optics.correction_kernel import fista_momenta, solve

        shares, band = self._systems[channel]
        solved = np.empty(meant.shape[1:], dtype=np.float32)
        Bands(usable_cores()).lines(
            solve,
            len(solved),
            meant,
            shares.first,
            shares.shares.astype(np.float32),
            band,
            fista_momenta(_STEPS),
            solved,
        )
        return solved

    def squared_errors(self, pictures: Sequence[Floats], meant: Floats, first: int, there: Display) -> list[float]:
        """Mean squared errors of what eyes see of pictures ``(rows, width, 3)`` against ``(parts, rows, width, 3)``."""
        squares = []
        for channel in range(3):
            is_own = there is self.display
            shares = self._systems[channel][0] if is_own else self._shares(there, channel)
            goal = np.moveaxis(meant[..., channel], 0, -1).reshape(meant.shape[1], -1)
            lights = (shares.gather(pixels[..., channel].astype(np.float64)) for pixels in pictures)
            squares.append([np.mean((light - goal) ** 2) for light in lights])
        return [float(error) for error in np.mean(squares, axis=0)]

    @cached_property
    def _systems(self) -> list[tuple[PixelShares, Floats]]:
        """By channel: the shares of all directions meant, those of a pixel one after the other, and the band of W'W."""
        from lippmann.optics.correction_kernel import add_normal_band

        systems: list[tuple[PixelShares, Floats]] = []
        for channel, offset in enumerate(self.offsets):
            if offset in self.offsets[:channel]:
                systems.append(systems[self.offsets.index(offset)])
                continue
            shares = self._shares(self.display, channel)
            band = np.zeros((self.display.panel.width, 2 * shares.shares.shape[1] - 1))
            add_normal_band(shares.first, shares.shares, band)
            systems.append((shares, band.astype(np.float32)))
        return systems

    def _shares(self, display: Display, channel: int) -> PixelShares:
        own, offset, panel = self.display, self.offsets[channel], self.display.panel
        beside = np.array(parts_beside()) + offset
        u = (np.arange(panel.width)[:, None] + 0.5 + beside).ravel()
        x, y = own.panel_point(u, np.full_like(u, 0.5 * panel.height))
        lens, _ = own.lens_of(x, y)
        place = x - own.lens_center(lens, 0.0 * lens, x, y)[0]
        return pixel_shares(display, lens, -own.pinhole_place(place) / own.gap, offset)
