"""Names for packages that add readers, displays, exports and integrators by entry points (``docs/how-to/extend.md``).

Importing this module loads none of them: each is loaded when it is first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from lippmann.runtime.plugins import Door, Plugin

if TYPE_CHECKING:
    from lippmann.display.formats.load import Displays
    from lippmann.errors import DisplayError, OutputError, PictureError, SceneError
    from lippmann.exchange.light_field import LightField
    from lippmann.exchange.registry import Film, Layout
    from lippmann.options.integrators import IntegratorFactory
    from lippmann.rendering.transport.integrator import RayCounts
    from lippmann.scene.readers.registry import Reader
    from lippmann.scene.values.description import (
        Camera,
        Environment,
        Image,
        Instance,
        Light,
        Material,
        Mesh,
        SceneDescription,
        Texture,
    )

_DESCRIPTION = (
    "Camera",
    "Environment",
    "Image",
    "Instance",
    "Light",
    "Material",
    "Mesh",
    "SceneDescription",
    "Texture",
)

_HOME = {
    "Reader": "lippmann.scene.readers.registry",
    **dict.fromkeys(_DESCRIPTION, "lippmann.scene.values.description"),
    "Displays": "lippmann.display.formats.load",
    "Layout": "lippmann.exchange.registry",
    "Film": "lippmann.exchange.registry",
    "LightField": "lippmann.exchange.light_field",
    "IntegratorFactory": "lippmann.options.integrators",
    "RayCounts": "lippmann.rendering.transport.integrator",
    **dict.fromkeys(("DisplayError", "OutputError", "PictureError", "SceneError"), "lippmann.errors"),
}

__all__ = [
    "Camera",
    "DisplayError",
    "Displays",
    "Environment",
    "Film",
    "Image",
    "Instance",
    "IntegratorFactory",
    "Layout",
    "Light",
    "LightField",
    "Material",
    "Mesh",
    "OutputError",
    "PictureError",
    "RayCounts",
    "Reader",
    "SceneDescription",
    "SceneError",
    "Texture",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'lippmann.plugins' has no attribute '{name}'")
    return getattr(importlib.import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)


def doors() -> tuple[Door[Any], ...]:
    """All kinds of extensions."""
    from lippmann.display.formats.load import displays
    from lippmann.exchange.registry import EXPORTS
    from lippmann.options.integrators import INTEGRATORS
    from lippmann.scene.readers.registry import READERS

    return READERS, displays(), EXPORTS, INTEGRATORS


def installed() -> list[tuple[str, Plugin[Any]]]:
    """The plugins of other packages, broken ones too, with their groups of entry points."""
    return [(door.kind.group, plugin) for door in doors() for plugin in door.plugins]
