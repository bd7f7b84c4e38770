"""A scene on a turntable, frame by frame: a whole turn or a swing to and fro; display and light stand still."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from lippmann.display import Display
from lippmann.errors import UsageError
from lippmann.options.placement import PlacementOptions
from lippmann.scene.camera_placement import CameraView, VisibleDepth
from lippmann.scene.matrices import Bounds, Vector, inverse, transform_points
from lippmann.scene.mitsuba_source import MitsubaSource
from lippmann.scene.placement import Placement, face_viewer, place
from lippmann.scene.scene import Scene
from lippmann.scene.turntable import STEP, swept_points, turn_about, turning_axis
from lippmann.scene.values.description import Camera, Matrix
from lippmann.sequences.motion import Motion

#: Frames of a turn where nothing is said: two seconds.
TURNTABLE_FRAMES = 48

#: Most frames of a turn.
_MOST_FRAMES = 100_000

_UP: Vector = (0.0, 1.0, 0.0)


class Turntable(Motion):
    """A scene that turns about an upright line through the middle of its box.

    Frame k of N shows it turned by 360 k / N degrees, or with ``swing`` by ``swing / 2 sin(2 pi k / N)``; so the last
    frame leads to the first. A positive angle turns its front toward the viewer's right, as ``turn`` of
    :class:`~lippmann.scene.placement.PlacementOptions` does.

    Parameters
    ----------
    scene:
        What turns. Its own animation stands still.
    count:
        Frames of the whole turn, 2 or more.
    swing:
        Degrees from one end of the swing to the other, above 0 and at most 360; None for a whole turn.
    axis:
        Unit vector upwards along the axis, in the world; see :func:`lippmann.scene.turntable.turning_axis`.

    Raises
    ------
    UsageError
        ``count`` or ``swing`` is out of range.
    """

    def __init__(
        self, scene: Scene, count: int = TURNTABLE_FRAMES, *, swing: float | None = None, axis: Vector = _UP
    ) -> None:
        if not 2 <= count <= _MOST_FRAMES:
            raise UsageError(f"{count} frames", parameter="turntable", rule=f"2 to {_MOST_FRAMES} frames of a turn")
        if swing is not None and not 0.0 < swing <= 360.0:
            raise UsageError(f"{swing:g} degrees", parameter="swing", rule="above 0 and at most 360 degrees")
        self._scene = scene
        self._count = count
        self._swing = swing
        self._axis = axis
        self._center = scene.bounds.mean(axis=0)

    @property
    def count(self) -> int:
        return self._count

    @property
    def content(self) -> object:
        return self._scene, self._count, self._swing, self._axis

    def angle(self, frame: int) -> float:
        """Degrees by which the scene is turned in a frame."""
        share = frame / self._count
        return 360.0 * share if self._swing is None else self._swing / 2.0 * math.sin(2.0 * math.pi * share)

    def scene(self, frame: int) -> Scene:
        return self._scene.with_light_moved(self.display_turn(frame))

    def camera(self, frame: int, name: str | None) -> Camera | None:
        return None

    def display_turn(self, frame: int) -> Matrix:
        return inverse(self._turn(self.angle(frame)))

    def bounds(self) -> Bounds:
        return _find_box(self.swept())

    def placement(self, display: Display, options: PlacementOptions) -> Placement:
        """Where the display stands: fitted to all that the scene sweeps, or as a camera or the scene's mm have it.

        Raises
        ------
        UsageError, SceneError
            As :func:`lippmann.scene.placement.place`.
        """
        scene, notes = self._scene, list[str]()
        if isinstance(scene.description, MitsubaSource) and scene.has_lights and scene.description.environment is None:
            notes.append("the light sources of a Mitsuba scene turn with it")
        swept = self.swept()
        if options.place not in (None, "fit") or options.camera is not None:
            placement = place(
                _find_box(swept),
                display,
                cameras=scene.cameras,
                options=options,
                home_camera=scene.display_camera,
                is_unbounded=scene.is_unbounded,
                probe=partial(_find_depth, swept),
            )
            return replace(placement, warnings=(*notes, *placement.warnings))
        options = replace(face_viewer(scene.bounds, options, notes, scene.facing_cameras), place="fit")
        yaw, pitch, roll = options.turn
        # About the same axis, the yaw is but another beginning of the turn; fitted after it, the box is the least.
        turn = turn_about(_UP, self._center, yaw if abs(self._axis[1]) == 1.0 else 0.0)
        if abs(self._axis[1]) == 1.0:
            options = replace(options, turn=(0.0, pitch, roll))
        turned = transform_points(turn, swept)
        placement = place(
            _find_box(turned),
            display,
            options=options,
            bounds_in=lambda frame: _find_box(transform_points(frame, turned)),
            extreme_points=lambda: turned,
        )
        return replace(
            placement,
            world_from_display=inverse(turn) @ placement.world_from_display,
            warnings=(*notes, *placement.warnings),
        )

    def _turn(self, degrees: float) -> Matrix:
        return turn_about(self._axis, self._center, degrees)

    def swept(self) -> Bounds:
        """Points ``(n, 3)`` whose convex hull is about all that the scene ever fills, whichever frames there are."""
        reach = 360.0 if self._swing is None else self._swing
        angles = np.linspace(-reach / 2.0, reach / 2.0, 2 * math.ceil(reach / 2.0 / STEP) + 1)
        return swept_points(self._scene, self._axis, self._center, angles)


def open_turntable(
    scene: Scene,
    frames: int | None = None,
    *,
    swing: float | None = None,
    placement: PlacementOptions | None = None,
) -> Turntable:
    """A scene on a turntable, upright as the viewer sees it.

    Parameters
    ----------
    scene:
        What turns.
    frames:
        Of a whole turn, or of a swing to and fro; None for :data:`TURNTABLE_FRAMES`.
    swing:
        Degrees from one end of the swing to the other; None for a whole turn.
    placement:
        How the display will be placed: the axis of the scene that stands most upright before it is turned about.

    Raises
    ------
    UsageError, SceneError
        A number is out of range; the camera of the placement is not found.
    """
    axis = turning_axis(scene, placement or PlacementOptions())
    return Turntable(scene, TURNTABLE_FRAMES if frames is None else frames, swing=swing, axis=axis)


def _find_depth(points: Bounds, view: CameraView) -> VisibleDepth | None:
    """The depth that points in front of a camera fill; None if there are none."""
    depths = -transform_points(inverse(view.world_from_camera), points)[:, 2]
    ahead = depths[depths > 0.0]
    return VisibleDepth(float(ahead.min()), float(ahead.max())) if len(ahead) else None


def _find_box(points: Bounds) -> Bounds:
    return np.stack([points.min(axis=0), points.max(axis=0)])
