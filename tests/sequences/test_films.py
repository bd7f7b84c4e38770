"""Films of quilts: what is told of them before the first frame."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.display import load_display
from lippmann.quilts.quilt import quilt_of_display
from lippmann.sequences.films import film_of_quilts
from lippmann.sequences.forms import QuiltForm


@pytest.mark.parametrize(
    ("display", "film", "size", "codec", "note"),
    [
        ("lume-pad", "a_2x1.mp4", None, "h264", "pictures are 4096x1280 pixels, smaller than 5120x1600: h264 takes"),
        ("lume-pad", "a_2x1.mp4", None, None, None),
        ("portrait", "a_qs8x6a0.75.mp4", None, "h264", None),
        ("portrait", "a_qs8x6a0.75.mp4", (9600, 9600), None, "8192x8190 pixels, smaller than 9600x9600: hevc takes"),
        ("portrait", "a_qs8x6a0.75.apng", (9600, 9600), None, None),
        ("go", "a_qs11x6a0.5625.mp4", (803, 606), None, "792x606 pixels, smaller than 803x606: h264 takes even sides"),
        ("go", "a_qs11x6a0.5625.mp4", (803, 606), "h264-rgb", None),
    ],
)
def test_a_film_that_is_made_smaller_says_so(display, film, size, codec, note):
    device = load_display(display)
    form = QuiltForm(quilt_of_display(device, size=size))
    told = film_of_quilts(Path(film), device, form, None, 2, codec=codec).note
    assert told is None if note is None else note in told
