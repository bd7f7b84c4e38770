"""Blender's scene as a render shows it: what is exported is what the viewport has, so that the viewport is set."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy


class Changes:
    """Values of Blender's data that are set for a while."""

    def __init__(self) -> None:
        self._before: list[tuple[Any, str, Any]] = []

    def set(self, owner: Any, name: str, value: Any) -> None:
        """Set a value, and keep the one before."""
        before = getattr(owner, name)
        if before != value:
            setattr(owner, name, value)
            self._before.append((owner, name, before))

    def undo(self) -> None:
        """Set all values as they were."""
        for owner, name, before in reversed(self._before):
            setattr(owner, name, before)


@contextmanager
def as_rendered(scene: Any, view_layer: Any) -> Iterator[None]:
    """Let the viewport show what renders show, at their levels of detail; at the end all is as it was."""
    changes = Changes()
    hidden = [item for item in view_layer.objects if item.hide_get(view_layer=view_layer)]
    layers = [layer for layer in _layers(view_layer.layer_collection) if layer.hide_viewport]
    try:
        for collection in bpy.data.collections:
            if collection.library is None:
                changes.set(collection, "hide_viewport", collection.hide_render)
        for layer in layers:
            changes.set(layer, "hide_viewport", False)
        changes.set(scene.render, "simplify_subdivision", scene.render.simplify_subdivision_render)
        for item in scene.objects:
            if item.library is not None:
                continue
            changes.set(item, "hide_viewport", item.hide_render)
            for modifier in item.modifiers:
                changes.set(modifier, "show_viewport", modifier.show_render)
                if modifier.type in ("SUBSURF", "MULTIRES"):
                    changes.set(modifier, "levels", modifier.render_levels)
        for item in hidden:
            item.hide_set(False, view_layer=view_layer)
        view_layer.update()
        yield
    finally:
        changes.undo()
        for item in hidden:
            item.hide_set(True, view_layer=view_layer)
        view_layer.update()


def _layers(layer: Any) -> Iterator[Any]:
    yield layer
    for child in layer.children:
        yield from _layers(child)
