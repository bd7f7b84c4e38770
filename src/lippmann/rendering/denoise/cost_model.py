"""What denoising costs beside tracing, and how much effort it deserves.

Costs are reckoned in rays, not taken from a clock: the same seed gives the same picture on every machine, however busy.
One ray with its shading takes 0.4 to 1.1 microseconds of a CPU core in the bundled scenes and two glTF scenes; that of
Open Image Denoise and of its guides is set against the middle of this.
"""

from __future__ import annotations

from lippmann.options.choices import Denoiser
from lippmann.rendering.denoise.oidn import Effort

#: What a shadow ray costs, in rays that are followed and shaded: a third to four fifths in the bundled scenes.
SHADOW_COST = 0.5
#: Rays per pixel from which on a picture is worth the high effort. A run then takes the time of 12 rays per pixel more
#: than the fast one, for 0.7 dB on the average: what a quarter more samples would bring (docs/background/denoising.md).
HIGH_FROM = 100.0
#: What one run of the network costs, in rays per pixel.
RUN_COST: dict[Effort, float] = {"fast": 3.0, "high": 15.0}
#: How strongly light that differs is kept apart where micro-images share it, by how much noise there is left to share.
#: Between 30 and 200 it moves the PSNR of the bundled scenes by less than 0.5 dB (docs/research/pooled-light.md).
SHARING_STOP: dict[Effort, float] = {"fast": 40.0, "high": 100.0}
#: What a sample of the guides costs, in rays.
GUIDE_COST = 0.4
#: Samples of a pixel for the guides: more of them gain 0.1 to 0.4 dB with either effort.
GUIDE_SAMPLES: dict[Effort, int] = {"fast": 8, "high": 16}


def traced_work(primary: float, shadow: float, secondary: float) -> float:
    """What rays by their kinds cost together, in rays."""
    return primary + secondary + SHADOW_COST * shadow


def effort_of(denoise: Denoiser, rays_per_pixel: float) -> Effort:
    """The effort that the user's word names, or that so many traced rays deserve where it names none."""
    if denoise == "oidn-fast":
        return "fast"
    if denoise == "oidn-high":
        return "high"
    return "high" if rays_per_pixel >= HIGH_FROM else "fast"


def denoising_cost(effort: Effort) -> float:
    """Rays per pixel that are worth a picture cleaned by halves, guides included."""
    return 2 * RUN_COST[effort] + GUIDE_COST * GUIDE_SAMPLES[effort]
