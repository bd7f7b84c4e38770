"""Lippmann renders 3D scenes into the native pixels of integral-imaging (light-field) displays.

::

    import lippmann

    lippmann.preview("model.glb", "looking-glass-portrait").pixels  # what the display will show, in seconds
    image = lippmann.render("model.glb", "looking-glass-portrait", placement={"turn": (20, 15)})
    image.save("model.png")  # the panel's native pixels
    image.replay((0.0, 0.0, 600.0))  # what an eye sees that is 600 mm in front of the panel

:func:`load_scene` takes a scene's own options (``up``, ``environment``, ``background``, ``light``), and
:func:`load_display` the names that :func:`list_displays` lists. Lengths are millimetres, +x to the right, +y up and +z
toward the viewer. Pictures are ``(H, W, 3)`` float32 linear RGB, row 0 on top. Every error is a
:class:`LippmannError` of one line.

Importing this package does no work: the names below are loaded when they are first used.
"""

from __future__ import annotations

import importlib

from lippmann import _version

TYPE_CHECKING = False  # typing takes as long to load as the interpreter

if TYPE_CHECKING:
    from typing import Any

    from lippmann.api import (
        load_scene,
        plan,
        preview,
        render,
        render_quilt,
        render_to_file,
        render_turntable,
        studio,
    )
    from lippmann.display import Display, LensArray, Panel, list_displays, load_display
    from lippmann.errors import LippmannError
    from lippmann.image import IntegralImage, read_picture
    from lippmann.options.light import LightOptions
    from lippmann.options.placement import PlacementOptions
    from lippmann.progress import Progress
    from lippmann.rendering.request.render_request import RenderRequest
    from lippmann.scene.scene import Scene
    from lippmann.viewing.focal_stack import focal_stack
    from lippmann.viewing.stereo import replay_stereo

__version__ = _version.VERSION

_HOME = {
    "load_scene": "lippmann.api",
    "studio": "lippmann.api",
    "plan": "lippmann.api",
    "preview": "lippmann.api",
    "render": "lippmann.api",
    "render_quilt": "lippmann.api",
    "render_to_file": "lippmann.api",
    "render_turntable": "lippmann.api",
    "Display": "lippmann.display",
    "LensArray": "lippmann.display",
    "Panel": "lippmann.display",
    "list_displays": "lippmann.display",
    "load_display": "lippmann.display",
    "LippmannError": "lippmann.errors",
    "IntegralImage": "lippmann.image",
    "read_picture": "lippmann.image",
    "LightOptions": "lippmann.options.light",
    "PlacementOptions": "lippmann.options.placement",
    "Progress": "lippmann.progress",
    "RenderRequest": "lippmann.rendering.request.render_request",
    "Scene": "lippmann.scene.scene",
    "focal_stack": "lippmann.viewing.focal_stack",
    "replay_stereo": "lippmann.viewing.stereo",
}

__all__ = [
    "Display",
    "IntegralImage",
    "LensArray",
    "LightOptions",
    "LippmannError",
    "Panel",
    "PlacementOptions",
    "Progress",
    "RenderRequest",
    "Scene",
    "__version__",
    "focal_stack",
    "list_displays",
    "load_display",
    "load_scene",
    "plan",
    "preview",
    "read_picture",
    "render",
    "render_quilt",
    "render_to_file",
    "render_turntable",
    "replay_stereo",
    "studio",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'lippmann' has no attribute '{name}'")
    return getattr(importlib.import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
