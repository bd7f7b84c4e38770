"""How a scene is fitted to a display: all its views fill the panel together, its depth keeps to what is resolved.

Size and depth are chosen together. From view to view a point at height z over the lens plane moves by z times the
difference of their slopes. The scene is the largest that stays on the panel in every view, once depth that the display
would only blur is compressed about the lens plane. That is an affine map of the display's frame: straight rays stay
straight, and are shaded in the scene's own space.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lippmann.display import Display
from lippmann.display.view_cone import visible_size, zone_slopes
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

#: The size is searched for up to this multiple of the one that fills the panel if the scene had no depth.
_LARGEST_SIZE = 2.0
#: In so many rounds, each of which divides what is left into so many parts: to a millionth of a pixel.
_ROUNDS, _PARTS = 8, 16
#: Content that covers the panel in all views reaches beyond them by this share of its size, and is at most so many
#: times as large as the panel: a depth that is scaled up a lot would need any size.
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
    """Fit a scene to a display, so that every view of its view zone shows all of it, and all views fill the panel.

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
    # Rounding noise must not count as an extent.
    offsets = (points - middle) * (np.array([width, height, depth]) > 0.0)

    def depths(sizes: Bounds) -> tuple[Bounds, Bounds]:
        """Share of the depth that is shown, and how much of it would lie in front, for sizes ``(m,)``."""
        depth_share = np.minimum(1.0, resolved / sizes) if depth_scale is None else np.full(len(sizes), depth_scale)
        return depth_share, share * depth * sizes * depth_share

    def spans(sizes: Bounds) -> tuple[Bounds, Bounds]:
        """:func:`_spans` of sizes ``(m,)``, in mm per world unit."""
        depth_share, front = depths(sizes)
        heights = np.minimum(front, display.aperture_distance)[:, None] + offsets[:, 2] * (sizes * depth_share)[:, None]
        return _spans(offsets[:, :2], sizes, heights, display)

    def at(size: float) -> Fit:
        """The fit of a given size, in mm per world unit."""
        sizes = np.array([size])
        depth_share, full_front = (float(values[0]) for values in depths(sizes))
        front = min(full_front, display.aperture_distance)
        x, y = (0.0, 0.0) if covers else spans(sizes)[0][0]
        anchor = translation(-middle - (x, y, 0.0))
        matrix = translation((0.0, 0.0, front)) @ depth_scaling(depth_share) @ scaling(size) @ anchor
        return Fit(matrix, depth * size, depth_share, front, full_front)

    def fills(sizes: Bounds) -> Bounds:
        """Share of the panel that all views fill together, on the axis where they fill more, for sizes ``(m,)``."""
        return np.asarray((spans(sizes)[1] / visible_size(display)).max(axis=1), np.float64)

    if covers and width > 0.0 and height > 0.0:
        return at(scale * _least_covering((width, height), at, display))
    if width > 0.0 or height > 0.0:
        sides = [FILL * side for side in visible_size(display)]
        size = min(side / extent for side, extent in zip(sides, (width, height), strict=True) if extent > 0.0)
        most = _LARGEST_SIZE * size
    else:  # a line toward the viewer
        most = resolved
    if depth > 0.0:
        least = _surely_whole(width, height, depth * (1.0 if depth_scale is None else depth_scale), display)
        size = _largest(fills, min(least, most), most)
    return at(scale * size)


def _surely_whole(width: float, height: float, depth: float, display: Display) -> float:
    """A size at which all views surely show the whole scene: all its depth as far off the lens plane, on either side.

    In front, it comes no nearer than half way to the viewing point, where all is seen twice as large.
    """
    reach = np.array([width, height]) + 2.0 * depth * np.array(zone_slopes(display))
    return float(
        min(FILL / 2.0 * (np.array(visible_size(display)) / reach).min(), display.viewing_distance / (2.0 * depth))
    )


def _largest(fills: Callable[[Bounds], Bounds], least: float, most: float) -> float:
    """The largest size, between one that is whole and ``most``, up to which all views together fit the panel."""
    least, most = np.log(least), np.log(most)
    for _ in range(_ROUNDS):
        places = least + (most - least) * np.arange(1, _PARTS + 1) / _PARTS
        fitting = int((fills(np.exp(places)) <= FILL).cumprod().sum())
        least, most = ([least, *places, most][fitting + end] for end in (0, 1))
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


def _spans(offsets: Bounds, sizes: Bounds, heights: Bounds, display: Display) -> tuple[Bounds, Bounds]:
    """Extent over which all views together show points, for m sizes: its middle ``(m, 2)`` and its span ``(m, 2)``.

    The eye of slope s sees the point (x, y, z) of the display's frame in the lens plane at ``(x - s z) / (1 - z / D)``,
    and so for y. The middle, in world units, is that which the panel's middle is to show: what lies farthest to either
    side then lies equally far from it. The span is in mm of the lens plane.

    Parameters
    ----------
    offsets:
        ``(n, 2)``, world units.
    sizes:
        ``(m,)``, mm per world unit.
    heights:
        ``(m, n)``, mm over the lens plane.
    """
    inverse = 1.0 / (1.0 - heights / display.viewing_distance)
    each = np.arange(len(sizes))
    middle, span = np.zeros((len(sizes), 2)), np.zeros((len(sizes), 2))
    for axis, slope in enumerate(zone_slopes(display)):
        place, shift = offsets[:, axis] * inverse, slope * np.abs(heights) / sizes[:, None] * inverse
        still = _CENTERED * np.abs(offsets[:, axis]).max(initial=0.0)
        # Newton steps: the difference of the two sides falls as the middle moves, by the two points' own slopes.
        for _ in range(_CENTERINGS):
            centered = place - middle[:, axis, None] * inverse
            right, left = (centered + shift).argmax(axis=1), (centered - shift).argmin(axis=1)
            reach = (centered + shift)[each, right], (centered - shift)[each, left]
            span[:, axis] = sizes * (reach[0] - reach[1])
            step = (reach[0] + reach[1]) / (inverse[each, right] + inverse[each, left])
            middle[:, axis] += step
            if np.abs(step).max() <= still:
                break
    return middle, span


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
