"""A look over a whole picture before it is denoised part by part, so that all parts are treated alike.

How bright a picture is and how many rays it takes decide how Open Image Denoise goes about it. Were each part asked by
itself, neighbours could be treated differently, and the seam between them would show.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.denoise.cost_model import effort_of, traced_work
from lippmann.rendering.denoise.oidn import Effort
from lippmann.rendering.film.wavefront import trace_frame
from lippmann.rendering.film.wavefront_plan import cut_wavefronts
from lippmann.rendering.preparation.scattered_rays import ScatteredRays
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.transport.integrator import Integrator
from lippmann.rendering.transport.ray_source import DisplayRays

#: Pixels looked at along each side of the picture, and samples of each.
SIDE, SAMPLES = 128, 8


@dataclass(frozen=True)
class Treatment:
    """How all parts of a picture are denoised: with what effort, and by what they are multiplied for the network."""

    effort: Effort
    exposure: float


def survey(integrator: Integrator, source: DisplayRays, request: RenderRequest) -> Treatment:
    """What suits the picture as a whole: the same for the same picture, whoever looks."""
    few, box = ScatteredRays(source, SIDE), request.box_filter
    samples = min(request.samples, SAMPLES) if box else 1
    plan = cut_wavefronts(few.width, few.height, samples, channels=few.channels, memory=1 << 28)
    frame = trace_frame(integrator, few, plan, seed=request.seed, box_filter=box)
    rays = traced_work(frame.rays.primary, frame.rays.shadow, frame.rays.secondary)
    # What is denoised: pixels, or sub-pixels.
    places = few.width * few.height * (3 if request.keeps_colors(source.display) else 1)
    effort = effort_of(request.denoise, rays / places * request.samples / samples)
    return Treatment(effort, exposure_of(frame.pixels))


def exposure_of(picture: NDArray[np.float32]) -> float:
    """By what linear RGB ``(H, W, 3)`` is multiplied for the network: 0.18 over the geometric mean of its luminance.

    As Open Image Denoise does itself for a picture that it sees whole, by the means of 4 x 4 pixels that are not black.
    """
    luminance = picture.astype(np.float64) @ (0.212671, 0.715160, 0.072169)
    rows, columns = (range(0, side, 4) for side in luminance.shape)
    bins = np.array([luminance[r : r + 4, c : c + 4].mean() for r in rows for c in columns])
    bright = bins[bins > 1e-8]
    return float(0.18 / np.exp2(np.log2(bright).mean())) if bright.size else 1.0
