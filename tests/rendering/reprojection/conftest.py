"""A world that needs no engine: flat things parallel to the lens plane, traced with plain formulas."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest


@dataclass
class Sheet:
    """A flat thing at height ``z`` (mm), where ``inside(x, y)``, in the colours ``color(x, y) -> (n, 3)``."""

    z: float
    color: object
    inside: object = lambda x, y: np.full(np.shape(x), True)
    mirror: bool = False


@dataclass
class FlatTracer:
    """Stands in for the tracer of pixels: same call, same entries. ``calls`` keeps the lists of pixels."""

    display: object
    sheets: list
    sky: tuple = (0.1, 0.2, 0.6)
    calls: list = field(default_factory=list)

    def trace(self, numbers, points):
        from lippmann.rendering.reprojection.point_image import BACKGROUND, TRACED

        display = self.display
        self.calls.append(np.array(numbers))
        row, column = np.divmod(np.asarray(numbers, dtype=np.int64), display.panel.width)
        assert len(np.unique(numbers)) == len(numbers), "a pixel is traced twice in one list"
        (ox, oy, oz), (dx, dy, dz) = display.light_ray(*display.panel_point(column + 0.5, row + 0.5))
        color = np.tile(np.asarray(self.sky, dtype=float), (len(row), 1))
        disparity = np.full(len(row), BACKGROUND)
        fragile = np.zeros(len(row), dtype=bool)
        for sheet in sorted(self.sheets, key=lambda sheet: sheet.z):
            t = (sheet.z - oz) / dz
            x, y = ox + t * dx, oy + t * dy
            hit = sheet.inside(x, y)
            colors = sheet.color(dx / dz, dy / dz) if sheet.mirror else sheet.color(x, y)
            color[hit] = np.asarray(colors)[hit]
            disparity[hit] = display.gap / sheet.z
            fragile[hit] = sheet.mirror
        points.color[row, column] = color
        points.disparity[row, column] = disparity
        points.fragile[row, column] = fragile
        points.status[row, column] = TRACED

    @property
    def traced(self):
        """All pixels traced so far."""
        return np.concatenate(self.calls) if self.calls else np.empty(0, dtype=int)

    def full(self):
        """The whole picture traced."""
        from lippmann.rendering.reprojection.point_image import PointImage

        height, width = self.display.panel.height, self.display.panel.width
        points = PointImage.empty(height, width)
        FlatTracer(self.display, self.sheets, self.sky).trace(np.arange(height * width), points)
        return points


@pytest.fixture
def sheet():
    """Makes a flat thing."""
    return Sheet


@pytest.fixture
def flat_tracer():
    """Makes a tracer of flat things in front of a display."""
    return FlatTracer
