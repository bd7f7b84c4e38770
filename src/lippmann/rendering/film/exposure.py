"""Exposure: by how many stops a scene's light is raised or lowered, and how that is chosen.

Physical light sources are told in lux and candela, and their pictures clip without an exposure. As a camera does, the
automatic exposure brings the median of what is lit to mid-grey.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.film.scattered_rays import ScatteredRays
from lippmann.rendering.film.wavefront import trace_frame
from lippmann.rendering.film.wavefront_plan import make_plan
from lippmann.rendering.transport.integrator import Integrator
from lippmann.rendering.transport.ray_source import RaySource
from lippmann.scene.values.description import Color

#: Linear radiance that the median of what is lit gets.
MID_GREY = 0.18
#: Pixels looked at along each side of the picture, samples of each, and bytes that the look may take.
SIDE, SAMPLES, MEMORY = 64, 4, 1 << 26
#: Exposures are rounded to this part of a stop, so that all machines that render a picture choose the same.
STEPS = 100
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
    few = ScatteredRays(source, SIDE)
    plan = make_plan(few.width, few.height, SAMPLES, channels=few.channels, memory=MEMORY)
    frame = trace_frame(integrator, few, plan, seed=seed, box_filter=True)
    return exposure_for(frame.pixels, background)


def exposure_for(pixels: NDArray[np.float32], background: Color | None) -> float:
    """The exposure in stops for linear RGB ``(height, width, 3)``; see :func:`measure_exposure`."""
    luminance = pixels.astype(np.float64) @ _LUMINANCE
    lit = luminance > 0
    if background is not None:
        lit &= np.abs(pixels - np.asarray(background, np.float32)).max(axis=-1) > 1e-6
    if not lit.any():
        return 0.0
    return round(math.log2(MID_GREY / float(np.median(luminance[lit]))) * STEPS) / STEPS
