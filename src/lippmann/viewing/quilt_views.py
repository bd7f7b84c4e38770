"""A quilt's views as an eye or a camera in front of a display sees them, without the display's lenses.

View k of N is that of the camera in the middle of the k-th of N equal parts of the field of view, counted from the
left, even in the tangent. A view shows the panel's rectangle in the lens plane. The direction in which an eye looks
through a point of the lens plane lies between two cameras; beyond the outermost camera that camera's view is taken.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.display.sheet_layout import trimmed
from lippmann.display.view_cone import cone_tangent
from lippmann.errors import PictureError
from lippmann.image.stored_values import FloatArray
from lippmann.quilts.quilt import Quilt
from lippmann.quilts.weave import position_in_view
from lippmann.viewing.refocus import check_planes
from lippmann.viewing.replay import FAR, Eye, Real, check_size, eye_before, lens_plane_points

#: Default limit on the width of a picture, in pixels.
_WIDEST = 2048


def quilt_display(quilt: Quilt, display: Display | None, where: str) -> Display:
    """The display of a quilt: ``display``, or else the quilt's own; of a print the trim, which the views show.

    Raises
    ------
    PictureError
        If there is none, or it is not lenticular; names ``where``.
    """
    display = quilt.display if display is None else display
    if display is None:
        raise PictureError("the quilt does not say its display", where=where, fix="say display=...")
    if display.lens_array.layout != "lenticular":
        rule = "a quilt needs cylindrical lenses"
        raise PictureError(f"{display.name} has {display.lens_array.layout} lenses", where=where, rule=rule)
    return trimmed(display)


def replay_quilt(
    quilt: Quilt, display: Display, eye: Eye | None = None, *, size: tuple[int, int] | None = None, linear: bool = True
) -> FloatArray:
    """Picture that an eye sees of a quilt's views.

    Parameters
    ----------
    quilt:
        The views.
    display:
        The lenticular display that they are for.
    eye:
        Position ``(x, y, z)`` in mm, z > 0. None: central, at the viewing distance.
    size:
        Width and height of the result in pixels. None: the views' height, and the panel's proportions.
    linear:
        Whether to interpolate between the two next views; otherwise the nearest is taken.

    Returns
    -------
    ``(height, width, 3)`` float32 linear RGB.

    Raises
    ------
    UsageError
        If the eye is not in front of the lens plane, or the size is out of range.
    """
    eye = eye_before(display, eye)
    width, height = check_size(_default_size(quilt, display) if size is None else size)
    lattice, count = display.lattice, quilt.layout.views
    convergence = 1 / display.viewing_distance if math.isfinite(display.viewing_distance) else 0.0
    views = quilt.view_rows(0, quilt.view_size[1])
    picture = np.empty((height, width, 3), dtype=np.float32)
    for rows, x, y in lens_plane_points(display, width, height):
        across = lattice.across(x, y)
        # Place under each lens that the eye sees, in micro-images from the middle: right of it from the left.
        place = (across - lattice.across(eye[0], eye[1])) / eye[2] - across * convergence
        place *= display.gap / (display.micro_image_pitch * display.edge_factor)
        position = np.clip((0.5 - place) * count - 0.5, 0.0, count - 1.0)
        first = np.floor(position if linear else position + 0.5).astype(np.intp)
        share = (position - first if linear else np.zeros_like(position))[..., None]
        at = position_in_view(quilt, display, x, y)
        near_view = _sample(views, first, *at)
        following = _sample(views, np.minimum(first + 1, count - 1), *at)
        picture[rows] = near_view + (following - near_view) * share.astype(np.float32)
    return picture


def refocus_quilt(
    quilt: Quilt, display: Display, planes: Sequence[float], *, size: tuple[int, int] | None = None
) -> Iterator[FloatArray]:
    """Pictures focused on planes: at each point of a plane the mean of the views that show it, by shift and sum.

    Parameters
    ----------
    quilt, display, size:
        As for :func:`replay_quilt`.
    planes:
        Heights of the planes over the lens plane in mm, positive toward the viewer, below the viewing distance.

    Returns
    -------
    Iterator of ``(height, width, 3)`` float32 linear RGB, black where no view shows the plane.

    Raises
    ------
    UsageError
        If a plane or the size is out of range; raised at once.
    """
    check_planes(planes, display)
    width, height = check_size(_default_size(quilt, display) if size is None else size)
    return (_refocus(quilt, display, plane, width, height) for plane in planes)


def _refocus(quilt: Quilt, display: Display, plane: float, width: int, height: int) -> FloatArray:
    picture = np.zeros((height, width, 3), dtype=np.float32)
    count = np.zeros((height, width), dtype=np.float32)
    half = display.size_mm[0] / 2, display.size_mm[1] / 2
    distance = min(display.viewing_distance, FAR)
    stretch = plane / (distance - plane)
    for number in range(quilt.layout.views):
        # Cameras stand level, even in the tangent, whatever the slant of the lenses.
        camera = ((2 * number + 1) / quilt.layout.views - 1) * cone_tangent(display) * distance
        view = quilt.view(number)[None]
        for rows, x, y in lens_plane_points(display, width, height):
            lens_x, lens_y = x + (x - camera) * stretch, y + y * stretch
            inside = (np.abs(lens_x) <= half[0]) & (np.abs(lens_y) <= half[1])
            colors = _sample(view, np.zeros(x.shape, dtype=np.intp), *position_in_view(quilt, display, lens_x, lens_y))
            picture[rows] += colors * inside[..., None]
            count[rows] += inside
    picture /= np.maximum(count, 1)[..., None]
    return picture


def _sample(views: FloatArray, number: NDArray[np.intp], across: Real, down: Real) -> FloatArray:
    """Bilinear samples ``(..., 3)`` of ``views`` ``(views, rows, columns, 3)`` at :func:`position_in_view`."""
    rows, columns = views.shape[1:3]
    left, top = across.astype(np.intp), down.astype(np.intp)
    right, bottom = np.minimum(left + 1, columns - 1), np.minimum(top + 1, rows - 1)
    part_x, part_y = (part.astype(np.float32)[..., None] for part in (across - left, down - top))
    upper = views[number, top, left] * (1 - part_x) + views[number, top, right] * part_x
    lower = views[number, bottom, left] * (1 - part_x) + views[number, bottom, right] * part_x
    sampled: FloatArray = upper * (1 - part_y) + lower * part_y
    return sampled


def _default_size(quilt: Quilt, display: Display) -> tuple[int, int]:
    height = quilt.view_size[1]
    width = max(1, round(height * display.panel.width / display.panel.height))
    shrink = min(1.0, _WIDEST / width)
    return max(1, round(width * shrink)), max(1, round(height * shrink))
