"""Automatic exposure in stops (EV).

Physical light sources have units such as lux and candela, and their pictures clip without an exposure. As in a camera,
the automatic exposure brings the median luminance of the lit pixels to mid-grey. It is the median over small blocks of
the mean of their lit pixels: where few paths find the light, most pixels of one sample are far too dark.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.color.primaries import REC709, xyz_from_rgb
from lippmann.rendering.film.memory_model import cut_wavefronts
from lippmann.rendering.film.wavefront import trace_frame
from lippmann.rendering.preparation.tuning import TUNING
from lippmann.rendering.transport.integrator import Integrator
from lippmann.rendering.transport.ray_source import ChosenRays, RaySource
from lippmann.rendering.transport.tuning import TUNING as TRANSPORT
from lippmann.scene.values.description import Color


def compute_gain(exposure: float) -> float:
    """Factor on radiance of an exposure in stops (EV)."""
    return float(2.0**exposure)


def measure_exposure(
    integrator: Integrator, source: RaySource, background: Color | None, memory: int, seed: int
) -> float:
    """Exposure in stops (EV) that brings the median luminance of lit pixels to mid-grey; 0 where none is lit.

    Parameters
    ----------
    integrator:
        An integrator without exposure.
    source:
        Rays of the whole picture: all parts of a picture must get the same exposure.
    background:
        Colour of rays that hit nothing, which do not count; None for an environment, which counts.
    memory, seed:
        Bytes that may be used, and the picture's seed.
    """
    columns, rows = (
        (2 * np.arange(count) + 1) * length // (2 * count)
        for length in (source.width, source.height)
        for count in [min(TRANSPORT.probe_side, length)]
    )
    few = ChosenRays(source, *np.meshgrid(columns, rows))
    plan = cut_wavefronts(few.width, few.height, 1, channels=few.channels, memory=memory)
    return compute_exposure(trace_frame(integrator, few, plan, seed=seed, box_filter=True).pixels, background)


def compute_exposure(pixels: NDArray[np.float32], background: Color | None) -> float:
    """The exposure in stops for linear RGB ``(height, width, 3)``; see :func:`measure_exposure`.

    Rounded, so that all machines that render parts of a picture choose the same.
    """
    luminance = pixels.astype(np.float64) @ xyz_from_rgb(REC709)[1]
    lit = luminance > 0
    if background is not None:
        lit &= np.abs(pixels - np.asarray(background, np.float32)).max(axis=-1) > 1e-6
    light, counts = (_sums_of_blocks(each) for each in (np.where(lit, luminance, 0.0), lit))
    if not counts.any():
        return 0.0
    median = float(np.median(light[counts > 0] / counts[counts > 0]))
    return round(math.log2(TUNING.mid_grey / median), 2)


def _sums_of_blocks(values: NDArray[np.generic]) -> NDArray[np.float64]:
    """Sums of ``(height, width)`` over blocks of pixels, those at the edges smaller."""
    for axis in (0, 1):
        values = np.add.reduceat(values, np.arange(0, values.shape[axis], TUNING.exposure_block), axis, np.float64)
    return np.asarray(values, dtype=np.float64)
