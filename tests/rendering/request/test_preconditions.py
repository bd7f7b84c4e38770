"""Options that do not go together are refused by name, before anything is loaded."""

from __future__ import annotations

import pytest

from lippmann.display import load_display
from lippmann.errors import PictureError, UsageError
from lippmann.rendering.request.preconditions import MOST_SUBPIXELS, check
from lippmann.rendering.request.render_request import RenderRequest

SHEET = load_display("seed-lenticular")
#: A resolved request that every form can honour.
PLAIN = {"method": "full", "integrator": "path", "pixel_filter": "box", "denoise": "none"}


@pytest.mark.parametrize(
    ("options", "parameter"),
    [
        ({"order": "paper"}, "order"),
        ({"respect_gloss": True}, "respect_gloss"),
        ({"respect_gloss": False}, "respect_gloss"),
        ({"method": "lens-view", "order": "paper", "respect_gloss": True}, "respect_gloss"),
        ({"method": "lens-view", "subpixels": True}, "subpixels"),
        ({"method": "interpolated", "integrator": "normal"}, "integrator"),
        ({"method": "pooled"}, "denoise"),
        ({"method": "pooled", "denoise": "oidn", "integrator": "classic"}, "integrator"),
        ({"denoise": "oidn", "integrator": "depth"}, "denoise"),
        ({"method": "lens-view", "quality_worst": 30.0}, "quality_worst"),
        ({"method": "interpolated", "max_time": 3.0}, "max_time"),
        ({"quality": 30.0, "spp": 1}, "spp"),
        ({"quality": 30.0, "integrator": "normal", "pixel_filter": "point"}, "quality"),
    ],
)
def test_what_does_not_go_together_is_refused(options, parameter):
    with pytest.raises(UsageError) as caught:
        check(RenderRequest(**PLAIN | options), "picture", SHEET)
    assert caught.value.parameter == parameter


@pytest.mark.parametrize("form", ["picture", "tiles", "quilt", "forecast", "preview"])
def test_every_form_honours_a_plain_request(form):
    check(RenderRequest(**PLAIN), form, None if form == "preview" else SHEET)


@pytest.mark.parametrize(
    ("options", "parameter"),
    [
        ({"method": "lens-view"}, "method"),
        ({"order": "paper"}, "order"),
        ({"quality_worst": 40.0}, "quality_worst"),
        ({"quality": 40.0}, "quality"),
        ({"max_time": 4.0}, "max_time"),
        ({"layers": True}, "layers"),
    ],
)
def test_tiles_refuse_what_needs_the_whole_picture(options, parameter):
    with pytest.raises(UsageError, match="needs the whole picture") as caught:
        check(RenderRequest(**PLAIN | options), "tiles", SHEET)
    assert caught.value.parameter == parameter


def test_sub_pixels_are_numbered_in_32_bits():
    side = 1 << 15
    largest = SHEET.resized(side, MOST_SUBPIXELS // side // 3)
    check(RenderRequest(**PLAIN, subpixels=True), "tiles", largest)
    with pytest.raises(UsageError, match=r"fewer than 4294967296 \(sub-\)pixels"):
        check(RenderRequest(**PLAIN), "tiles", SHEET.resized(1 << 16, 1 << 16))


@pytest.mark.parametrize(
    ("options", "parameter"),
    [({"method": "lens-view"}, "method"), ({"subpixels": True}, "subpixels"), ({"layers": True}, "layers")],
)
def test_quilts_refuse_what_is_not_theirs(options, parameter):
    with pytest.raises(UsageError, match="is not possible in a quilt") as caught:
        check(RenderRequest(**PLAIN | options), "quilt", SHEET)
    assert caught.value.parameter == parameter


def test_quilts_are_for_cylinders():
    with pytest.raises(PictureError, match="has square lenses"):
        check(RenderRequest(**PLAIN), "quilt", load_display("mla-square"))
