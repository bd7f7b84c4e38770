"""The (sub-)pixels whose light real lenses send to an eye: the studio's switch *Real lens*.

The weights are those of the viewer's page, see :mod:`lippmann.viewer.lens_light`. Along a cylinder the light comes from
the height of one pixel about the place that the eye sees, in a coarse picture, too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lippmann.display import NUMPY, Display
from lippmann.display.visible_pixels import EyeMap, Floats, PixelSet, Vector, lens_plane_places
from lippmann.optics.eye_light import EyeLight, panel_frame
from lippmann.runtime.machine import usable_cores
from lippmann.runtime.row_threads import Bands
from lippmann.viewer.lens_light import finer_places, light_everywhere
from lippmann.viewing.optical_replay import PUPIL, slopes_to_eye

#: Weight below which a pixel is not traced: a quarter of a code in an even white picture.
_LEAST = 1e-3

#: Lenses at least so many pixels of the picture wide are denoised as one pixel each.
_BLOCK_WIDTH = 1.5


@dataclass(frozen=True, eq=False, kw_only=True)
class MixedPixels(PixelSet):
    """Pixels of which each lens sends a mixture.

    Attributes
    ----------
    starts, members, weights:
        The mixture of lens ``k`` has the entries from ``starts[k]`` to ``starts[k + 1]``: ``(m, channels)`` numbers of
        pixels, and ``(m, 3)`` weights of colours.
    lenses:
        ``(height, width)`` int32: the lens (and row along a cylinder) of each place of the picture. ``places`` holds
        lenses, too: as they lie where they are blocks, else the same.
    """

    starts: NDArray[np.int64]
    members: NDArray[np.int32]
    weights: Floats
    lenses: NDArray[np.int32]

    is_mixed: ClassVar[bool] = True

    def arrange(self, values: Floats) -> Floats:
        """The picture ``(height, width, 3)`` of the pixels' values ``(n, 3)``."""
        return self._mix(values, self.members, self.weights)[self.lenses]

    def arrange_for_denoiser(self, values: Floats) -> Floats:
        """The picture ``(rows, columns, 3)`` for denoisers, of ``places``, with all colours for each colour of
        sub-pixels. It holds means: the sums of the weights differ from lens to lens, which looks like texture.
        """
        kinds, sums = [(self.members, self.weights)], self._sums[:, None]
        if self.channels == 3:
            kinds = [(self.members[:, [k]], np.repeat(self.weights[:, [k]], 3, axis=1)) for k in range(3)]
            sums = self._sums[:, :, None]
        mixtures = np.stack([self._mix(values, *kind) for kind in kinds], axis=1)
        means = mixtures / np.maximum(sums, np.finfo(np.float32).tiny)
        picture = np.concatenate([means, np.zeros_like(means[:1])])[self.places]
        return picture.reshape(len(picture), -1, 3)

    def arrange_denoised(self, picture: Floats) -> Floats:
        """The picture ``(height, width, 3)`` from a denoised one of :meth:`arrange_for_denoiser`."""
        values, is_lens = picture.reshape(*self.places.shape, -1, 3), self.places >= 0
        means = np.zeros((len(self.starts) - 1, *values.shape[2:]), np.float32)
        means[self.places[is_lens]] = values[is_lens]
        own = np.diagonal(means, axis1=1, axis2=2) if self.channels == 3 else means[:, 0]
        return (own * self._sums)[self.lenses]

    @cached_property
    def _sums(self) -> Floats:
        """Sums of the weights of each mixture ``(n, 3)``."""
        return self._mix(np.ones((len(self.column), 3), np.float32), self.members, self.weights)

    def _mix(self, values: Floats, members: NDArray[np.int32], weights: Floats) -> Floats:
        from lippmann.studio_app.real_lens_kernel import mix

        out = np.empty((len(self.starts) - 1, 3), np.float32)
        Bands(usable_cores()).pixels(mix, len(out), self.starts, members, weights, values, out)
        return out


class RealEyeMap(EyeMap):
    """Finds the pixels behind pictures of one size of a display with a lens; parameters as of :class:`EyeMap`."""

    def __init__(self, display: Display, size: tuple[int, int], *, subpixels: bool) -> None:
        self.display, self.size, self.subpixels = display, size, subpixels
        (width, height), lattice = size, display.lattice
        x, y, i, j = lens_plane_places(display, size)
        self._is_line = lattice.layout == "lenticular"
        column = np.rint(i - i.min()).astype(np.int64)
        row = np.broadcast_to(np.arange(height)[:, None], x.shape) if self._is_line else np.rint(j - j.min())
        if lattice.slant:  # along slanted cylinders each place shows other rows
            column = np.broadcast_to(np.arange(width), x.shape)
        shape = int(row.max()) + 1, int(column.max()) + 1
        keys, first, lenses = np.unique(
            row.astype(np.int64) * shape[1] + column, return_index=True, return_inverse=True
        )
        self._lenses = lenses.reshape(x.shape).astype(np.int32)
        self._x, self._y = x.ravel()[first], y.ravel()[first]
        center = lattice.center(i.ravel()[first], j.ravel()[first], self._x, self._y, NUMPY)
        self._center_x, self._center_y = center
        self._places: NDArray[np.int32] = self._lenses
        if not lattice.slant and lattice.pitch * width / display.size_mm[0] >= _BLOCK_WIDTH:
            grid = np.full(shape, -1, np.int32)
            grid.ravel()[keys] = np.arange(len(keys))
            self._places = grid

    def pixels_for_eye(self, eye: Vector) -> PixelSet:
        """The pixels whose light an eye at ``eye`` (mm in the display's frame, z > 0) gets, with their weights."""
        from lippmann.studio_app.real_lens_kernel import weigh

        display, lattice = self.display, self.display.lattice
        light = _light_of(display).through_pupil(PUPIL / eye[2] * display.gap)
        across, along = slopes_to_eye(display, eye, self._center_x, self._center_y)
        at = np.stack(light.at(across, np.abs(along) if self._is_line else along), axis=-1)
        places = light.interpolate_places(*at.T)
        if self._is_line:
            places[:, 0] += lattice.across(self._center_x, self._center_y)
            panel_point = display.visible_panel_point(*eye, self._x, self._y, NUMPY)
            places[:, 1] = display.pixel_coordinates(*panel_point)[1]
        else:
            places += np.stack([self._center_x, self._center_y], axis=-1)
        frame, cells = panel_frame(display), np.array(display.panel.cells, dtype=np.float64)
        bands, count = Bands(usable_cores()), len(at)
        starts, pixels, weights = np.zeros(count + 1, np.int64), np.empty(0, np.int64), np.empty((0, 3), np.float32)
        asked = at, places, light.weights, light.step, frame, cells, self._is_line, not cells.any(), _LEAST
        bands.pixels(weigh, count, *asked, starts, pixels, weights)
        np.cumsum(starts, out=starts)
        pixels, weights = np.empty(starts[-1], np.int64), np.empty((starts[-1], 3), np.float32)
        bands.pixels(weigh, count, *asked, starts, pixels, weights)
        return self._set_of(starts, pixels, weights)

    def _set_of(self, starts: NDArray[np.int64], pixels: NDArray[np.int64], weights: Floats) -> MixedPixels:
        panel, channels = self.display.panel, 3 if self.subpixels else 1
        is_lit = weights > 0 if self.subpixels else np.ones((len(pixels), 1), bool)
        keys = pixels[:, None] * channels + np.arange(channels)
        is_traced = np.zeros(panel.width * panel.height * channels, bool)
        is_traced[keys[is_lit]] = True
        is_traced[:2] |= np.count_nonzero(is_traced) < 2  # a wavefront has at least two lanes
        traced = np.flatnonzero(is_traced)
        number = np.empty(len(is_traced), np.int32)
        number[traced] = np.arange(len(traced), dtype=np.int32)
        members = np.where(is_lit, number[np.where(is_lit, keys, traced[0])], 0)
        # The brightest of each mixture, of which there is one last place more for lenses without light.
        brightest = np.full((len(starts) - 1, channels), -1, np.int32)
        is_full = np.diff(starts) > 0
        for channel in range(channels):
            light = weights[:, channel] if self.subpixels else weights.sum(axis=1)
            most = np.zeros(len(is_full), np.float32)
            most[is_full] = np.maximum.reduceat(light, starts[:-1][is_full]) if len(light) else 0.0
            of = np.repeat(np.arange(len(is_full)), np.diff(starts))
            is_most = (light == most[of]) & (light > 0)
            brightest[of[is_most], channel] = members[is_most, channel]
        pixel = traced // channels
        parts = (part.astype(np.uint32) for part in (pixel % panel.width, pixel // panel.width, traced % channels))
        column, row, channel_of = parts
        brightest_of = brightest[self._lenses]
        return MixedPixels(
            *(column, row, channel_of, brightest_of, self._places),
            starts=starts,
            members=members,
            weights=weights,
            lenses=self._lenses,
        )


@lru_cache(2)
def _light_of(display: Display) -> EyeLight:
    light = light_everywhere(display)
    return replace(light, places=finer_places(light))
