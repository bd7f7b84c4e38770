"""Codes of live pictures are those of their light, pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.color.transfer import quantize
from lippmann.display import Display, LensArray, Panel
from lippmann.display.visible_pixels import EyeMap
from lippmann.rendering.live.develop import develop
from lippmann.rendering.request.render_request import RenderRequest


@pytest.mark.parametrize("tone_map", ["none", "pbr-neutral"])
@pytest.mark.parametrize("subpixels", [False, True])
def test_codes_are_those_of_the_pictures_light_and_black_beside_the_panel(subpixels, tone_map):
    display = Display("slanted", Panel(90, 60, 0.5), LensArray("lenticular", 2.3, 12.0), 3.0, "", 400.0, 20.0)
    pixels = EyeMap(display, (50, 40), subpixels=subpixels).pixels_for_eye((300.0, 0.0, 300.0))
    assert (pixels.number < 0).any()
    request = RenderRequest(tone_map=tone_map)
    values = np.random.default_rng(2).uniform(0, 1.5, (len(pixels.column), 3)).astype(np.float32)
    codes = develop(values, pixels, request)
    # A tone map mixes colours: beside the panel's edge it lights those that no sub-pixel shows.
    is_seen = np.broadcast_to(pixels.number >= 0, codes.shape)
    expected = np.where(is_seen, quantize(request.tone_mapped(pixels.arrange(values)), 8, "srgb"), 0)
    assert np.abs(codes.astype(int) - expected).max() <= 1
    assert (codes == expected).mean() > 0.98
