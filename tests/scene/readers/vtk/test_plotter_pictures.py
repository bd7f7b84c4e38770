"""Plotters are shown as their own windows show them: every pixel of an unlit picture, held against VTK's."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from lippmann import api
from lippmann.color.transfer import encode_srgb

pytest.importorskip("pyvista", reason="PyVista is not installed")

from .plotters import NAMES, SIZE, make


@pytest.fixture(scope="module")
def windows(tmp_path_factory):
    """Pictures of VTK's own, from a process of their own: without graphics it may end it."""
    path = tmp_path_factory.mktemp("windows") / "pictures.npz"
    code = [sys.executable, str(Path(__file__).with_name("plotters.py")), str(path)]
    done = subprocess.run(code, capture_output=True, text=True, check=False, timeout=120)
    if done.returncode or not path.exists():
        pytest.skip(f"VTK draws nothing here: {done.stderr.strip()[-200:]}")
    with np.load(path) as pictures:
        return dict(pictures)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_pictures_are_those_of_the_plotter(engine, windows, name):
    plotter = make(name)
    try:
        seen = api.preview(plotter, size=SIZE, camera="plotter", spp=1, pixel_filter="point", tone_map="none")
    finally:
        plotter.close()
    codes = np.round(255 * encode_srgb(np.clip(seen.pixels, 0, 1)))
    off = np.abs(codes - windows[name]).max(axis=-1) > 2
    assert windows[name].any(axis=-1).mean() > 0.15
    assert off.sum() < 10  # of 6912: rounding at outlines
