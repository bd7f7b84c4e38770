"""Lenses or cameras beside a ray, and the pixel in which each of them shows a point, or the nearest that it can."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple, Protocol

from lippmann.display.array_ops import Array, ArrayOps
from lippmann.display.display import Display
from lippmann.display.micro_image_layout import micro_image_extent
from lippmann.display.panel import PixelWindow
from lippmann.display.view_cone import cone_tangent

Point = tuple[Array, Array, Array]

#: Pixels that are no distance.
_CLOSE = 1e-3


class Place(NamedTuple):
    """Continuous pixel coordinates in a picture, to the right and downwards, and the rectangle of the pixels that
    belong to the same view: ``left <= column < right``, ``top <= row < bottom``.

    ``across`` and ``down`` lead from there to the point itself, in pixels. ``weight`` falls with them, so that the
    weighted mean of the points shown is that point if it lies between them; that of ``across`` and ``down`` is 0 then.
    """

    u: Array
    v: Array
    left: Array
    top: Array
    right: Array
    bottom: Array
    across: Array
    down: Array
    weight: Array


class NearbyViews(Protocol):
    """The views of a picture."""

    @property
    def display(self) -> Display:
        """The display that shows them, or whose cameras see them."""
        ...

    def places(self, x: Array, y: Array, slope: Array, point: Point, ops: ArrayOps) -> Iterator[Place]:
        """Places of a point in the views on either side of a ray.

        The ray meets the lens plane at ``(x, y)`` mm and goes ``slope`` to the right for each unit away from the
        viewer; the point is in mm of the display's frame.
        """
        ...


@dataclass(frozen=True)
class LensViews:
    """Micro-images of a display: the one that holds a ray, and those on the nearer side of its lens's centre.

    Parameters
    ----------
    display:
        The display.
    window:
        Its part that the picture shows.
    """

    display: Display
    window: PixelWindow

    def places(self, x: Array, y: Array, slope: Array, point: Point, ops: ArrayOps) -> Iterator[Place]:
        """As :meth:`NearbyViews.places`: two micro-images, of arrays four."""
        lattice = self.display.lattice
        center_x, center_y = lattice.center(*lattice.lens_at(x, y, ops), x, y, ops)
        right = ops.where(x >= center_x, lattice.pitch, -lattice.pitch)
        is_array = lattice.layout != "lenticular"
        up = ops.where(y >= center_y, lattice.row_pitch, -lattice.row_pitch) if is_array else 0.0
        for across, along in product((0, 1), (0, 1) if is_array else (0,)):
            yield self._place(point, *lattice.lens_at(x + across * right, y + along * up, ops), ops)

    def _place(self, point: Point, i: Array, j: Array, ops: ArrayOps) -> Place:
        display, window = self.display, self.window
        x, y = display.project(*point, i, j, ops)
        u, v = display.pixel_coordinates(x, y)
        scale = display.magnification
        center_x, center_y = display.lattice.center(i, j, x / scale, y / scale, ops)
        middle = display.pixel_coordinates(center_x * scale, center_y * scale)
        half_width, half_height = (side / 2 - 0.5 for side in micro_image_extent(display))
        near_u = ops.minimum(ops.maximum(u, middle[0] - half_width), middle[0] + half_width)
        near_v = v
        if display.lens_array.layout != "lenticular":
            near_v = ops.minimum(ops.maximum(v, middle[1] - half_height), middle[1] + half_height)
        across, down = u - near_u, v - near_v
        weight = 1 / (abs(across) + abs(down) + _CLOSE)
        return Place(near_u - window.left, near_v - window.top, 0, 0, window.width, window.height, across, down, weight)


@dataclass(frozen=True)
class CameraViews:
    """Views of a quilt's cameras; parameters as of :class:`~lippmann.rendering.transport.ray_source.QuiltRays`."""

    display: Display
    columns: int
    rows: int
    view_size: tuple[int, int]
    window: PixelWindow

    def places(self, x: Array, y: Array, slope: Array, point: Point, ops: ArrayOps) -> Iterator[Place]:
        """As :meth:`NearbyViews.places`: in the two views whose cameras are nearest to the ray."""
        views, tangent = self.columns * self.rows, cone_tangent(self.display)
        convergence = 1 / self.display.viewing_distance
        # A camera at s D to the side sees the point x of the lens plane along the slope x / D - s.
        between = ops.floor((((x * convergence - slope) / tangent + 1) * views - 1) / 2)
        px, py, pz = point
        nearness = 1 - pz * convergence
        width, height = self.display.size_mm
        for step in (0, 1):
            view = ops.minimum(ops.maximum(between + step, 0.0), views - 1.0)
            side = ((2 * view + 1) / views - 1) * tangent
            u = ((px - side * pz) / nearness / width + 0.5) * self.view_size[0] - self.window.left
            v = (0.5 - py / nearness / height) * self.view_size[1] - self.window.top
            above = ops.floor((view + 0.5) / self.columns)
            left = (view - above * self.columns) * self.window.width
            top = (self.rows - 1 - above) * self.window.height
            yield Place(left + u, top + v, left, top, left + self.window.width, top + self.window.height, 0.0, 0.0, 1.0)


__all__ = ["CameraViews", "LensViews", "NearbyViews", "Place"]
