"""Placement of a display by a camera, so that it shows all that the camera sees.

Recorded rays begin at the display's aperture distance in front of the lens plane. What a camera sees nearer than that
would be cut open; the lens plane therefore moves toward the eye until nothing is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lippmann.display import Display
from lippmann.errors import SceneError, UsageError
from lippmann.scene.extent import box_corners
from lippmann.scene.matrices import Bounds, inverse, scaling, transform_points, translation
from lippmann.scene.values.description import Camera, Matrix

#: Scene units per millimetre of the display, least and most, as cameras give them: products of matrices with larger
#: entries, and their inverses, overflow.
_UNITS_PER_MM = (1e-30, 1e30)
#: Share by which the nearest surface stays behind the beginning of the recorded rays.
_MARGIN = 1e-3
#: Share of a scene's depth by which it may reach beyond its extreme points, which are those of some directions.
_BETWEEN = 0.005
#: Share of the panel that a scene is enlarged to, the least that is left as it is, and how often that is repeated:
#: nearer parts grow faster than farther ones.
FILL, _LEAST_FILL, _FRAMINGS = 0.95, 0.85, 4


@dataclass(frozen=True, eq=False)
class CameraView:
    """The view of a display placed by a camera, from its viewing point.

    ``half_width`` and ``half_height`` are slopes, or for a parallel view world units.
    """

    world_from_camera: Matrix
    half_width: float
    half_height: float
    is_parallel: bool


@dataclass(frozen=True)
class VisibleDepth:
    """Distances along a camera's axis, world units, between which nearly all lies that it sees."""

    near: float
    far: float


#: Tells what a view sees of the scene; None where it sees nothing.
DepthProbe = Callable[[CameraView], "VisibleDepth | None"]


def place_by_camera(
    camera: Camera,
    bounds: Bounds,
    display: Display,
    *,
    is_unbounded: bool = False,
    pop_out: float | None = None,
    scale: float = 1.0,
    depth_scale: float = 1.0,
    probe: DepthProbe | None = None,
    warnings: list[str],
) -> Matrix:
    """``display_from_world`` that makes the camera's plane of focus the lens plane.

    The viewing distance finite: the camera's eye becomes the viewing point. Infinite: the largest part of the camera's
    picture that has the panel's shape fills the panel. An orthographic camera has no eye, so the latter holds for it.

    Parameters
    ----------
    is_unbounded:
        Whether there is more than ``bounds`` holds, such as planes without end.
    pop_out:
        Share of the visible depth in front of the lens plane, 0 to 1, in place of the camera's focus.
    scale:
        By which the scene will be enlarged about the lens plane.
    depth_scale:
        By which its depth will be scaled besides.
    probe:
        Tells what the camera sees; without it the corners of ``bounds`` stand in for that, and nothing is moved.
    warnings:
        Takes a line if the lens plane had to move.

    Raises
    ------
    UsageError
        ``pop_out`` asks for more in front of the lens plane than recorded rays show.
    SceneError
        The camera has the whole scene behind it, or a field that is no field or beyond numbers.
    """
    frame = view_frame(camera)
    in_camera = transform_points(inverse(frame), box_corners(bounds))
    farthest, nearest = -float(in_camera[:, 2].min()), max(-float(in_camera[:, 2].max()), 0.0)
    if farthest <= 0.0:
        raise SceneError(
            f"camera '{camera.name}' has the whole scene behind it", parameter="camera", fix="choose another, or fit"
        )
    center = -float(in_camera[:, 2].mean())
    focus = camera.focus_distance
    if focus is None:
        focus = center if center > 0.0 else (nearest + farthest) / 2.0
    if not (np.isfinite(focus) and focus > 0.0):
        raise SceneError(f"camera '{camera.name}' focuses at {focus:g}", parameter="camera", rule="a distance above 0")
    visible: VisibleDepth | None = None
    may_cut = is_unbounded or nearest < _first_recorded(camera, focus, display, scale * depth_scale)
    if probe is not None and (pop_out is not None or may_cut):
        visible = probe(_view(camera, frame, focus, display, scale))
    if pop_out is not None:
        near, far = (nearest, farthest) if visible is None else (visible.near, visible.far)
        focus = max(near + pop_out * (far - near), np.finfo(float).tiny)
    if visible is not None and visible.near > 0.0:
        most = _farthest_focus(camera, visible.near, display, scale * depth_scale)
        if pop_out is not None and focus > most * (1.0 + 2.0 * _MARGIN):
            _refuse_pop_out(pop_out, max(0.0, (most - visible.near) / (visible.far - visible.near)), display)
        if focus > most:
            if pop_out is None:
                warnings.append(
                    f"the lens plane moved by {focus - most:.3g} to {most:.3g} scene units in front of the camera: "
                    f"recorded rays begin {display.aperture_distance:g} mm in front of it, and would cut off what "
                    "is nearer"
                )
            focus = most
    units, (least, largest) = _units_per_mm(camera, focus, display), _UNITS_PER_MM
    if not least <= units <= largest:
        raise SceneError(
            f"camera '{camera.name}' makes 1 mm of the display {units:g} scene units long",
            parameter="camera",
            rule=f"between {least:g} and {largest:g}",
        )
    return inverse(frame @ translation((0.0, 0.0, -focus)) @ scaling(units))


def _refuse_pop_out(pop_out: float, most: float, display: Display) -> None:
    raise UsageError(
        f"{pop_out:g} of the visible depth does not fit in front of the lens plane",
        parameter="pop_out",
        rule=f"recorded rays begin {display.aperture_distance:g} mm in front of it",
        fix=f"ask for at most {np.floor(most * 100.0) / 100.0:.2f}, or for a larger aperture_distance of the display",
    )


def _view(camera: Camera, frame: Matrix, focus: float, display: Display, scale: float) -> CameraView:
    """The view from the middle of the viewing zone."""
    half_width, half_height = (side / 2.0 / scale for side in display.size_mm)
    if camera.fov_y is not None and np.isfinite(display.viewing_distance):
        distance = display.viewing_distance
        return CameraView(frame, half_width / distance, half_height / distance, is_parallel=False)
    units = _units_per_mm(camera, focus, display)
    return CameraView(frame, half_width * units, half_height * units, is_parallel=True)


def _first_recorded(camera: Camera, focus: float, display: Display, scale: float) -> float:
    """Distance from the camera at which recorded rays begin if it focuses at ``focus``."""
    return focus - display.aperture_distance * (1.0 - _MARGIN) / scale * _units_per_mm(camera, focus, display)


def _farthest_focus(camera: Camera, nearest: float, display: Display, scale: float) -> float:
    """The farthest lens plane from which recorded rays still begin in front of the surface at ``nearest``."""
    aperture = display.aperture_distance * (1.0 - _MARGIN) / scale
    if camera.fov_y is None:
        return nearest + aperture * _units_per_mm(camera, nearest, display)
    # The scale grows with the distance: 1 mm is focus times so much.
    share = aperture * _units_per_mm(camera, 1.0, display)
    return nearest / (1.0 - share) if share < 1.0 else np.inf


def _units_per_mm(camera: Camera, focus: float, display: Display) -> float:
    if camera.fov_y is not None:
        if np.isfinite(display.viewing_distance):
            return focus / display.viewing_distance
        height = 2.0 * focus * float(np.tan(camera.fov_y / 2.0))
    elif camera.height is not None:
        height = camera.height
    else:
        raise SceneError(f"camera '{camera.name}' has neither an angle nor a height", parameter="camera")
    if not (np.isfinite(height) and height > 0.0 and _aspect(camera, display) > 0.0):
        raise SceneError(f"camera '{camera.name}' has a field {height:g} high", parameter="camera", rule="above 0")
    return min(height * _aspect(camera, display) / display.size_mm[0], height / display.size_mm[1])


def _aspect(camera: Camera, display: Display) -> float:
    return display.size_mm[0] / display.size_mm[1] if camera.aspect is None else camera.aspect


def frame_whole(camera: Camera, points: Bounds, display: Display) -> Matrix:
    """The change ``(4, 4)`` in a display's frame after which the panel shows all that a camera shows.

    Seen from the viewing point, all of the camera's picture then lies on the panel. A scene of which that is only a
    part, such as a teapot on its table, is enlarged until it fills the panel, centred, and set behind the beginning of
    recorded rays.

    Parameters
    ----------
    points:
        ``(n, 3)``: the scene's extreme points in the frame of the display as :func:`place_by_camera` places it.
    """
    panel = np.array(display.size_mm)
    change = scaling(_share_contained(camera, display))
    for step in range(_FRAMINGS):
        placed = transform_points(change, points)
        if (placed[:, 2] >= display.viewing_distance).any():
            return change
        projected = placed[:, :2] / (1.0 - placed[:, 2:] / display.viewing_distance)
        low, high = projected.min(axis=0), projected.max(axis=0)
        is_whole = (np.maximum(-low, high) <= panel / 2.0).all()
        fill = float(((high - low) / panel).max())
        if step == 0 and (not is_whole or fill >= _LEAST_FILL):
            return change
        middle = (low + high) / 2.0
        change = scaling(FILL / fill) @ translation((-middle[0], -middle[1], 0.0)) @ change
        # Enlarged, it may stand out of the panel farther than rays are recorded: it moves back.
        depths = transform_points(change, points)[:, 2]
        nearest = float(depths.max() + _BETWEEN * np.ptp(depths))
        change = translation((0.0, 0.0, min(0.0, display.aperture_distance * (1.0 - _MARGIN) - nearest))) @ change
    return change


def _share_contained(camera: Camera, display: Display) -> float:
    """The scale, at most 1, at which all of a camera's picture is seen on the panel, from the viewing point."""
    if camera.fov_y is None:
        return 1.0
    slope = float(np.tan(camera.fov_y / 2.0))
    width, height = display.size_mm
    if np.isfinite(display.viewing_distance):
        reach = 2.0 * display.viewing_distance * slope
        return min(1.0, width / (reach * _aspect(camera, display)), height / reach)
    shares = width / _aspect(camera, display), height
    return min(shares) / max(shares)


def view_frame(camera: Camera) -> Matrix:
    """``world_from_view``: the camera's frame, in which the middle of its picture lies on the -z axis.

    Depth is that along the camera's own axis. The lens of a perspective camera with a shift is off-axis, which shears
    the frame; an orthographic one is moved.
    """
    right, up = camera.shift
    if camera.fov_y is None:
        return np.asarray(remove_scale(camera) @ translation((right, up, 0.0)), np.float64)
    shear = np.eye(4)
    shear[:2, 2] = -right, -up
    return np.asarray(remove_scale(camera) @ shear, np.float64)


def remove_scale(camera: Camera) -> Matrix:
    """``world_from_camera`` without the scale, shear or mirroring that a file's nodes may carry.

    Direction and upright are kept; +x follows from them.
    """
    matrix = np.asarray(camera.world_from_camera, np.float64)
    back, up = matrix[:3, 2], matrix[:3, 1]
    right = np.cross(up, back)
    lengths = np.linalg.norm(back), np.linalg.norm(right)
    if not np.isfinite(matrix).all() or min(lengths) <= 0.0:
        raise SceneError(f"camera '{camera.name}' has a transform that is not invertible", parameter="camera")
    back, right = back / lengths[0], right / lengths[1]
    rigid = np.eye(4)
    rigid[:3, :3] = np.stack([right, np.cross(back, right), back], axis=-1)
    rigid[:3, 3] = matrix[:3, 3]
    return rigid
