"""Monitors to calibrate."""

from __future__ import annotations

import math

import pytest

from lippmann.display.formats.monitor import Monitor
from lippmann.display.panel import RGB_STRIPE, Panel

#: Two kinds of pixels, as on newer panels, and a stripe that runs the other way.
CELLS = (
    (((-0.3, 0.1), (0.0, -0.2), (0.3, 0.1)), ((-0.25, -0.2), (0.05, 0.15), (0.35, -0.2))),
    (((-0.25, -0.2), (0.05, 0.15), (0.35, -0.2)), ((-0.3, 0.1), (0.0, -0.2), (0.3, 0.1))),
    (((-0.2, 0.0), (0.1, 0.0), (0.4, 0.0)), ((-0.2, 0.1), (0.1, 0.1), (0.4, 0.1))),
)
SIZE = (230, 170)

MONITORS = {
    "slanted": Monitor("slanted", Panel(*SIZE, 0.0903, RGB_STRIPE), 45.61, -6.137, 0.3713),
    "other way": Monitor("other", Panel(*SIZE, 0.0903, RGB_STRIPE[::-1]), 57.31, 2.713, 0.9),
    "upright": Monitor("upright", Panel(*SIZE, 0.0911, RGB_STRIPE), 41.37, math.inf, 0.0133),
    "cells": Monitor("cells", Panel(*SIZE, 0.0783, RGB_STRIPE, CELLS), 52.58, -7.145, 0.42),
}


@pytest.fixture(params=MONITORS)
def monitor(request):
    """Each of the monitors in turn."""
    return MONITORS[request.param]


@pytest.fixture
def slanted():
    """A slanted monitor with a plain stripe."""
    return MONITORS["slanted"]
