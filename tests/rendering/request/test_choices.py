"""What follows from the words of a request alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.rendering.request.render_request import RenderRequest


@pytest.mark.parametrize(
    ("kind", "name", "expected"),
    [
        ("auto", "a.png", "auto"),
        ("auto", "frames", "auto"),
        ("auto", "a.EXR", "none"),
        ("auto", "a.tif", "none"),
        ("auto", "a.zarr", "none"),
        ("pbr-neutral", "a.exr", "pbr-neutral"),
        ("none", "a.png", "none"),
    ],
)
def test_files_for_data_keep_light_unless_a_curve_is_named(kind, name, expected):
    assert RenderRequest(tone_map=kind).for_file(Path(name)).tone_map == expected
