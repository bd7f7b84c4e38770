"""Scenes that move: animations of glTF, USD and Blender files, and flights of a camera through a Tachyon scene."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from lippmann.display import Display
from lippmann.errors import UsageError
from lippmann.options.light import LightOptions
from lippmann.options.option import changed_options, checked
from lippmann.options.placement import PlacementOptions
from lippmann.options.scene import SceneOptions
from lippmann.scene.matrices import Bounds
from lippmann.scene.parsing.far_origin import move_and_scale, traceable_from_world
from lippmann.scene.placement import Placement
from lippmann.scene.readers.load import open_moving, read_scene
from lippmann.scene.scene import Scene, check_description, find_camera, override_light
from lippmann.scene.values.description import Camera, Matrix, SceneDescription
from lippmann.scene.values.whitted_scene import CameraPose, ClassicScene
from lippmann.scene.whitted.world_frame import world_camera
from lippmann.sequences.tuning import TUNING

#: Frames of an animation per second where nothing is said.
FRAMES_PER_SECOND = 24.0

#: Nothing is asked for of a scene's file.
AS_IT_IS = SceneOptions()

#: Options of a scene's file that go with its motion.
_OF_MOVING = ("variants", "reader_options", "environment", "background", "single_scattering")


class Motion(ABC):
    """A scene frame by frame, counted from 0."""

    @property
    @abstractmethod
    def count(self) -> int:
        """How many frames there are; at least 1."""

    @property
    @abstractmethod
    def content(self) -> object:
        """All that any frame is made of, as plain values: what :func:`lippmann.journal.content_hash` takes."""

    @abstractmethod
    def scene(self, frame: int) -> Scene:
        """The scene as it is in a frame."""

    @abstractmethod
    def camera(self, frame: int, name: str | None) -> Camera | None:
        """The camera that the display follows; ``name`` asks for one of the scene's own. None: it stands still."""

    @abstractmethod
    def bounds(self) -> Bounds:
        """The box ``(2, 3)`` around all that is ever filled, world units; the same whichever frames are rendered."""

    def placement(self, display: Display, options: PlacementOptions) -> Placement | None:
        """Where a display stands that does not follow a camera, by the motion's own rule; None: it has none."""
        return None

    def display_turn(self, frame: int) -> Matrix:
        """The rigid 4x4 matrix by which the display goes round the scene in a frame, from its first place."""
        return np.eye(4)


class AnimatedFile(Motion):
    """The frames of a glTF animation, a USD stage or a Blender file; beyond its end the scene stands still.

    Parameters
    ----------
    fps:
        Frames per second of the animation's own time, which begins at 0.
    animation:
        Its name; ``None`` for the file's first.
    asked, light, allow_outside:
        As of :func:`lippmann.scene.readers.load.read_scene`.

    Raises
    ------
    SceneError
        As the reader of the file, and where nothing moves.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        fps: float = FRAMES_PER_SECOND,
        animation: str | None = None,
        asked: SceneOptions = AS_IT_IS,
        light: LightOptions | None = None,
        allow_outside: bool = False,
    ) -> None:
        for name in changed_options(asked):
            if name not in _OF_MOVING:
                raise UsageError("is for scenes at rest", parameter=name, fix="leave it out")
        if not (math.isfinite(fps) and fps > 0.0):
            raise UsageError(f"{fps:g} frames per second", parameter="fps", rule="a number above 0")
        self._file = Path(path).name
        self._fps = fps
        self._moving = open_moving(path, animation, asked, allow_outside=allow_outside)
        # Surroundings and background are read once, with the first frame.
        plain = replace(asked, variants=None, reader_options=None)
        beginning = self._moving.at(0.0)
        # What is moved to the origin or scaled is so by the same at all times.
        self._traceable_from_world = traceable_from_world(beginning)
        self._first = read_scene(move_and_scale(beginning, self._traceable_from_world), plain, light)
        #: The last frame that was asked for: its placement, its camera and its picture all ask for it.
        self._last: tuple[int, Scene] | None = None

    @property
    def count(self) -> int:
        return int(self._moving.duration * self._fps + TUNING.rounding) + 1

    @property
    def content(self) -> object:
        return self._first, self._moving.content, self._fps

    def scene(self, frame: int) -> Scene:
        if self._last is None or self._last[0] != frame:
            self._last = None  # two scenes may not fit the memory
            self._last = frame, self._at(frame / self._fps)
        return self._last[1]

    def camera(self, frame: int, name: str | None) -> Camera | None:
        return None if name is None else find_camera(self.scene(frame).cameras, name)

    def bounds(self) -> Bounds:
        boxes = [self._at(seconds).bounds for seconds in np.linspace(0.0, self._moving.duration, TUNING.moments)]
        return np.stack([np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]])

    def _at(self, seconds: float) -> Scene:
        physical = self._first.physical
        assert isinstance(physical, SceneDescription)
        description = replace(
            move_and_scale(check_description(self._moving.at(seconds), self._file), self._traceable_from_world),
            multiple_scattering=physical.multiple_scattering,
        )
        return replace(self._first, description=override_light(description, physical.environment, physical.background))


class Flight(Motion):
    """A camera that flies through a scene made for the classic light models, one pose a frame.

    Raises
    ------
    UsageError
        The scene has no form for the classic light models, whose coordinates the poses are in.
    """

    def __init__(self, scene: Scene, poses: Sequence[CameraPose]) -> None:
        if scene.classic is None:
            raise UsageError(
                f"'{scene.name}' is no scene that a camera path leads through",
                parameter="camera_path",
                rule="paths are for Tachyon (.dat) and NFF files and the bundled scenes",
            )
        self._scene = scene
        self._classic: ClassicScene = scene.classic
        self._poses = poses

    @property
    def count(self) -> int:
        return len(self._poses)

    @property
    def content(self) -> object:
        return self._scene, self._poses

    def scene(self, frame: int) -> Scene:
        return self._scene

    def camera(self, frame: int, name: str | None) -> Camera:
        if name is not None:
            raise UsageError(f"camera '{name}' beside a path", parameter="camera", rule="the path says where it stands")
        pose = self._poses[frame]
        own = replace(self._classic.camera, view=pose.view, up=pose.up, center=pose.center)
        return world_camera(replace(self._classic, camera=own), name="flight")

    def bounds(self) -> Bounds:
        return self._scene.bounds


@checked
def open_motion(
    source: str | Path,
    *,
    fps: float | None = None,
    animation: str | None = None,
    camera_path: Path | None = None,
    asked: SceneOptions = AS_IT_IS,
    light: LightOptions | None = None,
    allow_outside: bool = False,
) -> Motion:
    """What moves in a scene file.

    Parameters
    ----------
    fps, animation:
        Of a glTF file, USD stage or Blender file, see :class:`AnimatedFile`.
    camera_path:
        A Tachyon ``.cam`` file: the display flies along it.
    asked, light, allow_outside:
        As of :func:`lippmann.scene.readers.load.read_scene`.

    Raises
    ------
    SceneError
        A file is missing or damaged, or has no (such) animation.
    UsageError
        Nothing moves in a scene of this kind, or options contradict each other.
    """
    if camera_path is not None:
        for name, value in (("animation", animation), ("fps", fps)):
            if value is not None:
                raise UsageError("a camera path has one pose a frame", parameter=name, fix="leave it out")
        from lippmann.scene.readers.tachyon.reader import read_cam

        return Flight(read_scene(source, asked, light, allow_outside=allow_outside), read_cam(camera_path))
    return AnimatedFile(
        source,
        fps=FRAMES_PER_SECOND if fps is None else fps,
        animation=animation,
        asked=asked,
        light=light,
        allow_outside=allow_outside,
    )
