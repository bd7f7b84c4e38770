"""What a render can be asked for."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lippmann.display import load_display
from lippmann.errors import UsageError
from lippmann.rendering.request.render_request import RenderRequest


@pytest.mark.parametrize(
    ("options", "parameter"),
    [
        ({"method": "lensview"}, "method"),
        ({"order": "backwards"}, "order"),
        ({"integrator": "photon"}, "integrator"),
        ({"pixel_filter": "gauss"}, "pixel_filter"),
        ({"denoise": "yes"}, "denoise"),
        ({"device": "tpu"}, "device"),
        ({"depth": 0}, "depth"),
        ({"spp": 2**24 + 1}, "spp"),
        ({"spp": True}, "spp"),
        ({"seed": None}, "seed"),
        ({"seed": 2**32}, "seed"),
        ({"threads": 1.5}, "threads"),
        ({"memory": 0}, "memory"),
        ({"quality_worst": 81.0}, "quality_worst"),
        ({"quality": 0.0}, "quality"),
        ({"max_time": float("inf")}, "max_time"),
        ({"max_time": float("nan")}, "max_time"),
        ({"quality": "high"}, "quality"),
        ({"quality": True}, "quality"),
        ({"max_time": "soon"}, "max_time"),
        ({"clamp_indirect": "off"}, "clamp_indirect"),
        ({"exposure": "bright"}, "exposure"),
        ({"exposure": 41}, "exposure"),
        ({"subpixels": "yes"}, "subpixels"),
        ({"layers": "depth"}, "layers"),
        ({"placement": "fit"}, "placement"),
        ({"method": ["full"]}, "method"),
        ({"effort": "lazy"}, "effort"),
        ({"effort": "draft", "spp": 1}, "spp"),
        ({"effort": "draft", "quality": 30.0}, "quality"),
        ({"effort": "draft", "quality_worst": 30.0}, "quality_worst"),
        ({"effort": "draft", "max_time": 5.0}, "max_time"),
    ],
)
def test_values_are_checked_one_by_one(options, parameter):
    with pytest.raises(UsageError) as caught:
        RenderRequest(**options)
    assert caught.value.parameter == parameter


def test_keyword_arguments_are_those_of_a_request():
    assert RenderRequest.of({"spp": 3, "denoise": "none"}) == RenderRequest(spp=3, denoise="none")
    with pytest.raises(UsageError, match=r"unknown option of a render 'samples'.*; known are integrator, "):
        RenderRequest.of({"samples": 3})
    with pytest.raises(UsageError, match="unknown option of a render 'denoiser', did you mean 'denoise'"):
        RenderRequest.of({"denoiser": "none"})
    with pytest.raises(UsageError, match="'reason'"):
        RenderRequest.of({"reason": "because"})


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
    assert RenderRequest(method="lens-view", **options).careful is careful


def test_sub_pixels_keep_their_colours_for_a_denoiser():
    pooled, sheet = RenderRequest(method="pooled", denoise="oidn", subpixels=True), load_display("seed-lenticular")
    assert pooled.keeps_colors(sheet)
    assert replace(pooled, method="full", denoise="auto").keeps_colors(sheet)
    assert replace(pooled, denoise="auto").keeps_colors(sheet)
    for other in ({"method": "full", "denoise": "none"}, {"subpixels": False}):
        assert not replace(pooled, **other).keeps_colors(sheet)
    assert not pooled.keeps_colors(load_display("mla-square"))
