"""Settings that do not go together are refused by name, before anything is loaded."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lippmann.display import load_display
from lippmann.errors import UsageError
from lippmann.rendering.request.settings import RenderSettings


@pytest.mark.parametrize(
    ("options", "where"),
    [
        ({"order": "paper"}, "--order"),
        ({"respect_gloss": True}, "--respect-gloss"),
        ({"respect_gloss": False}, "--respect-gloss"),
        ({"method": "lens-view", "order": "paper", "respect_gloss": True}, "--respect-gloss"),
        ({"method": "lens-view", "subpixels": True}, "--subpixels"),
        ({"method": "interpolated", "integrator": "normal"}, "--integrator"),
        ({"method": "lens-view", "order": "backwards"}, "--order"),
        ({"method": "lensview"}, "--method"),
        ({"method": "pooled"}, "--denoise"),
    ],
)
def test_what_does_not_go_together_is_refused(options, where):
    with pytest.raises(UsageError) as caught:
        RenderSettings(**options)
    assert caught.value.where == where


@pytest.mark.parametrize(
    ("options", "careful"),
    [
        ({}, True),
        ({"order": "default"}, True),
        ({"order": "paper"}, False),
        ({"respect_gloss": False}, False),
        ({"order": "default", "respect_gloss": True}, True),
        ({"order": "paper", "respect_gloss": False}, False),
    ],
)
def test_gloss_is_respected_by_default_but_in_the_papers_order(options, careful):
    assert RenderSettings(method="lens-view", **options).careful is careful


def test_sub_pixels_keep_their_colours_for_a_denoiser():
    pooled, sheet = RenderSettings(method="pooled", denoise="oidn", subpixels=True), load_display("seed-lenticular")
    assert pooled.keeps_colors(sheet)
    assert replace(pooled, method="full", denoise="auto").keeps_colors(sheet)
    assert replace(pooled, denoise="auto").keeps_colors(sheet)
    for other in ({"method": "full", "denoise": "none"}, {"subpixels": False}):
        assert not replace(pooled, **other).keeps_colors(sheet)
    assert not pooled.keeps_colors(load_display("mla-square"))
