"""What follows from the words of a request alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.rendering.request.render_request import RenderRequest


@pytest.mark.parametrize(
    ("kind", "name", "bits", "expected"),
    [
        ("auto", "a.png", None, "auto"),
        ("auto", "frames", None, "auto"),
        ("auto", "a.EXR", None, "none"),
        ("auto", "a.exr", 16, "none"),
        ("auto", "print.tif", None, "auto"),
        ("auto", "a.tif", 16, "auto"),
        ("auto", "a.tif", 32, "none"),
        ("auto", "a.zarr", None, "auto"),
        ("auto", "a.zarr", 32, "none"),
        ("pbr-neutral", "a.exr", None, "pbr-neutral"),
        ("none", "a.png", None, "none"),
    ],
)
def test_linear_light_stays_unless_a_curve_is_named(kind, name, bits, expected):
    assert RenderRequest(tone_map=kind).for_file(Path(name), bits).tone_map == expected
