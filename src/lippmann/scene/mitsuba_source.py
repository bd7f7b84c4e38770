"""Scenes that Mitsuba itself describes: an XML file, a dictionary, or a scene already loaded.

A :class:`MitsubaSource` is a plain value; its methods load the scene, and for that the engine must have been started.
The frame is Mitsuba's: right-handed, and +y up as far as the display is concerned.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import EngineError, SceneError
from lippmann.scene.description import Camera, Color, Environment
from lippmann.scene.resources import read_bytes, resolve

# Mitsuba's cameras look along +z with +x to the left; ours along -z with +x to the right.
_MITSUBA_FROM_CAMERA = np.diag([-1.0, 1.0, -1.0, 1.0])
_LONGEST_MESSAGE = 400


@dataclass(frozen=True, eq=False)
class MitsubaSource:
    """A scene in Mitsuba's own terms.

    ``content`` is the path of an XML file, a dictionary for ``mi.load_dict`` or a ``mi.Scene``. ``environment`` takes
    the place of the scene's own where given; ``background`` is the colour seen where nothing is hit.
    """

    name: str
    content: Any
    environment: Environment | None = None
    background: Color | None = None
    _loaded: dict[str, Any] = field(default_factory=dict, repr=False)

    def scene(self) -> Any:
        """The ``mi.Scene`` as described, loaded once per variant. ``environment`` is not in it: see :func:`with_sky`.

        Raises
        ------
        EngineError
            The engine has not been started.
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
        return not isinstance(self.content, Path | Mapping)

    def bounds(self) -> NDArray[np.float64]:
        """Lowest and highest corner ``(2, 3)`` of the box around all shapes.

        Raises
        ------
        SceneError
            There are no shapes.
        """
        found = self.scene().bbox()
        if not found.valid():
            raise SceneError("the scene has no geometry", where=self.name, rule="there must be at least one shape")
        return np.stack([np.array(found.min, np.float64).ravel(), np.array(found.max, np.float64).ravel()])

    def cameras(self) -> tuple[Camera, ...]:
        """The perspective (also thin-lens) and orthographic sensors; other kinds cannot place a display."""
        sensors = enumerate(self.scene().sensors())
        found = (_camera(sensor, sensor.id() or f"sensor_{number}") for number, sensor in sensors)
        return tuple(camera for camera in found if camera is not None)

    def has_lights(self) -> bool:
        """Whether the scene has any emitter."""
        return bool(self.scene().emitters())

    def _load(self, variant: str) -> Any:
        import mitsuba as mi

        if self.is_borrowed:
            if self.content.variant_name() != variant:
                raise SceneError(
                    f"the Mitsuba scene was loaded under '{self.content.variant_name()}'",
                    where=self.name,
                    rule=f"the engine runs '{variant}'",
                    fix="load it after mitsuba.set_variant of that name",
                )
            return self.content
        try:
            if isinstance(self.content, Path):
                loaded = mi.load_file(str(self.content))
            else:
                loaded = mi.load_dict(dict(self.content))
        except (RuntimeError, TypeError, ValueError) as error:
            message = " ".join(str(error).split())[:_LONGEST_MESSAGE]
            raise SceneError(f"Mitsuba refuses the scene: {message}", where=self.name) from None
        if not isinstance(loaded, mi.Scene):
            raise SceneError(f"holds a Mitsuba {type(loaded).__name__}", where=self.name, rule="it must be a scene")
        return loaded


def read_mitsuba(path: Path, *, allow_outside: bool = False) -> MitsubaSource:
    """A Mitsuba XML scene, looked at but not yet loaded.

    Raises
    ------
    SceneError
        The file is missing, is no XML or no scene, or names a file that is not there.
    """
    _check_xml(path, allow_outside, set())
    return MitsubaSource(path.stem, path)


def with_sky(scene: Any, emitter: Any) -> Any:
    """A ``mi.Scene`` of the same shapes and lamps, with ``emitter`` as the only environment."""
    import mitsuba as mi

    parts: dict[str, Any] = {"type": "scene", "environment": emitter}
    parts |= {f"shape_{number}": shape for number, shape in enumerate(scene.shapes())}
    lamps = [
        lamp
        for lamp in scene.emitters()
        if not lamp.is_environment() and not mi.has_flag(lamp.flags(), mi.EmitterFlags.Surface)
    ]
    parts |= {f"lamp_{number}": lamp for number, lamp in enumerate(lamps)}
    parts |= {f"sensor_{number}": sensor for number, sensor in enumerate(scene.sensors())}
    return mi.load_dict(parts)


def _variant() -> str:
    import sys

    mitsuba = sys.modules.get("mitsuba")
    variant = mitsuba.variant() if mitsuba is not None else None
    if not isinstance(variant, str):
        raise EngineError("the engine has not been started", fix="call lippmann.engine.start() first")
    return variant


def _check_xml(path: Path, allow_outside: bool, seen: set[Path]) -> None:
    seen.add(path.resolve())
    data = read_bytes(path)
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise SceneError(
            f"is no well-formed XML ({error})", where=f"{path.name}:{error.position[0]}", fix="is the file cut short?"
        ) from None
    except (LookupError, ValueError) as error:  # of the encoding that it names
        raise SceneError(f"cannot be decoded ({error})", where=path.name, rule="XML is UTF-8") from None
    if root.tag != "scene":
        raise SceneError(f"is XML of a '{root.tag[:40]}'", where=path.name, rule="a Mitsuba file holds a 'scene'")
    if root.find(".//path") is not None:
        return  # the file brings search paths of its own, which only Mitsuba follows
    for element in root.iter():
        is_include = element.tag == "include"
        if not is_include and element.get("name") != "filename":
            continue
        name = element.get("filename" if is_include else "value", "")
        if not name or "$" in name:  # a parameter, filled in by Mitsuba
            continue
        found = resolve(path.parent, name, where=path.name, what="file", allow_outside=allow_outside)
        if found != path.parent / name:
            raise SceneError(f"file '{name}' is not there", where=path.name)
        if is_include and found.resolve() not in seen:
            _check_xml(found, allow_outside, seen)


def _camera(sensor: Any, name: str) -> Camera | None:
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
        # The picture spans [-1, 1] across, in units of the transform's own scale.
        height_in_world = 2.0 * float(np.linalg.norm(world_from_camera[:3, 0])) / aspect
        return Camera(name, world_from_camera, height=height_in_world, aspect=aspect)
    return None


def _number(value: Any) -> float:
    return float(np.asarray(value).ravel()[0])
