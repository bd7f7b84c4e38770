"""Chains of sharp events that each path of a picture comes with: a fixed number, or none.

A denoiser takes highlights for noise, so a denoised picture shows seen light by chains wherever the scene has mirrors,
clear glass or smooth gloss (docs/research/seen-light.md).
"""

from __future__ import annotations

import numpy as np

from lippmann.device.types import MitsubaScene
from lippmann.rendering.request.choices import REUSING
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.transport.casters import has_sharp_surfaces

#: Chains of a path.
CHAINS = 4
#: Variance of a path's light in codes: of usual scenes, and where a denoiser takes most of it away.
REST_VARIANCE, CLEAN_REST_VARIANCE = 0.01, 0.001
#: Samples that a picture is taken to need at most, and at least, of which it is not known.
OPEN_ENDED, FEWEST_OPEN_ENDED = 128, 8


def count_chains(scene: MitsubaScene, request: RenderRequest) -> int:
    """Chains of each path: :data:`CHAINS` in denoised pictures of sharp surfaces, else 0.

    None where all rays of a pixel are one, or its points are taken from others: further chains show nothing then.
    """
    is_denoised = request.denoise != "none" and request.box_filter and request.method not in REUSING
    return CHAINS if is_denoised and has_sharp_surfaces(scene) else 0


def expected_samples(request: RenderRequest) -> int:
    """Samples of a pixel that the picture will take, about.

    The worst micro-image is that of a rare highlight, as a rule: where it is to be good, no few samples are counted on.
    """
    if not request.is_open_ended:
        return request.samples
    if request.quality is None or request.quality_worst is not None:
        return OPEN_ENDED
    rest = REST_VARIANCE if request.denoise == "none" else CLEAN_REST_VARIANCE
    return int(np.clip(rest * 10 ** (request.quality / 10), FEWEST_OPEN_ENDED, OPEN_ENDED))
