"""Exposure: by how many stops a scene's light is raised or lowered, and how that is chosen.

Physical light sources are told in lux and candela, and their pictures clip without an exposure. As a camera does, the
automatic exposure brings the median of what is lit to mid-grey.

Where few paths find the light, most pixels of a look are far darker than they will be, and their median with them.
There means over blocks of pixels count, which have many more samples. In other scenes their median is much the same,
but for fine dark patterns, which a second look shows again.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.film.wavefront import trace_frame
from lippmann.rendering.film.wavefront_plan import cut_wavefronts
from lippmann.rendering.preparation.scattered_rays import ScatteredRays
from lippmann.rendering.preparation.tuning import TUNING
from lippmann.rendering.transport.integrator import Integrator
from lippmann.rendering.transport.ray_source import RaySource
from lippmann.scene.values.description import Color

#: Tells the seed of the second look from that of the first.
_SECOND = 0x3C6EF372
#: Rec. 709 luminance of linear RGB.
_LUMINANCE = (0.212671, 0.715160, 0.072169)


def gain_of(exposure: float) -> float:
    """Factor on radiance of an exposure in stops (EV)."""
    return float(2.0**exposure)


def measure_exposure(integrator: Integrator, source: RaySource, background: Color | None, seed: int) -> float:
    """Exposure in stops (EV) that brings the median luminance of what is lit to mid-grey; 0 where nothing is lit.

    Parameters
    ----------
    integrator:
        Not yet exposed.
    source:
        Rays of the whole picture: parts of one picture must be told the same.
    background:
        What rays see that meet nothing, which is not counted; None for an environment, which is.
    """
    few = ScatteredRays(source, TUNING.exposure_side)
    plan = cut_wavefronts(
        few.width, few.height, TUNING.exposure_samples, channels=few.channels, memory=TUNING.exposure_memory
    )

    def look(seed: int) -> NDArray[np.float32]:
        return trace_frame(integrator, few, plan, seed=seed, box_filter=True).pixels

    return exposure_for(look(seed), background, lambda: look(seed ^ _SECOND))


def exposure_for(
    pixels: NDArray[np.float32], background: Color | None, look_again: Callable[[], NDArray[np.float32]]
) -> float:
    """The exposure in stops for linear RGB ``(height, width, 3)``; see :func:`measure_exposure`.

    ``look_again`` gives the same pixels by other samples.
    """
    luminance = pixels.astype(np.float64) @ _LUMINANCE
    lit = luminance > 0
    if background is not None:
        lit &= np.abs(pixels - np.asarray(background, np.float32)).max(axis=-1) > 1e-6
    if not lit.any():
        return 0.0
    median = float(np.median(luminance[lit]))
    if _median_of_blocks(luminance, lit, lit) > TUNING.noisy * median:
        again = look_again().astype(np.float64) @ _LUMINANCE
        both = (luminance + again) / 2
        if _median_of_blocks(np.minimum(luminance, again), both, lit) < TUNING.alike:
            median = _median_of_blocks(both, lit, lit)
    return round(math.log2(TUNING.mid_grey / median) * TUNING.exposure_steps) / TUNING.exposure_steps


def _median_of_blocks(
    values: NDArray[np.float64], over: NDArray[np.float64 | np.bool_], lit: NDArray[np.bool_]
) -> float:
    """Median over blocks of pixels of the sum of ``values`` over another sum, of lit pixels; 0 where no block has
    enough of these."""
    counts = _sums_of_blocks(lit) >= TUNING.lit_share * TUNING.exposure_block**2
    if not counts.any():
        return 0.0
    shares = _sums_of_blocks(np.where(lit, values, 0.0))[counts] / _sums_of_blocks(np.where(lit, over, 0.0))[counts]
    return float(np.median(shares))


def _sums_of_blocks(values: NDArray[np.generic]) -> NDArray[np.float64]:
    side = TUNING.exposure_block
    rows, columns = (size // side for size in values.shape)
    blocks = values[: rows * side, : columns * side].reshape(rows, side, columns, side)
    return np.asarray(blocks.sum(axis=(1, 3)), dtype=np.float64)
