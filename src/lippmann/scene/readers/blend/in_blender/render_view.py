"""Blender's scene as a render shows it: what is exported is what the viewport has, so that the viewport is set."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy


@contextmanager
def as_rendered(scene: Any, view_layer: Any) -> Iterator[None]:
    """Let the viewport show what renders show, at their levels of detail; at the end all is as it was."""
    changed: list[tuple[Any, str, Any]] = []

    def change(owner: Any, name: str, value: Any) -> None:
        before = getattr(owner, name)
        if before != value:
            setattr(owner, name, value)
            changed.append((owner, name, before))

    hidden = [item for item in view_layer.objects if item.hide_get(view_layer=view_layer)]
    layers = [layer for layer in _layers(view_layer.layer_collection) if layer.hide_viewport]
    try:
        for collection in bpy.data.collections:
            if collection.library is None:
                change(collection, "hide_viewport", collection.hide_render)
        for layer in layers:
            change(layer, "hide_viewport", False)
        for item in scene.objects:
            if item.library is not None:
                continue
            change(item, "hide_viewport", item.hide_render)
            for modifier in item.modifiers:
                change(modifier, "show_viewport", modifier.show_render)
                if modifier.type in ("SUBSURF", "MULTIRES"):
                    change(modifier, "levels", modifier.render_levels)
        for item in hidden:
            item.hide_set(False, view_layer=view_layer)
        view_layer.update()
        yield
    finally:
        for owner, name, before in reversed(changed):
            setattr(owner, name, before)
        for item in hidden:
            item.hide_set(True, view_layer=view_layer)
        view_layer.update()


def _layers(layer: Any) -> Iterator[Any]:
    yield layer
    for child in layer.children:
        yield from _layers(child)
