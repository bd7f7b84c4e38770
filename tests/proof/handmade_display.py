"""Displays worked out from the definitions, by trying all lenses: nothing here asks the display's own formulas."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

#: Millimetres in front of the lens plane at which rays begin.
APERTURE = 60.0


@dataclass(frozen=True)
class Sheet:
    """A display in numbers, mm: ``across`` (and ``down``) pixels from lens to lens, counted along the panel."""

    layout: str
    across: float
    width: int
    height: int
    down: float = math.inf
    distance: float = math.inf
    tangent: float = 0.0
    pixel: float = 0.5
    gap: float = 10.0

    @property
    def stretch(self):
        """Size of a micro-image over that of its lens."""
        return 1 + self.gap / self.distance

    @property
    def pitch(self):
        return self.across * self.pixel / self.stretch * math.cos(math.atan(self.tangent))

    @property
    def row_pitch(self):
        return self.down * self.pixel / self.stretch

    def display(self):
        from lippmann.display import Display, LensArray, Panel

        slant = math.degrees(math.atan(self.tangent))
        lenses = {
            "lenticular": lambda: LensArray("lenticular", self.pitch, slant=slant),
            "square": lambda: LensArray("square", self.pitch),
            "hexagonal": lambda: LensArray("hexagonal", self.pitch, row_pitch=self.row_pitch, offset=(0.0, 0.0)),
        }[self.layout]()
        panel = Panel(self.width, self.height, self.pixel)
        return Display("proof", panel, lenses, self.gap, viewing_distance=self.distance, aperture_distance=APERTURE)

    def centers(self):
        """``(n, 2)`` lens centres, more than the panel needs; of a lenticular sheet x is across, y is 0."""
        reach = math.ceil(self.width / self.across) + 1
        i = np.arange(-reach, reach + 1)
        # Whole lenses tile the panel; a slanted sheet and a hexagonal array here have a lens in the very middle.
        first = 0.5 if self.tangent == 0 and self.width / self.across % 2 == 0 else 0.0
        if self.layout == "lenticular":
            return np.stack([(i + first) * self.pitch, 0.0 * i], axis=-1)
        reach = math.ceil(self.height / self.down) + 1
        j = np.arange(-reach, reach + 1)
        if self.layout == "square":
            x, y = np.meshgrid(i + first, j + (0.5 if self.height / self.down % 2 == 0 else 0.0))
        else:
            x, y = np.meshgrid(i, j)
            x = x + 0.5 * (y % 2)
        return np.stack([x * self.pitch, y * self.row_pitch], axis=-1).reshape(-1, 2)

    def to_axes(self, points):
        """Coordinates across and along slanted lenses."""
        cos, sin = math.cos(math.atan(self.tangent)), math.sin(math.atan(self.tangent))
        x, y = points[..., 0], points[..., 1]
        return np.stack([x * cos - y * sin, x * sin + y * cos], axis=-1)

    def from_axes(self, points):
        return replace(self, tangent=-self.tangent).to_axes(points)

    def nearest_lens(self, points):
        """``(n, 2)`` centre of the lens that holds each point of the lens plane, and ``(n,)`` whether that is clear."""
        centers = self.centers()
        if self.layout == "lenticular":
            points = self.to_axes(points) * [1.0, 0.0]
        distances, nearest = cKDTree(centers).query(points, k=2)
        return centers[nearest[:, 0]], distances[:, 1] - distances[:, 0] > 1e-6


@dataclass
class Samples:
    """What an eye sees, worked out by hand.

    ``points`` ``(n, 2)``: where the recorded lines meet the lens plane; ``viewpoints`` ``(n, 2)``: the camera that sees
    the same, as x, y at the viewing distance, or as the slopes dx/dz, dy/dz of a direction. ``clear`` is False past the
    panel, and where a line between two lenses decides; ``own`` says if the pixel belongs to the lens looked at.
    """

    points: np.ndarray
    viewpoints: np.ndarray
    clear: np.ndarray
    own: np.ndarray


def lens_plane_points(sheet, width, height):
    """``(n, 2)`` places of the pixels of a replayed picture, whose frame is the panel's own, row by row."""
    w, h = sheet.width * sheet.pixel, sheet.height * sheet.pixel
    x, y = (np.arange(width) + 0.5) / width * w - w / 2, h / 2 - (np.arange(height) + 0.5) / height * h
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def samples_of(sheet, points, eye, offset=(0.0, 0.0)):
    """What an eye at ``eye`` sees when it looks at ``points``; ``offset`` is that of the sub-pixel, right and down."""
    lens, clear = sheet.nearest_lens(points)
    looked_at = lens
    if sheet.layout == "lenticular":
        along = sheet.to_axes(points)[:, 1]
        looked_at = sheet.from_axes(np.stack([lens[:, 0], along], axis=-1))
    seen = looked_at + (looked_at - np.array(eye[:2])) * (sheet.gap / eye[2])
    # The (sub-)pixel there; on a line between two it is the right or lower one.
    column = np.floor(seen[:, 0] / sheet.pixel + sheet.width / 2 - offset[0] + 1e-6)
    row = np.floor(sheet.height / 2 - seen[:, 1] / sheet.pixel - offset[1] + 1e-6)
    inside = (column >= 0) & (column < sheet.width) & (row >= 0) & (row < sheet.height)
    x = (column + 0.5 + offset[0] - sheet.width / 2) * sheet.pixel
    y = (sheet.height / 2 - row - 0.5 - offset[1]) * sheet.pixel
    pixel = np.stack([x, y], axis=-1)
    # The line that it recorded.
    owner, owner_clear = sheet.nearest_lens(pixel / sheet.stretch)
    own = inside & (np.abs(owner - lens).max(axis=1) < 1e-6)
    if sheet.layout == "lenticular":
        across, along = sheet.to_axes(pixel).T
        slope = sheet.from_axes(np.stack([(owner[:, 0] - across) / sheet.gap, 0 * along], axis=-1))
        level = sheet.from_axes(owner)
        point = sheet.from_axes(np.stack([owner[:, 0], along / sheet.stretch], axis=-1))
    else:
        slope = (owner - pixel) / sheet.gap
        level = point = owner
    viewpoint = slope if math.isinf(sheet.distance) else level + slope * sheet.distance
    return Samples(point, viewpoint, inside & clear & owner_clear, own)
