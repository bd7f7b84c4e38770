"""Scenes that come with the package, made by code: no file is read.

:func:`names` lists them, :func:`make` builds one. Nothing is built before it is asked for.
"""

from __future__ import annotations

from importlib import import_module

from lippmann.errors import SceneError
from lippmann.scene.description import SceneDescription

_MODULES = {"teapot": "teapot"}


def names() -> tuple[str, ...]:
    """Return the names of the bundled scenes."""
    return tuple(_MODULES)


def make(name: str) -> SceneDescription:
    """Build a bundled scene; the same name always gives the same scene.

    Raises
    ------
    SceneError
        No bundled scene has this name.
    """
    if name not in _MODULES:
        raise SceneError(f"no bundled scene is named {name!r}", rule=f"there are {', '.join(names())}")
    module = import_module(f"{__name__}.{_MODULES[name]}")
    scene: SceneDescription = module.describe()
    return scene
