"""Pictures made for the lens that is there: the pixels whose light through it comes nearest to the light that is meant.

Box-constrained least squares: with W the shares of pixels in the light of each direction, and T the light that is
meant, the pixels P between black and white that make ``|W P - T|`` least, by FISTA from the picture along true
directions. All rows under upright cylinders have the same ``W``; of it only ``W'W``, a band, is kept. Slanted ones are
those of :mod:`lippmann.optics.slanted_correction`.

Least squares sharpens the noise of the light that is meant, and trusts a profile that is known to a few percent. Pixels
go from the picture along true directions so far toward it that the mean error of the light to eyes, over lenses within
that tolerance, is expected to be least: estimated without bias by cross-fitting two independent halves of the samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lippmann.display.display import Display
from lippmann.display.lens_profile import INDICES
from lippmann.errors import DisplayError
from lippmann.optics.lens import Lens, Real
from lippmann.optics.pixel_shares import PixelShares, pixel_shares
from lippmann.optics.slanted_correction import MOST_ROWS, Eyes, SlantedRows, pixel_crossing
from lippmann.runtime.engine_lock import cached_property
from lippmann.runtime.machine import usable_cores
from lippmann.runtime.row_threads import Bands

Floats = NDArray[np.float32]

#: Directions of light that is meant, for each pixel: with one, directions between them are lost; three gain no more.
PARTS = 2

#: Steps of FISTA: 15 are within 0.1 dB of 200.
_STEPS = 15

#: Relative errors of radius, thickness and index within which a lens is taken to lie.
TOLERANCE = 0.03

#: Bands of rows, spread over a picture, by which its correction is judged, and rows of each. The teapot on a print, 512
#: rows, 64 samples: a share of 0.98 of the correction, by the whole picture 1 in 2.5 times the time. Half the bands: 0,
#: none of it; half the rows: 0.99.
_BANDS, _BAND_ROWS = 4, 16


def parts_beside() -> tuple[float, ...]:
    """Middles of the parts of a pixel, in pixels to the right of the middle of its (sub-)pixel."""
    return tuple((part + 0.5) / PARTS - 0.5 for part in range(PARTS))


def judged_rows(height: int) -> list[slice]:
    """The bands of rows of a picture by which its correction is judged; the whole of a low one."""
    if height <= _BANDS * _BAND_ROWS:
        return [slice(0, height)]
    firsts = (round((band + 0.5) * height / _BANDS - 0.5 * _BAND_ROWS) for band in range(_BANDS))
    return [slice(first, first + _BAND_ROWS) for first in firsts]


_NO_LIMITS = (0.0, np.inf)

#: Mean squared error of values of 16 bits: less is none.
_ROUNDING = 1.0 / (12.0 * 65535.0**2)


@dataclass(frozen=True)
class CorrectionStep:
    """How far pixels go toward those of least squares, and what an eye is expected to gain by that.

    Attributes
    ----------
    share:
        0 for the picture along true directions to 1 for least squares.
    gains:
        Decibels over the mean of a pixel's parts, of the light to eyes in the directions solved for: ``exact``, and
        ``radius``, ``thickness`` and ``index``, each the worse of 3 % more and less. Under slanted lenses these are
        upper bounds: a sub-pixel of the picture along true directions is narrower than the mean of its parts.
    headroom:
        That of the :class:`LensCorrection`.
    """

    share: float
    gains: dict[str, float]
    headroom: float

    def describe(self, limited: float) -> tuple[dict[str, object], str]:
        """Metadata, and a line for people. ``limited`` is the share of values at black or white."""
        options: dict[str, object] = {"correct": "lens", "correction_share": self.share, "correction_limited": limited}
        options["correction_headroom"] = self.headroom
        options |= {f"correction_gain_{name}": gain for name, gain in self.gains.items()}
        if self.share == 0.0:
            return options, (
                "not corrected for its lens: the noise of its samples would grow by more than the correction gains; "
                "more samples leave it more to gain"
            )
        worst = min(("radius", "thickness", "index"), key=lambda name: self.gains[name])
        return options, (
            f"corrected for its lens: up to {self.gains['exact']:+.1f} dB in the directions solved for, "
            f"{self.gains[worst]:+.1f} dB where the lens's {worst} is {100 * TOLERANCE:.0f} % off; "
            f"{100 * limited:.0f} % of the values at black or white with a headroom of {self.headroom:g}"
        )


@dataclass(frozen=True, eq=False)
class LensCorrection:
    """The correction of pictures for a display with cylinders.

    Parameters
    ----------
    display:
        The display, with its lens.
    subpixels:
        Whether each colour of a pixel has a place of its own.
    headroom:
        How far above black and below white the light that is meant keeps, as a share of white: pixels between black
        and white take more of their neighbours' light away then.

    Raises
    ------
    DisplayError
        If the display gives no lens, has other lenses or hardly slanted ones, or several kinds of pixels.
    """

    display: Display
    subpixels: bool = False
    headroom: float = 0.0

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
        """How many rows away a meant row still influences a corrected one."""
        return self._rows.margin

    def rows(self, parts: Sequence[Floats], first: int = 0, share: float = 1.0) -> Floats:
        """Corrected pixels ``(rows, width, 3)`` of the rows from ``first`` on, as if there were no others.

        ``parts`` is the light that is meant, one such array for each part of a pixel. Light is linear, with white at 1.
        ``share`` is that of a :class:`CorrectionStep`; 1 is least squares.
        """
        meant = self._meant(parts)
        plain: Floats = np.asarray(np.mean(meant, axis=0, dtype=np.float32))
        if share == 0.0:
            return plain
        solved = [self._rows.solve(np.ascontiguousarray(meant[..., c]), c, first) for c in range(3)]
        stepped: Floats = plain + np.float32(share) * (np.stack(solved, axis=-1) - plain)
        return stepped

    def step(self, bands: Sequence[tuple[int, Sequence[Sequence[Floats]]]]) -> CorrectionStep:
        """The step toward least squares of least mean error to eyes, over lenses within :data:`TOLERANCE`.

        Parameters
        ----------
        bands:
            Number of the first row of each band, and independent halves of the light that is meant of its rows: two
            lists of parts, whose mean it is. One list alone is light without noise.

        Notes
        -----
        With x the picture made of light T, W x what eyes see of it, and A and B the halves, the expectation of
        ``|W x|^2 - (W x_A) T_B - (W x_B) T_A + T_A T_B`` is that of ``|W x - T|^2`` with T free of noise and x as noisy
        as it is. It is a parabola of the step.

        Where halves are diagonals of pixels, detail that is finer than these cancels in their pictures, and only lowers
        ``T_A T_B``. The same error of the plain picture by halves whose parts are exchanged, the rows of pixels, is as
        much too large. Their mean is the level.

        Radius, thickness and index are taken to lie evenly within the tolerance. The mean over this cube is that of the
        middles of its six faces, exact to the third order (Stroud 1957).
        """
        own, pictures, level = self._rows.eyes(self.display), [], 0.0
        for first, halves in bands:
            plain = [self.rows(half, first, 0.0) for half in halves]
            solved = [self.rows(half, first) for half in halves]
            exchanged = [halves[part % len(halves)][part] for part in range(len(halves[0]))]
            goals = [self._rows.light_meant(self._meant(half), first) for half in (*halves, exchanged)]
            inside = np.isfinite(goals[0])
            *goals, goal = (goal[inside] for goal in goals)
            pictures.append((first, [*plain, *solved], inside, goals))
            if len(halves) == 2:
                light_of = own([*plain, self.rows(exchanged, first, 0.0)], first)
                *lights, light = (each[inside].astype(np.float64) for each in light_of)
                rows = (light, lights[0] + lights[1] - light), (goal, goals[0] + goals[1] - goal)
                level += 0.5 * (_cross_fit(lights, goals) - _cross_fit(*rows))

        def parabola(eyes: Eyes) -> Real:
            """Error of the plain picture and of that of least squares, and mean square of what is between them."""
            sums, count = np.zeros(3), 0
            for first, band, inside, goals in pictures:
                lights = [light[inside].astype(np.float64) for light in eyes(band, first)]
                pairs = [(lights[k], lights[k + len(goals) - 1]) for k in (0, len(goals))]
                plain, solved = (0.5 * (a + b) for a, b in pairs)
                errors = [
                    light @ light - _cross_fit(pair, goals) for light, pair in zip((plain, solved), pairs, strict=True)
                ]
                sums += (*errors, (solved - plain) @ (solved - plain))
                count += plain.size
            means: Real = (sums + level * np.array([1.0, 1.0, 0.0])) / max(count, 1)
            return means

        lens, others = Lens.of(self.display).profile, {}
        for name, limits in (("radius", _NO_LIMITS), ("thickness", _NO_LIMITS), ("index", INDICES)):
            changed = np.clip([getattr(lens, name) * (1.0 + e) for e in (-TOLERANCE, TOLERANCE)], *limits)
            changes = [replace(lens, **{name: float(value)}) for value in changed]
            others[name] = [parabola(self._rows.eyes(replace(self.display, lens=change))) for change in changes]
        plain, solved, between = np.mean([each for pair in others.values() for each in pair], axis=0)
        share = float(np.clip(0.5 * (plain - solved + between) / max(between, _ROUNDING), 0.0, 1.0))

        def gain(parabola: Real) -> float:
            plain, solved, between = parabola
            error = plain + share * (solved - plain - between) + share**2 * between
            return 10.0 * float(np.log10(max(plain, _ROUNDING) / max(error, _ROUNDING)))

        gains = {name: min(map(gain, pair)) for name, pair in others.items()}
        return CorrectionStep(share, {"exact": gain(parabola(own)), **gains}, self.headroom)

    def _meant(self, parts: Sequence[Floats]) -> Floats:
        """Light that is meant ``(parts, rows, width, 3)``, as far from black and white as the headroom wants."""
        low = np.float32(self.headroom)
        return low + (1 - 2 * low) * np.stack([np.clip(part, 0.0, 1.0) for part in parts])

    @cached_property
    def _rows(self) -> _UprightRows | SlantedRows:
        offsets = self.display.panel.subpixel_offsets if self.subpixels else ((0.0, 0.0),) * 3
        if self.display.lattice.rows_are_alike:
            return _UprightRows(self.display, tuple(right for right, _ in offsets))
        return SlantedRows(self.display, offsets, parts_beside())


def _cross_fit(lights: Sequence[Real], goals: Sequence[Real]) -> float:
    """The light of two halves and what is meant by the other one: what cross-fitting takes from ``|W x|^2``."""
    return float(lights[0] @ goals[-1] + lights[-1] @ goals[0] - goals[0] @ goals[-1])


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

    def eyes(self, there: Display) -> Eyes:
        """The function from pictures to the light that eyes get through real lenses, ordered as :meth:`light_meant`."""
        is_own = there == self.display
        shares = [self._systems[c][0] if is_own else self._shares(there, c) for c in range(3)]

        def lights(pictures: Sequence[Floats], first: int) -> Sequence[Real]:
            del first
            return [
                np.concatenate([shares[c].gather(pixels[..., c].astype(np.float64)).ravel() for c in range(3)])
                for pixels in pictures
            ]

        return lights

    def light_meant(self, parts: Floats, first: int) -> Real:
        """Light ``(n,)`` that eyes are meant to see of ``(parts, rows, width, 3)``."""
        del first
        # By channel, row, and pixel and part, as they are gathered.
        return parts.transpose(3, 1, 2, 0).ravel().astype(np.float64)

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
