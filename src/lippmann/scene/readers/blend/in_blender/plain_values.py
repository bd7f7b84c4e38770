"""Blender's scene in the values that its glTF exporter understands: plain lights, pictures whose numbers are codes.

The exporter fails at a light with a temperature, and writes a picture's numbers as they stand, into a place where glTF
has sRGB codes (colours) or plain numbers (roughness, normals). All is as it was at the end.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import bpy
import numpy as np

from .render_view import Changes
from .working_space import rec709_from_scene
from .world import write_linear

#: Names of colour spaces, by their beginnings, whose numbers are in proportion to light, or no colours at all.
_LINEAR = ("Linear", "Non-Color", "Raw", "ACEScg", "ACES2065")
#: Of these, those whose numbers are taken as they stand, as numbers of the working space.
_BARE = ("Non-Color", "Raw")
#: Nodes that take in a picture's colour as numbers.
_NUMBER_NODES = ("NORMAL_MAP", "SEPARATE_COLOR", "SEPRGB", "BUMP", "DISPLACEMENT")


@contextmanager
def plain_values(remark: Any) -> Iterator[None]:
    """Let lights have no temperature and be normalised, and pictures be codes where colours are asked for.

    The lights' own values have been read before. ``remark`` takes a line on what cannot be told so.
    """
    changes, copies = Changes(), []
    try:
        for light in bpy.data.lights:
            for name, value in (("use_temperature", False), ("normalize", True)):
                if light.library is None and hasattr(light, name):
                    changes.set(light, name, value)
        for tree in _trees():
            for node in tree.nodes:
                if node.type != "TEX_IMAGE" or node.image is None or not node.image.size[0]:
                    continue
                copy = _convert_picture(node, remark)
                if copy is not None:
                    copies.append(copy)
                    changes.set(node, "image", copy)
        yield
    finally:
        changes.undo()
        for copy in copies:
            bpy.data.images.remove(copy)


def _trees() -> list[Any]:
    materials = [each.node_tree for each in bpy.data.materials if each.library is None and each.node_tree is not None]
    return materials + [group for group in bpy.data.node_groups if group.library is None and group.type == "SHADER"]


def _convert_picture(node: Any, remark: Any) -> Any:
    """A copy of the node's picture in the numbers that glTF has where the node is used; None where they are so."""
    image = node.image
    space = image.colorspace_settings.name
    is_linear = image.is_float or space.startswith(_LINEAR)
    uses = _uses(node, set())
    if uses == {"color", "number"}:
        remark(f"picture '{image.name}': a material takes its colours for colours and for numbers; one of both is off")
        return None
    is_color = uses == {"color"}
    if not uses or (not image.is_float and space.startswith("sRGB") if is_color else is_linear):
        return None
    is_bare = not is_color or image.is_float or space.startswith(_BARE)
    values = _pixels(image) if is_bare else _light_of(image)
    colors = values[:, : min(image.channels, 3)]
    if is_color and is_bare and image.channels >= 3:
        colors[...] = colors @ rec709_from_scene()
    if is_color and colors.max(initial=0.0) > 1.0:
        remark(f"picture '{image.name}': colours brighter than white are cut")
    colors[...] = encode(colors) if is_color else _decode(colors)
    # Blender's pictures have four channels, whatever files have.
    pixels = np.ones((len(values), 4), np.float32)
    pixels[:, : image.channels] = values
    if image.channels < 3:
        pixels[:, :3] = values[:, :1]
    copy = bpy.data.images.new(image.name, *image.size, alpha=image.channels == 4)
    copy.colorspace_settings.name = "sRGB" if is_color else "Non-Color"
    copy.pixels.foreach_set(pixels.ravel())
    copy.pack()
    return copy


def _pixels(image: Any) -> Any:
    """The numbers ``(pixels, channels)`` of a picture: of floats those of the working space, of bytes as stored."""
    values = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(-1, image.channels)


def _light_of(image: Any) -> Any:
    """Linear Rec. 709 ``(pixels, channels)`` of a picture of bytes in any colour space, as Blender converts it."""
    scene = bpy.data.scenes.new("lippmann picture")
    loaded = None
    try:
        write_linear(scene, "RGBA")
        with TemporaryDirectory() as folder:
            path = str(Path(folder, "picture.exr"))
            image.save_render(path, scene=scene)
            loaded = bpy.data.images.load(path)
            loaded.colorspace_settings.name = "Non-Color"
            return _pixels(loaded)[:, : image.channels]
    finally:
        bpy.data.scenes.remove(scene)
        if loaded is not None:
            bpy.data.images.remove(loaded)


def _uses(node: Any, visited: set[str]) -> set[str]:
    """The use of a node's colour: ``color``, ``number``, both or nothing."""
    visited.add(node.name)
    uses: set[str] = set()
    for link in (link for output in node.outputs if output.name != "Alpha" for link in output.links):
        target = link.to_node
        if target.type in _NUMBER_NODES:
            uses.add("number")
        elif any(output.type == "SHADER" for output in target.outputs) or target.type == "GROUP":
            uses.add("color" if link.to_socket.type == "RGBA" else "number")
        elif target.name not in visited:
            uses |= _uses(target, visited)
    return uses


# Blender's Python has nothing of the program's own.
def encode(values: Any) -> Any:
    """sRGB codes, 0 to 1, of linear values (IEC 61966-2-1)."""
    values = np.clip(values, 0.0, 1.0)
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1 / 2.4) - 0.055)


def _decode(codes: Any) -> Any:
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
