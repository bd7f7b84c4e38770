"""Scenes that Mitsuba itself describes: an XML file, a dictionary, or a scene already loaded.

A :class:`MitsubaSource` is a plain value; its methods load the scene, and for that the engine must have been started.
The frame is Mitsuba's: right-handed, and +y up as far as the display is concerned.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.runtime.engine_lock import EngineOwner, exclusive
from lippmann.scene.mitsuba_plugins import check_plugins_of
from lippmann.scene.mitsuba_trial_child import NO_ROOM
from lippmann.scene.mitsuba_xml import MitsubaXml, read_mitsuba_xml
from lippmann.scene.parsing.files import NamedFiles
from lippmann.scene.values.description import Camera, Color, Environment

if TYPE_CHECKING:
    import mitsuba as mi

# Mitsuba's cameras look along +z with +x to the left; ours along -z with +x to the right.
_MITSUBA_FROM_CAMERA = np.diag([-1.0, 1.0, -1.0, 1.0])
_LONGEST_MESSAGE = 400
_TEXT_POSITION = re.compile(r"string \(line (\d+), col \d+\)")


@dataclass(frozen=True, eq=False)
class MitsubaSource(EngineOwner):
    """A scene in Mitsuba's own terms.

    ``content`` is an XML file that was read, a dictionary for ``mi.load_dict`` or a ``mi.Scene``. ``environment`` takes
    the place of the scene's own where given; ``background`` is the colour seen where nothing is hit.
    """

    name: str
    content: MitsubaXml | Mapping[str, object] | mi.Scene
    environment: Environment | None = None
    background: Color | None = None
    _loaded: dict[str, mi.Scene] = field(default_factory=dict, repr=False)

    @exclusive()
    def scene(self) -> mi.Scene:
        """The ``mi.Scene`` as described, loaded once per variant. ``environment`` is not in it: see :func:`with_sky`.

        Raises
        ------
        EngineError
            The engine cannot be started.
        SceneError
            Mitsuba refuses the scene, or a loaded one belongs to another variant.
        """
        variant = _variant()
        if variant not in self._loaded:
            self._loaded[variant] = self._load(variant)
        return self._loaded[variant]

    @property
    def is_borrowed(self) -> bool:
        """Whether the scene was loaded by whoever passed it here, and stays theirs."""
        return not isinstance(self.content, MitsubaXml | Mapping)

    @exclusive()
    def bounds(self) -> NDArray[np.float64]:
        """Lowest and highest corner ``(2, 3)`` of the box around all shapes.

        Raises
        ------
        SceneError
            There are no shapes.
        """
        box = self.scene().bbox()
        if not box.valid():
            raise SceneError("the scene has no geometry", where=self.name, rule="there must be at least one shape")
        return np.stack([np.array(box.min, np.float64).ravel(), np.array(box.max, np.float64).ravel()])

    @exclusive()
    def cameras(self) -> tuple[Camera, ...]:
        """The perspective (also thin-lens) and orthographic sensors; other kinds cannot place a display."""
        sensors = enumerate(self.scene().sensors())
        cameras = (_camera(sensor, sensor.id() or f"sensor_{number}") for number, sensor in sensors)
        return tuple(camera for camera in cameras if camera is not None)

    @exclusive()
    def has_lights(self) -> bool:
        """Whether the scene has any emitter."""
        return bool(self.scene().emitters())

    def _load(self, variant: str) -> mi.Scene:
        import mitsuba as mi

        content = self.content
        if not isinstance(content, MitsubaXml | Mapping):
            if content.variant_name() != variant:
                raise SceneError(
                    f"the Mitsuba scene was loaded under '{content.variant_name()}'",
                    where=self.name,
                    rule=f"the engine runs '{variant}'",
                    fix="load it after mitsuba.set_variant of that name",
                )
            return _with_boxes(content)
        try:
            if isinstance(content, Mapping):
                check_plugins_of(content, self.name)
                loaded = mi.load_dict(dict(content))
            else:
                text = content.text()
                from lippmann.scene.mitsuba_trial import try_scene

                try_scene(text, variant, self.name)
                loaded = mi.load_string(text)
        except SceneError:
            raise
        except Exception as error:  # noqa: BLE001  # of all kinds, for a misspelt word
            if isinstance(error, MemoryError) or NO_ROOM.search(str(error)):
                raise SceneError("the scene needs more memory than there is", where=self.name) from None
            message = " ".join(self._with_origins(str(error)).split())[:_LONGEST_MESSAGE]
            raise SceneError(f"Mitsuba refuses the scene: {message}", where=self.name) from None
        if not isinstance(loaded, mi.Scene):
            raise SceneError(f"holds a Mitsuba {type(loaded).__name__}", where=self.name, rule="it must be a scene")
        return _with_boxes(loaded)

    def _with_origins(self, message: str) -> str:
        """A message of Mitsuba's, its lines of the text replaced by the files and lines that they came from."""
        if not isinstance(self.content, MitsubaXml):
            return message
        content = self.content
        return _TEXT_POSITION.sub(lambda match: content.origin(int(match[1])), message)


def read_mitsuba(path: Path, *, files: NamedFiles | None = None) -> MitsubaSource:
    """A Mitsuba XML scene, read and checked but not yet loaded.

    Raises
    ------
    SceneError
        As of :func:`~lippmann.scene.mitsuba_xml.read_mitsuba_xml`.
    """
    return MitsubaSource(path.stem, read_mitsuba_xml(path, files))


def with_sky(scene: mi.Scene, sky: mi.Emitter) -> mi.Scene:
    """A ``mi.Scene`` of the same shapes and light sources, with ``sky`` as the only environment."""
    return _rebuilt(scene, sky)


def _with_boxes(scene: mi.Scene) -> mi.Scene:
    """A scene that knows the boxes of all its shapes.

    Rectangles of one material, which Mitsuba merges into a mesh, have none then: the scene ends where its other shapes
    end.
    """
    boxless = [shape for shape in scene.shapes() if shape.is_mesh() and not shape.bbox().valid()]
    for shape in boxless:
        shape.recompute_bbox()
    return _rebuilt(scene, scene.environment()) if boxless else scene


def _rebuilt(scene: mi.Scene, environment: mi.Emitter | None) -> mi.Scene:
    import mitsuba as mi

    parts: dict[str, object] = {"type": "scene"}
    if environment is not None:
        parts["environment"] = environment
    # Shape groups are no shapes of a scene, but their instances need them beside them.
    nodes = mi.traverse(scene).hierarchy
    groups = [node for node in nodes if node.class_name().startswith("ShapeGroup")]
    parts |= {f"group_{number}": group for number, group in enumerate(groups)}
    parts |= {f"shape_{number}": shape for number, shape in enumerate(scene.shapes())}
    emitters = [
        emitter
        for emitter in scene.emitters()
        if not emitter.is_environment() and not mi.has_flag(emitter.flags(), mi.EmitterFlags.Surface)
    ]
    parts |= {f"emitter_{number}": emitter for number, emitter in enumerate(emitters)}
    parts |= {f"sensor_{number}": sensor for number, sensor in enumerate(scene.sensors())}
    return mi.load_dict(parts)


def _variant() -> str:
    """The variant that runs; the engine is started by itself where none does."""
    import sys

    from lippmann.runtime import engine

    mitsuba = sys.modules.get("mitsuba")
    variant = mitsuba.variant() if mitsuba is not None else None
    return variant if isinstance(variant, str) else engine.start().variant


def _camera(sensor: mi.Sensor, name: str) -> Camera | None:
    import mitsuba as mi

    world_from_camera = np.array(sensor.world_transform().matrix, np.float64).reshape(4, 4) @ _MITSUBA_FROM_CAMERA
    width, height = (int(value) for value in sensor.film().size())
    aspect = width / height
    parameters = mi.traverse(sensor)
    if "x_fov" in parameters:
        half_width = np.tan(np.radians(_number(parameters["x_fov"])) / 2.0)
        focus = _number(parameters["focus_distance"]) if "focus_distance" in parameters else None
        fov_y = float(2.0 * np.arctan(half_width / aspect))
        return Camera(name, world_from_camera, fov_y=fov_y, aspect=aspect, focus_distance=focus)
    if "Orthographic" in sensor.class_name():
        # The picture spans [-1, 1] across, in units of the transform's own scale along each axis.
        across, up = (float(np.linalg.norm(world_from_camera[:3, axis])) for axis in (0, 1))
        return Camera(name, world_from_camera, height=2.0 * up / aspect, aspect=aspect * across / up)
    return None


def _number(value: mi.Float | float) -> float:
    return float(np.asarray(value).ravel()[0])
