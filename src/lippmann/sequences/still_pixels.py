"""Pixels whose light is that of the key frame, while things move in front of a display at rest.

A display at rest shows a surface at rest along the same rays, so that a pixel keeps its light, gloss and mirrors
included, as long as no path that ends there meets anything that has moved. Two tests find these pixels, without any
knowledge of what has moved:

* Their feature buffers are the key frame's, bit for bit. All frames trace them along the same rays.
* Where a surface is seen, *probes* of the key frame and of this one agree around the pixel: single paths of every
  fourth pixel with the same random numbers, which differ only where they meet another surface or another shadow (the
  temporal gradient of Schied et al. 2018, "Gradient Estimation for Real-Time Adaptive Temporal Filtering"). Narrow
  shadows, which few of these meet, are found by paths of every pixel that end at the first surface. Light that bounces
  off what moves, which few paths bring, is found in wide neighbourhoods.

Probes know no caustics, which paths hardly find: pictures with photons are traced whole. So are those whose light
sources move, all of whose pixels change, and those in which so much changes that little is saved: probes miss a part of
the light that bounces off large things.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lippmann.display.panel import PixelWindow
from lippmann.sequences.cuts import Moment, are_emitters_at_rest
from lippmann.sequences.key_light import (
    Floats,
    KeyLight,
    Mask,
    count_columns,
    light_of,
    rays_of,
    sum_coverage,
    trace_others,
)
from lippmann.sequences.tuning import TUNING

if TYPE_CHECKING:
    from lippmann.rendering.film.wavefront import RayTotals
    from lippmann.rendering.methods import Job, Traced


@dataclass(frozen=True, eq=False)
class _Picture:
    """What is kept of a frame, for each column that is traced of a pixel.

    Attributes
    ----------
    window:
        The part of the panel, or of each view of a quilt, that is traced.
    pixels:
        ``(H, columns W, 3)`` linear, denoised.
    features:
        ``(H, columns W)``: numbers that tell the feature buffers.
    probes:
        ``(H, columns W, 3)`` linear, NaN where there are none.
    direct:
        ``(H, columns W, 3)``: those of direct light, likewise.
    errors:
        ``(H, columns W)``: estimated squared errors of the key frame; None where it tells none.
    is_swept:
        ``(H, columns W)``: pixels that have been traced since the key frame.
    """

    window: PixelWindow
    pixels: Floats
    features: NDArray[np.float64]
    probes: Floats
    direct: Floats
    errors: Floats | None
    is_swept: Mask

    def crop(self, window: PixelWindow, columns: int) -> _Picture:
        """The part that another window of the panel shows; NaN where it shows more."""
        if window == self.window:
            return self
        common = window.intersection(self.window)

        def part(values: NDArray[Any]) -> NDArray[Any]:
            there = np.full((window.height, columns * window.width, *values.shape[2:]), np.nan, values.dtype)
            if common is not None:
                there[_locate(common, window, columns)] = values[_locate(common, self.window, columns)]
            return there

        pixels, features = part(self.pixels), part(self.features)
        probes, direct = part(self.probes), part(self.direct)
        errors = None if self.errors is None else part(self.errors)
        return _Picture(window, pixels, features, probes, direct, errors, part(self.is_swept))


def _locate(part: PixelWindow, window: PixelWindow, columns: int) -> tuple[slice, slice]:
    """Rows and traced columns of a part within a window."""
    top, left = part.top - window.top, columns * (part.left - window.left)
    return slice(top, top + part.height), slice(left, left + columns * part.width)


class StillPixels(KeyLight):
    """The pixels of a display at rest that show the same light as in the key frame."""

    keeps_noise = True

    def __init__(self) -> None:
        self._key: _Picture | None = None
        self._own: _Picture | None = None

    def trace_key(self, job: Job, trace: Callable[[Job], Traced]) -> Traced:
        self._own = None  # of the frame before, which passed nothing on
        return super().trace_key(job, trace)

    def trace_next(self, job: Job, trace: Callable[[Job], Traced]) -> Traced:
        self._own = None
        window, columns = _find_window(job), count_columns(job)
        if self._key is None or window is None:
            return trace(job)
        key = self._key.crop(window, columns)
        probes, direct, rays = _trace_probes(job, window)
        self._own = own = replace(
            key, features=_hash_features(job), probes=probes, direct=direct, is_swept=np.ones_like(key.is_swept)
        )
        is_known = _find_still(key, own, job)
        if np.mean(is_known) < TUNING.least_known:
            return trace(job)
        traced = trace_others(job, key.pixels, is_known)
        traced.frame.rays += rays
        # Changes count from the frame whose samples a pixel shows.
        is_kept = np.repeat(is_known, columns, axis=1)
        probes, direct = (np.where(is_kept[..., None], *pair) for pair in ((key.probes, probes), (key.direct, direct)))
        self._own = own = replace(own, probes=probes, direct=direct, is_swept=key.is_swept | ~is_kept)
        self.traced_error = _sum_share(key.errors, own.is_swept)
        return traced

    def holds(self, key: Moment, moment: Moment) -> bool:
        # Light that moves changes a little everywhere, which is too little for probes to tell from frame to frame.
        is_at_rest = np.array_equal(key.placement.world_from_display, moment.placement.world_from_display)
        return is_at_rest and are_emitters_at_rest(key, moment)

    def _keep(self, job: Job, traced: Traced) -> None:
        window, pixels = _find_window(job), np.repeat(traced.frame.pixels, count_columns(job), axis=1)
        if self._own is not None:
            self._key = replace(self._own, pixels=pixels)
        elif window is not None:
            probes, direct, _ = _trace_probes(job, window)
            values = None if traced.errors is None else traced.errors.values
            errors = None if values is None else np.repeat(values, count_columns(job), axis=1)
            nothing = np.zeros(pixels.shape[:2], bool)
            self._key = _Picture(window, pixels, _hash_features(job), probes, direct, errors, nothing)
        self._own = None


def _sum_share(errors: Floats | None, is_chosen: Mask) -> float:
    """The chosen pixels' share of all errors, as far as these are known."""
    if errors is None:
        return 1.0
    share = np.nansum(errors[is_chosen], dtype=np.float64) / max(np.nansum(errors, dtype=np.float64), 1e-30)
    return float(np.clip(share, 0.0, 1.0))


def _find_window(job: Job) -> PixelWindow | None:
    """The window that a picture shows; None of those whose pixels have several sets of rays, or that have photons."""
    from lippmann.rendering.transport.ray_source import DisplayRays, QuiltRays

    light, source = light_of(job), job.source
    if light is None or light.photons is not None or job.sample_source.channels > 1:
        return None
    if isinstance(source, DisplayRays | QuiltRays):
        return source.window
    return PixelWindow(0, 0, source.width, source.height)


def _hash_features(job: Job) -> NDArray[np.float64]:
    """A number for each pixel's feature buffers, which is another one if any of them is."""
    guides = job.denoiser.guides()
    assert guides.height is not None
    roots = np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0])
    return np.asarray(
        guides.albedo @ roots[:3] + guides.normal @ roots[3:6] + roots[6] * sum_coverage(job) + guides.height
    )


def _trace_probes(job: Job, window: PixelWindow) -> tuple[Floats, Floats, RayTotals]:
    """Probes ``(H, columns W, 3)`` of a picture, those of its direct light, and the rays traced for them."""
    from lippmann.device.sobol import named_seed
    from lippmann.rendering.film.memory_model import cut_wavefronts
    from lippmann.rendering.film.wavefront import RayTotals, trace_frame
    from lippmann.rendering.transport.path import PathIntegrator, PreparedLight

    assert isinstance(job.integrator, PathIntegrator)
    source, rays = job.sample_source, RayTotals()
    row, column = np.indices((source.height, source.width))
    column += count_columns(job) * window.left
    is_surface = sum_coverage(job) > 0
    is_probed = is_surface & ((row + window.top + 2 * column) % TUNING.pixels_of_probe == 0)
    # Light that was prepared for one scene would make other paths in another.
    plain = job.integrator.lit_by(PreparedLight())
    found = []
    for integrator, is_chosen in ((plain, is_probed), (plain.with_depth(1), is_surface)):
        probes = np.full((source.height, source.width, 3), np.nan, np.float32)
        for few, places in rays_of(source, is_chosen):
            plan = cut_wavefronts(few.width, few.height, 1, channels=1, memory=job.session.memory)
            seed = named_seed("probes")
            frame = trace_frame(integrator, few, plan, seed=seed, box_filter=job.request.box_filter)
            probes[places] = frame.pixels[0]
            rays += frame.rays
        found.append(probes)
    return found[0], found[1], rays


def _find_still(key: _Picture, own: _Picture, job: Job) -> Mask:
    """The pixels ``(H, W)`` that show the same light in both pictures."""
    is_same = key.features == own.features
    is_agreed = is_same & _find_agreed(key.direct, own.direct, is_same, TUNING.direct_reach, job)
    # Few paths bring much of the light that bounces off a bright surface. As shares of their own light they count too
    # little, and in small neighbourhoods they are too few.
    change, light = (np.where(is_agreed, np.nan_to_num(part), 0) for part in _compare(key.probes, own.probes))
    is_agreed &= _is_little(change, light, TUNING.bounce_reach, job)
    is_agreed &= _find_agreed(key.probes, own.probes, is_same, TUNING.probe_reach, job)
    is_still = is_same & (is_agreed | (sum_coverage(job) == 0))
    return np.asarray(is_still.reshape(len(is_still), -1, count_columns(job)).all(axis=2))


def _compare(key: Floats, own: Floats) -> tuple[Floats, Floats]:
    """Change and light ``(H, columns W)`` of probes ``(H, columns W, 3)``, NaN where there are none."""
    return np.abs(own - key).sum(axis=2), (own + key).sum(axis=2)


def _find_agreed(key: Floats, own: Floats, is_same: Mask, reach: int, job: Job) -> Mask:
    """Where probes ``(H, columns W, 3)`` agree in the mean over ``reach`` pixels to either side."""
    change, light = _compare(key, own)
    is_probed, is_lit = ~np.isnan(light), light > 0
    # Beside another surface light is taken to change, too.
    change = np.where(is_same, np.divide(change, light, out=np.zeros_like(light), where=is_lit), is_lit)
    # Where no probe finds light in either frame, such as on the outer side of a wall, there is none to change.
    return (_mean_around(is_probed, reach, job) > 0) & _is_little(change, is_lit, reach, job)


def _is_little(change: NDArray[Any], light: NDArray[Any], reach: int, job: Job) -> Mask:
    """Where the mean change, less its standard error, is at most the limit's share of the mean light."""
    # Less its standard error: a few long paths that meet what moves would leave patches of grain on clean surfaces.
    error = np.sqrt(_mean_around(np.square(change), reach, job)) / (2 * reach + 1)
    sure = _mean_around(change, reach, job) - error
    return np.asarray(sure <= TUNING.largest_change * _mean_around(light, reach, job))


def _mean_around(values: NDArray[Any], reach: int, job: Job) -> Floats:
    from lippmann.rendering.denoise.noisy_blend import mean_around
    from lippmann.runtime.row_threads import Bands

    return mean_around(values.astype(np.float32), reach, Bands(job.session.engine.threads))


__all__ = ["StillPixels"]
