"""Chains of sharp events that each path of a picture comes with: a fixed number, or none.

A denoiser takes highlights for noise, so a denoised picture shows seen light by chains wherever the scene has mirrors,
clear glass or smooth gloss (docs/research/seen-light.md).
"""

from __future__ import annotations

from lippmann.device.types import MitsubaScene
from lippmann.options.choices import REUSING
from lippmann.rendering.preparation.tuning import TUNING
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.transport.casters import has_sharp_surfaces


def count_chains(scene: MitsubaScene, request: RenderRequest) -> int:
    """Chains of each path: as many as ``TUNING`` has for denoised pictures of sharp surfaces, else 0.

    None where all rays of a pixel are one, or its points are taken from others: further chains show nothing then.
    """
    is_denoised = request.denoise != "none" and request.box_filter and request.method not in REUSING
    return TUNING.chains if is_denoised and has_sharp_surfaces(scene) else 0
