"""Scenes that come with the package, made by code: no file is read.

They are the six of the paper, of the same kind and count as its originals. Each is a module with its sizes
(``LAYOUT``), its view (``STAGE``) and its lights (``LIGHTS``) as data, and is made for the classic light models; the
teapot also has a form of its own for physically based light. Nothing is built before it is asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

from lippmann.errors import SceneError

if TYPE_CHECKING:
    from lippmann.scene.bundled.stage import Stage
    from lippmann.scene.values.description import SceneDescription
    from lippmann.scene.values.whitted_scene import ClassicScene

_MODULES = {
    "teapot": "teapot",
    "room": "room",
    "small-balls": "small_balls",
    "primitives": "primitives",
    "tree": "tree",
    "gears": "gears",
}
#: Modules of classic forms, of scenes whose own is for physically based light.
_CLASSIC = {"teapot": "copper_teapot"}


def names() -> tuple[str, ...]:
    """Return the names of the bundled scenes, in the paper's order."""
    return tuple(_MODULES)


def make(name: str) -> SceneDescription | ClassicScene:
    """Build a bundled scene in the form that it was made to be seen in; the same name always gives the same scene.

    A :class:`SceneDescription` where the scene has a form for physically based light (the teapot), a
    :class:`ClassicScene` for all others.

    Raises
    ------
    SceneError
        No bundled scene has this name.
    """
    module = _module(name)
    scene: SceneDescription | ClassicScene = module.describe() if hasattr(module, "describe") else module.make()
    return scene


def make_classic(name: str) -> ClassicScene:
    """Build a bundled scene for the classic light models.

    Raises
    ------
    SceneError
        No bundled scene has this name.
    """
    scene: ClassicScene = _module(name, _MODULES | _CLASSIC).make()
    return scene


def stage_of(name: str) -> Stage:
    """Return how a bundled scene stands in front of the display: its camera, and the placement in millimetres.

    Raises
    ------
    SceneError
        No bundled scene has this name.
    """
    place: Stage = _module(name).STAGE
    return place


def _module(name: str, modules: Mapping[str, str] = _MODULES) -> ModuleType:
    if name not in modules:
        raise SceneError.unknown("bundled scene", name, names())
    return import_module(f"{__name__}.{modules[name]}")
