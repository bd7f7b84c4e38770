"""Tiles that are rendered with their surroundings: on a cluster the same as here."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytest.importorskip("distributed")

DISPLAY = """name = "small"
gap = 6.8
aperture_distance = 10.0
[panel]
width = 256
height = 256
pixel_pitch = 0.25
[lens_array]
layout = "lenticular"
pitch = 2.0
"""


@pytest.mark.long
def test_the_same_bytes_as_here(tmp_path):
    (tmp_path / "small.toml").write_text(DISPLAY)
    pictures = []
    for name, more in (("here.exr", ("--resume",)), ("there.exr", ("--cluster", "local:1"))):
        words = ("render", "teapot", "-d", tmp_path / "small.toml", "--integrator", "direct", "--spp", "2", "--quiet")
        options = ("--method", "pooled", "--denoise", "oidn", *more, "--threads", "1", "-o", tmp_path / name)
        program = (sys.executable, "-c", "from lippmann.cli import main; main()")
        subprocess.run([str(word) for word in (*program, *words, *options)], check=True)
        pictures.append((tmp_path / name).read_bytes())
    assert pictures[0] == pictures[1]
