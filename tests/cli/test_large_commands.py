"""Commands do the same to pictures that they read piece by piece."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.codecs import tiff
from lippmann.display import load_display
from lippmann.image import IntegralImage, streamed
from lippmann.image.write import write_plain_picture


@pytest.fixture
def pair(tmp_path):
    """Two pictures of one display that differ a little."""
    display = load_display("seed-lenticular").resized(64, 48)
    rng = np.random.default_rng(0)
    first = rng.random((48, 64, 3), dtype=np.float32)
    for name, pixels in (("a.tif", first), ("b.tif", np.clip(first + 0.05, 0, 1))):
        IntegralImage(pixels, display).save(tmp_path / name, bits=16)
    return tmp_path / "a.tif", tmp_path / "b.tif"


def content(path):
    files = path.rglob("*") if path.is_dir() else [path]
    return {file.relative_to(path).as_posix(): file.read_bytes() for file in files if file.is_file()}


def test_an_error_map_needs_the_whole_picture(lippmann, pair, tmp_path, monkeypatch):
    monkeypatch.setattr(streamed, "LARGE", 0)
    done = lippmann("compare", *pair, "--map", tmp_path / "map.png")
    assert done.code == 2
    assert "--map: needs pictures that fit in memory" in done.err


def test_weaving_for_a_large_panel(lippmann, tmp_path, monkeypatch):
    write_plain_picture(np.full((512, 512, 3), 0.5, np.float32), tmp_path / "q_qs4x2.png")
    monkeypatch.setattr(tiff, "TILED_FROM", 0)
    display = tmp_path / "d.toml"
    text = "[panel]\nwidth = 60\nheight = 40\npixel_pitch = 0.25\n[lens_array]\nlayout = 'lenticular'\npitch = 2.5\n"
    display.write_text('name = "d"\ngap = 6.8\naperture_distance = 10.0\n' + text)
    for limit, name in ((0, "pieces.tif"), (1 << 25, "whole.tif")):
        monkeypatch.setattr(streamed, "LARGE", limit)
        assert lippmann("weave", tmp_path / "q_qs4x2.png", "-d", display, "-o", tmp_path / name).code == 0
    assert content(tmp_path / "pieces.tif") == content(tmp_path / "whole.tif")
