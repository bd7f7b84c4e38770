"""How a scene is fitted to a display: its silhouette fills the panel, its depth keeps to what the display resolves.

Size and depth are chosen apart. Seen from the viewing point the silhouette fills the panel's width or height; depth
that the display would only blur is compressed about the lens plane. That is an affine map of the display's frame:
straight rays stay straight, and are shaded in the scene's own space.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lippmann.display import Display
from lippmann.scene.camera_placement import FILL
from lippmann.scene.matrices import Bounds, Vector, depth_scaling, scaling, translation
from lippmann.scene.values.description import Matrix

#: Share of the scene's depth that lies in front of the lens plane, where the aperture allows it.
POP_OUT = 1.0 / 3.0

#: Extents below this share of the largest coordinate are rounding noise: files and renderers hold coordinates in single
#: precision, whose error of half a unit in the last place a rotation of the scene multiplies by a few.
_NOISE = 4.0 * float(np.finfo(np.float32).eps)

#: No extent above this share of the largest one is noise, so that a small scene far from the origin has a size.
_LARGEST_NOISE = 1e-3

#: The scale is searched between these multiples of the one that fills the panel where all views are parallel.
_SEARCHED = (1.0 / 16.0, 2.0)
#: In so many rounds, each of which divides what is left into so many parts: to a millionth of a pixel.
_ROUNDS, _PARTS = 8, 16
#: What covers the panel in all views reaches beyond them by this share of its size, and is at most so many times as
#: large as the panel: a depth that is scaled up a lot would need any size.
_BEYOND, _MOST_ENLARGED = 1e-3, 4.0
#: The centre is found by so many steps at most, and once none moves by more than this share of the scene's extent.
_CENTERINGS, _CENTERED = 12, 1e-13


@dataclass(frozen=True)
class Fit:
    """A fitted scene.

    Attributes
    ----------
    display_from_turned:
        ``(4, 4)``, from the turned scene (world units) to the display's frame.
    depth:
        The scene's depth in mm at the size at which it appears, uncompressed.
    depth_scale:
        Share of it that is shown.
    front, full_front:
        Millimetres of the shown depth in front of the lens plane, and how many ``pop_out`` asks for.
    """

    display_from_turned: Matrix
    depth: float
    depth_scale: float
    front: float
    full_front: float


def fit_scene(
    points: Bounds,
    bounds: Bounds,
    display: Display,
    *,
    scale: float = 1.0,
    depth_scale: float | None = None,
    pop_out: float | None = None,
    covers: bool = False,
) -> Fit:
    """Fit a scene to a display.

    In front of the lens plane lies ``pop_out`` of the depth, but no more than the aperture lets through: the rest of it
    moves behind.

    Parameters
    ----------
    points:
        ``(n, 3)``: the turned scene's extreme points, between which all of it lies.
    bounds:
        ``(2, 3)``: its bounding box.
    scale:
        Factor on the size that fills the panel.
    depth_scale:
        Share of the depth that is shown; None: all that the display resolves.
    pop_out:
        Share of the depth in front of the lens plane, 0 to 1; None: a third.
    covers:
        The scene's borders are to lie outside all views, instead of its silhouette within the panel.
    """
    low, high = bounds
    width, height, depth = _extents(bounds)
    share = POP_OUT if pop_out is None else pop_out
    resolved = _largest_in_depth(depth, share, display)
    middle = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, high[2]])
    # Where there is no extent, rounding noise must not count as one.
    seen = (points - middle) * (np.array([width, height, depth]) > 0.0)

    def at(size: float) -> Fit:
        """The fit of a given size, in mm per world unit."""
        shown = min(1.0, resolved / size) if depth_scale is None else depth_scale
        full_front = share * depth * size * shown
        front = min(full_front, display.aperture_distance)
        x, y = (0.0, 0.0) if covers else _center(seen, size, shown, front, display)
        anchor = translation(-middle - (x, y, 0.0))
        matrix = translation((0.0, 0.0, front)) @ depth_scaling(shown) @ scaling(size) @ anchor
        return Fit(matrix, depth * size, shown, front, full_front)

    def fills(sizes: Bounds) -> Bounds:
        """Share of the panel that the silhouette fills, on the axis where it fills more, for sizes ``(m,)``."""
        shown = np.minimum(1.0, resolved / sizes) if depth_scale is None else np.full(len(sizes), depth_scale)
        front = np.minimum(share * depth * sizes * shown, display.aperture_distance)
        nearness, center = _centers(seen, sizes, shown, front, display)
        widths = [  # an axis at a time: rows of numbers are quicker than pairs
            sizes * np.ptp((seen[:, axis] - center[:, axis, None]) / nearness, axis=1) / display.size_mm[axis]
            for axis in (0, 1)
        ]
        return np.asarray(np.maximum(*widths), np.float64)

    if covers and width > 0.0 and height > 0.0:
        size = _least_covering((width, height), at, display)
    elif width > 0.0 or height > 0.0:
        size = FILL * min(
            side / extent if extent > 0.0 else np.inf
            for side, extent in zip(display.size_mm, np.ptp(seen[:, :2], axis=0), strict=True)
        )
        if np.isfinite(display.viewing_distance):
            size = _largest(fills, size)
    else:  # a line toward the viewer
        size = resolved
    return at(size * scale)


def _largest(fills: Callable[[Bounds], Bounds], size: float) -> float:
    """The size, near the given one, whose silhouette fills the panel as it should."""
    least, most = (np.log(size * factor) for factor in _SEARCHED)
    for _ in range(_ROUNDS):
        places = least + (most - least) * np.arange(1, _PARTS) / _PARTS
        fitting = int((fills(np.exp(places)) <= FILL).cumprod().sum())
        bounds = [least, *places, most]
        least, most = bounds[fitting], bounds[fitting + 1]
    return float(np.exp(least))


def _least_covering(extents: tuple[float, float], at: Callable[[float], Fit], display: Display) -> float:
    """The least size at which a block of ``extents`` (across, down) ends outside all views.

    The larger, the deeper it is and the farther its views reach: the size grows until it suffices.
    """
    size = max(side / extent for side, extent in zip(display.size_mm, extents, strict=True))
    most = _MOST_ENLARGED * size
    for _ in range(_ROUNDS):
        fit = at(size)
        front, back = fit.front, fit.front - fit.depth * fit.depth_scale
        reached = (display.reach_of_views(z) for z in (front, back))
        covering = max(2.0 * side / extent for sides in reached for side, extent in zip(sides, extents, strict=True))
        size = (1.0 + _BEYOND) * covering
        if size >= most:
            return most
    return size


def _center(seen: Bounds, size: float, shown: float, front: float, display: Display) -> tuple[float, float]:
    """Where, in world units from the box's middle, a scene has its centre as seen from the viewing point."""
    _, centers = _centers(seen, np.array([size]), np.array([shown]), np.array([front]), display)
    return float(centers[0, 0]), float(centers[0, 1])


def _centers(seen: Bounds, sizes: Bounds, shown: Bounds, front: Bounds, display: Display) -> tuple[Bounds, Bounds]:
    """Nearness ``(m, n)`` of points ``(n, 3)`` to the viewing point, and :func:`_center` ``(m, 2)``, for m sizes."""
    nearness = 1.0 - (front[:, None] + seen[:, 2] * (sizes * shown)[:, None]) / display.viewing_distance
    center = np.zeros((len(sizes), 2))
    if np.isfinite(display.viewing_distance):
        # What lies farthest to either side is to lie equally far from the middle: Newton steps, since that difference
        # falls as the centre moves, by the two points' own slopes.
        inverse, each = 1.0 / nearness, np.arange(len(sizes))
        points = seen[:, 0] * inverse, seen[:, 1] * inverse
        still = _CENTERED * np.abs(seen[:, :2]).max(initial=0.0)
        for _ in range(_CENTERINGS):
            moved = 0.0
            for axis in (0, 1):
                silhouette = points[axis] - center[:, axis, None] * inverse
                right, left = silhouette.argmax(axis=1), silhouette.argmin(axis=1)
                apart = silhouette[each, right] + silhouette[each, left]
                step = apart / (inverse[each, right] + inverse[each, left])
                center[:, axis] += step
                moved = max(moved, float(np.abs(step).max()))
            if moved <= still:
                break
    return nearness, center


def _extents(bounds: Bounds) -> Vector:
    """Extents along x, y and z of a box; those that are rounding noise are 0, but never all of them."""
    extents = np.ptp(bounds, axis=0)
    noise = min(_NOISE * np.abs(bounds).max(), _LARGEST_NOISE * extents.max())
    x, y, z = np.where(extents > noise, extents, 0.0).tolist()
    return x, y, z


def _largest_in_depth(depth: float, pop_out: float, display: Display) -> float:
    """Largest scale s of the depth for which a scene keeps to the depth that the display resolves.

    In front lie f = min(pop_out depth s, aperture distance), which may not exceed the near limit; behind lie
    depth s - f, which may not exceed the far one.
    """
    if depth <= 0.0:
        return np.inf
    near, far = display.resolvable_depth
    aperture = display.aperture_distance
    by_front = near / (pop_out * depth) if pop_out > 0.0 and aperture > near else np.inf
    behind = (1.0 - pop_out) * depth
    if behind > 0.0 and pop_out * depth * -far / behind <= aperture:
        return min(by_front, -far / behind)
    return min(by_front, (aperture - far) / depth)
