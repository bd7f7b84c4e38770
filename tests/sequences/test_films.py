"""Films of quilts: what is told of them before the first frame, and frames that are not read from their files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lippmann.display import load_display
from lippmann.image.metadata import Provenance
from lippmann.quilts.quilt import Quilt, QuiltLayout, quilt_of_display
from lippmann.sequences.files import SavedFrame
from lippmann.sequences.films import film_quilts
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
    told = film_quilts(Path(film), device, form, None, 2, codec=codec).note
    assert told is None if note is None else note in told


@pytest.mark.parametrize("ending", [".png", ".exr", ".tif"])
@pytest.mark.parametrize("bits", [8, 16, 32])
@pytest.mark.parametrize("film", ["a_qs3x2a0.75.mp4", "a.mp4"])
def test_a_frame_in_memory_gives_the_codes_of_its_file(tmp_path, monkeypatch, ending, bits, film):
    if (ending, bits) in ((".png", 32), (".exr", 8)):
        pytest.skip("the format has no such bits")
    device = load_display("portrait")
    form = QuiltForm(quilt_of_display(device, (3, 2), (300, 262)))
    pixels = np.random.default_rng(0).uniform(-0.1, 1.2, (262, 300, 3)).astype(np.float32)
    path = tmp_path / f"0001_qs3x2a0.75{ending}"
    rendered = Quilt(pixels, QuiltLayout(3, 2, 0.7501), provenance=Provenance(transfer="linear"))
    frame = SavedFrame(1, path, Provenance(), quilt=form.write(rendered, path, bits))
    codes = film_quilts(Path(film), device, form, None, 2).codes
    of_file = codes(replace(frame, quilt=None))
    monkeypatch.setattr("lippmann.sequences.films.read_quilt", None)
    np.testing.assert_array_equal(codes(frame), of_file)
