"""Small displays of every layout, and pictures whose display codes are known."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel
from lippmann.image import IntegralImage, Provenance

LAYOUTS = {
    "lenticular": {"layout": "lenticular", "pitch": 2.0},
    "slanted": {"layout": "lenticular", "pitch": 2.3, "slant": 9.46},
    "square": {"layout": "square", "pitch": 2.0},
    "hexagonal": {"layout": "hexagonal", "pitch": 2.5},
}


def make_display(kind="lenticular", width=64, height=32, name="test"):
    """Lenses of about eight pixels of 0.25 mm."""
    return Display(name=name, panel=Panel(width, height, 0.25), lens_array=LensArray(**LAYOUTS[kind]), gap=6.8)


def make_picture(display, values, transfer="linear", **parts):
    """``values`` (anything that fits ``(H, W, 3)``) are the display codes in [0, 1], unless ``transfer`` is sRGB."""
    panel = display.panel
    pixels = np.broadcast_to(np.asarray(values, dtype=np.float32), (panel.height, panel.width, 3)).copy()
    return IntegralImage(pixels, display, provenance=Provenance(transfer=transfer), **parts)


@pytest.fixture(scope="session")
def display():
    """``display(kind, width, height, name)``."""
    return make_display


@pytest.fixture(scope="session")
def picture():
    """``picture(display, codes, transfer, ...)``."""
    return make_picture


@pytest.fixture(params=sorted(LAYOUTS))
def any_display(request):
    return make_display(request.param)
