"""Placement of a display in a scene: the affine map ``world_from_display``, which may scale depth apart.

The display frame is right-handed, in millimetres: origin at the array's centre in the lens plane, +x right, +y up,
+z toward the viewer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lippmann.display import Display
from lippmann.display.stereo import (
    COMFORTABLE,
    EYE_DISTANCE,
    comfortable_share,
    depth_of_disparity,
    disparity,
    perceived_height,
)
from lippmann.errors import SceneError, UsageError
from lippmann.options.placement import Mode, PlacementOptions
from lippmann.scene.camera_placement import CameraView, DepthProbe, frame_whole, place_by_camera, remove_scale
from lippmann.scene.extent import box, box_corners, thin_axis
from lippmann.scene.matrices import (
    Bounds,
    depth_scaling,
    inverse,
    rotation,
    rotation_of,
    scaling,
    transform_points,
    translation,
    turn_of,
)
from lippmann.scene.scene import find_camera
from lippmann.scene.values.description import Camera, Matrix

#: Flattening above this factor is too little to be said.
_UNNOTICED_SCALE = 0.95


@dataclass(frozen=True, eq=False)
class Placement:
    """Position, orientation and scale of a display in a scene.

    ``world_from_display`` is ``scale * rotation * depth`` with a translation, 4x4; its scale is in world units per
    millimetre, and ``depth`` stretches z alone, where the scene's depth is compressed, or leans it, where a camera's
    lens is shifted. ``depth_range`` is (back, front): the lowest and highest z of the scene's bounding box in
    millimetres of the display frame; ``depth_budget`` the same for what the display records and resolves
    (:attr:`lippmann.display.Display.depth_budget`). ``warnings`` say, one line each, what was compressed, and what will
    be blurred, cut or outside. ``exposure`` is that of the camera that places the display, in stops. ``may_cut`` holds
    the options of a placement by which the panel's edge may cut what stands in front of it; None where all of the scene
    lies within the panel, or is to be cut as a photograph.
    Of an eye-tracked monitor that a camera places ``depth_range`` is that of what is seen, and ``eye_share`` the share
    of the distance between the eyes from which its two pictures are taken; below 1 the eyes perceive less depth.
    """

    world_from_display: Matrix
    depth_range: tuple[float, float]
    depth_budget: tuple[float, float]
    mode: Mode
    warnings: tuple[str, ...] = ()
    exposure: float = 0.0
    may_cut: PlacementOptions | None = None
    eye_share: float = 1.0

    def traced(self, display: Display) -> Display:
        """The display by whose lenses rays are traced."""
        return display if self.eye_share == 1.0 else display.with_closer_eyes(self.eye_share)

    @property
    def display_from_world(self) -> Matrix:
        """The inverse, 4x4."""
        return inverse(self.world_from_display)

    @property
    def depth_scale(self) -> float:
        """Factor on the scene's depth beside its other extents."""
        linear = self.world_from_display[:3, :3]
        across = np.linalg.norm(linear[:, 0])
        return float(across / (linear[:, 2] @ rotation_of(self.world_from_display)[:3, 2]))


def placement_of(value: object) -> PlacementOptions | Placement:
    """A placement's options from a call's argument: options themselves, a mapping of them, or None for the defaults.

    Raises
    ------
    UsageError
        It is something else, or an option is not known.
    """
    if value is None:
        return PlacementOptions()
    if isinstance(value, Mapping):
        return PlacementOptions.of(value)
    if not isinstance(value, (PlacementOptions, Placement)):
        rule = 'must be a PlacementOptions, a Placement, or a dict such as {"turn": 30}'
        raise UsageError(f"{value!r}", parameter="placement", rule=rule)
    return value


def options_of_sequence(value: object) -> PlacementOptions:
    """:func:`placement_of` for pictures that move: options alone.

    Raises
    ------
    UsageError
        As :func:`placement_of`, or ``placement`` is already a :class:`Placement`.
    """
    options = placement_of(value)
    if isinstance(options, Placement):
        rule = "a sequence finds the placement of each frame by itself"
        raise UsageError("a placement found before", parameter="placement", rule=rule, fix="give its options instead")
    return options


def place(
    bounds: Bounds,
    display: Display,
    *,
    cameras: Sequence[Camera] = (),
    options: PlacementOptions | None = None,
    home_camera: str | None = None,
    contains_home: bool = False,
    bounds_in: Callable[[Matrix], Bounds] | None = None,
    extreme_points: Callable[[], Bounds] | None = None,
    is_unbounded: bool = False,
    fills_panel: bool = False,
    probe: DepthProbe | None = None,
) -> Placement:
    """Place a display in a scene.

    Parameters
    ----------
    bounds:
        The scene's bounding box ``(2, 3)``, world units.
    cameras:
        The scene's cameras; ``options.camera`` names one of them.
    home_camera:
        The camera that the scene was made to be shown by, if there is one.
    contains_home:
        Whether the panel is to show all of that camera's picture, and a scene within it large, where nobody asked for a
        placement.
    bounds_in:
        The scene's box in another frame (:meth:`lippmann.scene.scene.Scene.bounds_in`), for a depth range that is
        tight; without it the corners of ``bounds`` are carried over, which can only be too large.
    extreme_points:
        The scene's extreme points (:attr:`lippmann.scene.scene.Scene.extreme_points`), for a silhouette that is tight;
        without it the corners of ``bounds``.
    is_unbounded:
        Whether the scene holds more than ``bounds``, such as planes without end.
    fills_panel:
        Whether a scene that is fitted is to cover the panel in all views, as a photograph.
    probe:
        Tells how deep a camera sees, so that a display placed by it cuts nothing off and ``pop_out`` counts what is
        seen; without it the corners of ``bounds`` stand in for what is seen.

    Raises
    ------
    UsageError
        With a camera, ``pop_out`` asks for more in front of the lens plane than recorded rays show.
    SceneError
        The box is a single point or not finite; the camera is not found, has the whole scene behind it, or a field that
        is no field or beyond numbers.
    """
    options = options or PlacementOptions()
    box(bounds)
    mode = options.place or ("camera" if options.camera or home_camera else "fit")
    warnings: list[str] = []
    exposure = 0.0
    if mode == "fit":
        options = face_viewer(bounds, options, warnings, cameras)
        points = box_corners(bounds) if extreme_points is None else extreme_points()
        display_from_world = _fit(
            bounds, display, options, warnings, points=points, bounds_in=bounds_in, covers=fills_panel
        )
    elif mode == "camera":
        camera = _choose_camera(cameras, options.camera or home_camera)
        exposure = camera.exposure
        by_camera = place_by_camera(
            camera,
            bounds,
            display,
            is_unbounded=is_unbounded,
            pop_out=options.pop_out,
            scale=options.scale,
            depth_scale=options.depth_scale or 1.0,
            probe=probe,
            warnings=warnings,
        )
        if contains_home and options.place is None and options.camera is None:
            points = box_corners(bounds) if extreme_points is None else extreme_points()
            by_camera = frame_whole(camera, transform_points(by_camera, points), display) @ by_camera
        display_from_world = _resize(by_camera, options)
    else:
        display_from_world = _resize(np.eye(4), options)
    display_from_world = translation(options.shift) @ display_from_world
    where = inverse(display_from_world)
    share, visible_range = 1.0, None
    if mode == "camera" and display.stereo is not None:
        share, visible_range = find_eye_share(where, bounds, display, bounds_in, probe, is_unbounded=is_unbounded)
        share = share if options.depth_scale is None else 1.0
    placement = place_at(
        where,
        bounds,
        display,
        mode=mode,
        bounds_in=bounds_in,
        warnings=warnings,
        eye_share=share,
        visible_range=visible_range,
    )
    is_whole = mode == "fit" and (fills_panel or (options.scale <= 1.0 and not any(options.shift)))
    return replace(placement, exposure=exposure, may_cut=None if is_whole else options)


def place_at(
    world_from_display: Matrix,
    bounds: Bounds,
    display: Display,
    *,
    mode: Mode,
    bounds_in: Callable[[Matrix], Bounds] | None = None,
    warnings: Sequence[str] = (),
    eye_share: float = 1.0,
    visible_range: tuple[float, float] | None = None,
) -> Placement:
    """The placement of a display at a given place, with the depth range of the scene and warnings.

    Parameters as of :func:`place`; ``warnings`` come first among those of the placement. ``visible_range`` is the back
    and the front of the visible part of the scene, in mm, where they are known.
    """
    corners = _corners_in(inverse(world_from_display), bounds, bounds_in)
    back, front = visible_range or (float(corners[:, 2].min()), float(corners[:, 2].max()))
    if eye_share != 1.0:
        back, front = (
            perceived_height(min(z, display.aperture_distance), display.viewing_distance, eye_share)
            for z in (back, front)
        )
        eyes = eyes_of_viewer(display)
        closer = f"the two pictures are taken {eye_share * eyes:.3g} mm apart instead of {eyes:g}"
        warnings = (*warnings, f"{closer}, for comfortable depth: depth_scale=1 shows all of it, a strain")
    near, far = display.depth_budget
    warnings = (*warnings, *_find_warnings(corners, (back, front), display))
    return Placement(world_from_display, (back, front), (far, near), mode, warnings, eye_share=eye_share)


def _corners_in(frame_from_world: Matrix, bounds: Bounds, bounds_in: Callable[[Matrix], Bounds] | None) -> Bounds:
    """Corners of the scene's box in a frame."""
    if bounds_in is None:
        return transform_points(frame_from_world, box_corners(bounds))
    return box_corners(bounds_in(frame_from_world))


def find_eye_share(
    world_from_display: Matrix,
    bounds: Bounds,
    display: Display,
    bounds_in: Callable[[Matrix], Bounds] | None = None,
    probe: DepthProbe | None = None,
    *,
    is_unbounded: bool = False,
) -> tuple[float, tuple[float, float]]:
    """Share of the eye distance at which what a camera sees is comfortable, and the back and front of that in mm.

    The camera's picture stays as it is, which flattening would change. The share is whole percents: the kernels of live
    pictures are made for it.
    """
    distance, eyes = display.viewing_distance, eyes_of_viewer(display)
    heights = _corners_in(inverse(world_from_display), bounds, bounds_in)[:, 2]
    back, front = float(heights.min()), float(heights.max())
    is_deep = is_unbounded or not _lies_within((COMFORTABLE, COMFORTABLE), display, back, front)
    if probe is not None and is_deep:
        width, height = display.size_mm
        from_viewer = world_from_display @ translation((0.0, 0.0, distance))
        visible = probe(CameraView(from_viewer, 0.5 * width / distance, 0.5 * height / distance, is_parallel=False))
        if visible is not None:
            # Planes without end reach beyond the box, and a box round the viewer beyond what is seen.
            back, front = min(back, distance - visible.far), min(front, distance - visible.near)
    front = min(front, display.aperture_distance)
    share = comfortable_share(back, front, distance, eyes)
    return max(math.floor(100.0 * share), 1) / 100.0, (back, front)


def face_viewer(
    bounds: Bounds, options: PlacementOptions, warnings: list[str], cameras: Sequence[Camera] = ()
) -> PlacementOptions:
    """The options of a fit, with the turn by which the scene is seen as its file means it, unless they say ``place``.

    That is the direction of its first camera that has the scene's middle within 45 degrees of its axis, across and
    down; a turn that was asked for comes after it. Without one, a flat scene that would be seen edge-on is turned.
    """
    for camera in cameras if options.place is None else ():
        try:
            frame = inverse(remove_scale(camera))
        except SceneError:  # its transform cannot be inverted: it is of no use to a fit, nor in its way
            continue
        x, y, z = transform_points(frame, bounds.mean(axis=0)[None])[0]
        if max(abs(x), abs(y)) <= -z:
            fitted = f'fitted, seen the way that a camera of the file looks: camera="{camera.name}" shows its picture'
            warnings.append(f'{fitted}, place="fit" a view along -z')
            return replace(options, turn=turn_of((rotation(options.turn) @ frame)[:3, :3]))
    if cameras and options == PlacementOptions():
        warnings.append(f'fitted, seen along -z: as a camera of the file sees it by camera="{cameras[0].name}"')
    thin = thin_axis(bounds)
    if thin is None or any(options.turn):
        return options
    warnings.append(f"the scene is flat and would be seen edge-on: turned to show its {'side' if thin == 0 else 'top'}")
    return replace(options, turn=(-90.0, 0.0, 0.0) if thin == 0 else (0.0, 90.0, 0.0))


def _choose_camera(cameras: Sequence[Camera], name: str | None) -> Camera:
    if name is not None:
        return find_camera(cameras, name)
    if not cameras:
        raise SceneError("the scene has no cameras", parameter="place", fix="fit it instead")
    return cameras[0]


def _fit(
    bounds: Bounds,
    display: Display,
    options: PlacementOptions,
    warnings: list[str],
    *,
    points: Bounds,
    bounds_in: Callable[[Matrix], Bounds] | None,
    covers: bool,
) -> Matrix:
    """``display_from_world`` that fits the turned scene to the display, with warnings of what that took."""
    from lippmann.scene.fit_placement import fit_scene

    turned = rotation(options.turn)
    corners = transform_points(turned, box_corners(bounds)) if bounds_in is None else bounds_in(turned)
    fit = fit_scene(
        transform_points(turned, points),
        np.stack([corners.min(axis=0), corners.max(axis=0)]),
        display,
        scale=options.scale,
        depth_scale=options.depth_scale,
        pop_out=options.pop_out,
        covers=covers,
    )
    if options.depth_scale is None and fit.depth_scale < _UNNOTICED_SCALE:
        beyond, within = ("soft", "sharp") if display.stereo is None else ("a strain", "comfortable")
        warnings.append(
            f"depth {fit.depth:.3g} mm flattened to {100 * fit.depth_scale:.2g} %: depth_scale=1 keeps it, {beyond} at "
            f"its ends; scale={options.scale * fit.depth_scale:.2g} keeps it {within}, in a smaller picture"
        )
    if options.pop_out is not None and fit.front < fit.full_front * (1.0 - 1e-9):
        warnings.append(
            f"{fit.front:.3g} mm of the scene lie in front of the lens plane instead of {fit.full_front:.3g}: "
            f"recorded rays begin {display.aperture_distance:g} mm in front of it"
        )
    return fit.display_from_turned @ turned


def _resize(display_from_world: Matrix, options: PlacementOptions) -> Matrix:
    """Turned and scaled about the middle of the lens plane, the depth once more."""
    resized = scaling(options.scale) @ rotation(options.turn) @ display_from_world
    return np.asarray(depth_scaling(options.depth_scale or 1.0) @ resized, np.float64)


def _find_warnings(corners: Bounds, depths: tuple[float, float], display: Display) -> list[str]:
    """Lines on a scene's box in the display's frame, whose depth is seen as ``depths`` (back, front)."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    back, front = depths
    near, far = display.resolvable_depth
    warnings = []
    if high[2] > display.aperture_distance + 1e-6:
        warnings.append(
            f"the scene reaches {high[2]:.3g} mm in front of the lens plane; recorded rays begin at "
            f"{display.aperture_distance:g} mm, what lies nearer is cut off"
        )
    if double := fusion_warning(display, back, front):
        warnings.append(double)
    elif display.stereo is not None and (front > near + 1e-6 or back < far - 1e-6):
        warnings.append(
            f"the scene reaches from {back:.3g} to {front:.3g} mm; from {far:.3g} to {near:.3g} mm it is "
            f"comfortable to look at: flatten it to {100 / max(back / far, front / near):.2g} %, or shift it"
        )
    if display.stereo is None and (high[2] > near + 1e-6 or low[2] < far - 1e-6):
        warnings.append(
            f"the scene reaches from {low[2]:.3g} to {high[2]:.3g} mm; the display resolves "
            f"{far:.3g} to {near:.3g} mm, what lies beyond is blurred"
        )
    half = np.array(display.size_mm) / 2.0
    reach = max(abs(float(low[2])), abs(float(high[2]))) * np.tan(np.radians(display.field_of_view / 2.0))
    window = half * np.maximum(1.0, 1.0 - min(float(low[2]), 0.0) / display.viewing_distance) + reach
    if (low[:2] > window).any() or (high[:2] < -window).any():
        warnings.append("the scene lies beside the panel: nothing of it will be seen")
    return warnings


#: Crossed and uncrossed disparity in degrees that 84 % of 392 viewers fuse: S. Nagata, "Distributions of 'vergence
#: fusional stereoscopic limit'", Trans. VR Soc. Japan 7 (2002).
FUSED = 1.84, 2.04


def fusion_warning(display: Display, back: float, front: float) -> str:
    """One line if a scene from z = ``back`` to ``front`` mm has more disparity than eyes fuse; else empty."""
    distance = display.viewing_distance
    if math.isinf(distance) or _lies_within(FUSED, display, back, front):
        return ""
    near, far = depth_of_disparity(*FUSED, distance, eyes_of_viewer(display))
    fused = f"{far:.0f} to {near:.0f} mm" if math.isfinite(far) else f"all up to {near:.0f} mm"
    return (
        f"the scene reaches from {back:.0f} to {front:.0f} mm; from {distance:.0f} mm away most eyes fuse {fused}, "
        "what lies beyond is seen double: flatten or shift it"
    )


def _lies_within(limits: tuple[float, float], display: Display, back: float, front: float) -> bool:
    """Whether a scene has at most these crossed and uncrossed degrees of disparity, to a nanometre of depth."""
    near, far = depth_of_disparity(*limits, display.viewing_distance, eyes_of_viewer(display))
    return far - 1e-6 <= back and front <= near + 1e-6


def eyes_of_viewer(display: Display) -> float:
    """Distance between the eyes of a display's viewer in mm."""
    return EYE_DISTANCE if display.stereo is None else display.stereo.eyes


def comfort_in_words(display: Display, back: float, front: float) -> str:
    """Disparity of a scene from z = ``back`` to ``front`` mm, and whether it is comfortable.

    Empty where the viewing distance is infinite.
    """
    distance, eyes = display.viewing_distance, eyes_of_viewer(display)
    if math.isinf(distance) or front >= distance:
        return ""
    behind, before = (disparity(z, distance, eyes) for z in (back, front))
    verdict = "strains" if _lies_within(FUSED, display, back, front) else "too much to fuse"
    if _lies_within((COMFORTABLE, COMFORTABLE), display, back, front):
        verdict = "comfortable"
    return (
        f"{verdict}: disparity from {behind:.2f} degrees at the back to {before:.2f} at the front, seen from "
        f"{distance:.0f} mm with eyes {eyes:.0f} mm apart (up to {COMFORTABLE:.0f} is comfortable, up to "
        f"{FUSED[0]:.1f} fuses)"
    )
