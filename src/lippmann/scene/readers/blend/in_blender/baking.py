"""Values of materials' nodes as constants or pictures, where Blender's exporter has no word for the nodes."""

from __future__ import annotations

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import bpy
import numpy as np
from mathutils import Color

from .node_reach import Reach, is_plain, reach
from .plain_values import encode
from .world import write_linear

#: Pixels across a map whose nodes name no picture, across the largest one, and across what a mean is of.
_PLAIN_WIDTH, _MOST_WIDTH, _MEAN_WIDTH = 1024, 2048, 32
#: Inputs whose pictures the exporter joins into one.
_JOINED = (("Base Color", "Alpha"), ("Metallic", "Roughness"), ("Emission Color",), ("Normal",))


class Studio:
    """A scene of its own in which Cycles renders what nodes give."""

    def __enter__(self) -> Studio:
        self._scene: Any = None
        return self

    def __exit__(self, *_: object) -> None:
        if self._scene is not None:
            bpy.data.scenes.remove(self._scene)
            bpy.data.objects.remove(self._camera)
            bpy.data.cameras.remove(self._lens)

    def mean(self, rewrite: Any, output: Any) -> tuple[float, ...]:
        """The mean colour that an output gives, over a ball as it is seen."""
        ball = bpy.data.meshes.new("lippmann ball")
        steps = np.linspace(0.0, math.pi, 17)
        around = np.linspace(0.0, 2.0 * math.pi, 32, endpoint=False)
        points = [(math.sin(a) * math.cos(b), math.sin(a) * math.sin(b), math.cos(a)) for a in steps for b in around]
        faces = [
            (32 * row + column, 32 * row + 32 + column, 32 * row + 32 + (column + 1) % 32, 32 * row + (column + 1) % 32)
            for row in range(16)
            for column in range(32)
        ]
        ball.from_pydata(points, [], faces)
        ball.shade_smooth()
        # All over a map, for nodes that one tells.
        ball.uv_layers.new().uv.foreach_set("vector", np.random.default_rng(0).random(2 * len(ball.loops), np.float32))
        pixels = self._render(rewrite, output, ball, _MEAN_WIDTH, _MEAN_WIDTH, 2.0)
        covered = pixels[pixels[:, :, 3] > 0.0]
        return tuple(float(channel) for channel in covered[:, :3].mean(axis=0))

    def picture(
        self, rewrite: Any, output: Any, layer: str, size: tuple[int, int], bounds: tuple[float, ...], step: float
    ) -> Any:
        """``(height, width, 3)``: an output over a part of a UV map, from its lower end up.

        ``bounds``: the least u and v, and the largest ones; ``step``: the length of a pixel on the object.
        """
        width, height = size
        plane = bpy.data.meshes.new("lippmann plane")
        x, y = width * step / 2.0, height * step / 2.0
        plane.from_pydata([(-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)], [], [(0, 1, 2, 3)])
        left, low, right, high = bounds
        plane.uv_layers.new(name=layer or "UVMap").uv.foreach_set(
            "vector", [left, low, right, low, right, high, left, high]
        )
        return self._render(rewrite, output, plane, width, height, 2.0 * max(x, y))[:, :, :3]

    def _render(self, rewrite: Any, output: Any, mesh: Any, width: int, height: int, extent: float) -> Any:
        if self._scene is None:
            self._set_up()
        tree = rewrite.tree
        emission, end = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputMaterial")
        ends = [node for node in tree.nodes if node.type == "OUTPUT_MATERIAL" and node.is_active_output]
        item = bpy.data.objects.new("lippmann baked", mesh)
        try:
            for node in ends:
                node.is_active_output = False
            end.is_active_output = True
            tree.links.new(output, emission.inputs["Color"])
            tree.links.new(emission.outputs[0], end.inputs["Surface"])
            mesh.materials.append(rewrite.material)
            self._scene.collection.objects.link(item)
            self._lens.ortho_scale, self._camera.location.z = extent, 2.0 * extent
            self._lens.clip_end = 10.0 * extent
            self._scene.render.resolution_x, self._scene.render.resolution_y = width, height
            with TemporaryDirectory() as folder:
                path = str(Path(folder, "baked.exr"))
                self._scene.render.filepath = path
                bpy.ops.render.render(scene=self._scene.name, write_still=True)
                return _read(path, width, height)
        finally:
            tree.nodes.remove(emission)
            tree.nodes.remove(end)
            for node in ends:
                node.is_active_output = True
            bpy.data.objects.remove(item)
            bpy.data.meshes.remove(mesh)

    def _set_up(self) -> None:
        self._scene = scene = bpy.data.scenes.new("lippmann bake")
        self._lens = bpy.data.cameras.new("lippmann bake")
        self._camera = scene.camera = bpy.data.objects.new("lippmann bake", self._lens)
        scene.collection.objects.link(self._camera)
        self._lens.type = "ORTHO"
        scene.render.engine = "CYCLES"
        scene.cycles.device, scene.cycles.samples = "CPU", 1
        scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
        # Rays go through the middles of pixels, which are the middles of a picture's own.
        scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
        scene.render.resolution_percentage = 100
        scene.render.film_transparent = True
        scene.render.use_compositing = scene.render.use_sequencer = False
        write_linear(scene, "RGBA")


def bake(rewrite: Any, principled: Any, studio: Studio, meshes: list[tuple[Any, int]]) -> None:
    """Let the inputs of a Principled BSDF be constants, or what the exporter understands.

    Parameters
    ----------
    rewrite:
        The material's, see :mod:`.surfaces`.
    meshes:
        Those that have the material: each mesh's name, and the material's place among the mesh's own.
    """
    color, strength = principled.inputs["Emission Color"], principled.inputs["Emission Strength"]
    if strength.is_linked:
        glow = rewrite.add("ShaderNodeMix", data_type="RGBA", blend_type="MULTIPLY")
        glow.inputs[0].default_value = 1.0
        for entry, value in ((glow.inputs[6], color), (glow.inputs[7], strength)):
            rewrite.give(entry, value.links[0].from_socket if value.is_linked else value.default_value)
        _set(rewrite, strength, 1.0)
        rewrite.give(color, glow.outputs[2])
    flat: dict[str, Reach] = {}
    for entry in principled.inputs:
        if not entry.is_linked or is_plain(entry):
            continue
        found = reach(entry.links[0].from_socket)
        is_joined = any(entry.name in names for names in _JOINED)
        if is_joined and found.is_flat:
            flat[entry.name] = found
            continue
        if entry.type == "VECTOR":
            rewrite.tree.links.remove(entry.links[0])
            if not found.is_constant:
                rewrite.remark(f"its {entry.name.lower()} is left out: {_reason(found)}")
            continue
        if not found.is_constant:
            rewrite.remark(f"its {entry.name.lower()} is shown in its mean: {_reason(found)}")
        mean = studio.mean(rewrite, entry.links[0].from_socket)
        _set(rewrite, entry, _to_scene(mean) if entry.type == "RGBA" else sum(mean) / 3.0)
    for names in _JOINED:
        baked = [flat[name] for name in names if name in flat]
        if baked:
            entries = [principled.inputs[name] for name in names]
            _bake_map(rewrite, entries, studio, _Map(rewrite, baked, meshes))


def _set(rewrite: Any, entry: Any, value: Any) -> None:
    for link in entry.links:
        rewrite.tree.links.remove(link)
    rewrite.give(entry, value)


def _reason(found: Reach) -> str:
    nodes = ", ".join(sorted(found.placed))
    if nodes:
        return f"glTF has no word for its nodes ({nodes})"
    return "several UV maps tell it" if len(found.maps) > 1 else "no picture of it is baked"


class _Map:
    """The part of a UV map that a picture is of, and the picture's size."""

    def __init__(self, rewrite: Any, found: list[Reach], meshes: list[tuple[Any, int]]) -> None:
        self.layer = next(iter(found[0].maps))
        images = [image.size for each in found for image in each.images if image.size[0]]
        left, low, right, high, self.density = _extent(meshes, self.layer)
        scale = max(each.scale for each in found)
        if all(each.repeats for each in found):
            left, right = (0.0, 1.0) if right - left > 1.0 or 0.0 <= left <= right <= 1.0 else (left, right)
            low, high = (0.0, 1.0) if high - low > 1.0 or 0.0 <= low <= high <= 1.0 else (low, high)
        self.bounds = (left, low, right, high)
        sizes = [max((size[axis] for size in images), default=_PLAIN_WIDTH) for axis in (0, 1)]
        spans = (right - left, high - low)
        width, height = (
            min(max(math.ceil(size * scale * span), 1), _MOST_WIDTH) for size, span in zip(sizes, spans, strict=True)
        )
        self.size = (width, height)
        if width < sizes[0] * scale * spans[0] * 0.5:
            rewrite.remark(f"its textures are baked over a map {spans[0]:.0f} squares wide, and coarse")


def _extent(meshes: list[tuple[Any, int]], layer: str) -> tuple[float, ...]:
    """The least u and v of faces of a material, the largest ones, and lengths on them by lengths of the map."""
    corners, lengths = [], []
    for name, place in meshes:
        mesh = bpy.data.meshes.get(name)
        found = None if mesh is None else mesh.uv_layers.get(layer) if layer else _active(mesh)
        if found is None or not len(mesh.polygons):
            continue
        uv = np.empty((len(mesh.loops), 2), np.float32)
        found.uv.foreach_get("vector", uv.ravel())
        counts = np.empty(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("loop_total", counts)
        owners = np.empty(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("material_index", owners)
        areas = np.empty(len(mesh.polygons), np.float32)
        mesh.polygons.foreach_get("area", areas)
        own = owners == place if (owners == place).any() else np.ones(len(owners), bool)
        parts = np.repeat(own, counts)
        starts = np.cumsum(counts) - counts
        following = np.arange(len(uv)) + 1
        following[starts + counts - 1] = starts
        cross = uv[:, 0] * uv[following, 1] - uv[following, 0] * uv[:, 1]
        covered = np.abs(np.add.reduceat(cross, starts))[own].sum() / 2.0
        if np.isfinite(uv[parts]).all():
            corners.append(uv[parts])
            lengths.append(math.sqrt(areas[own].sum() / covered) if covered > 0.0 else 1.0)
    if not corners:
        return 0.0, 0.0, 1.0, 1.0, 1.0
    joined = np.concatenate(corners)
    low, high = joined.min(axis=0), joined.max(axis=0)
    high = np.maximum(high, low + 1e-3)
    return *(float(value) for value in (*low, *high)), float(np.median(lengths))


def _active(mesh: Any) -> Any:
    return next((layer for layer in mesh.uv_layers if layer.active_render), None)


def _bake_map(rewrite: Any, entries: list[Any], studio: Studio, part: _Map) -> None:
    """Bake inputs into one picture, and link it to them."""
    first = entries[0]
    width, height = part.size
    pixels = np.ones((height, width, 4), np.float32)
    channels = {"Base Color": (0, 1, 2), "Alpha": (3,), "Roughness": (1,), "Metallic": (2,)}
    step = part.density * (part.bounds[2] - part.bounds[0]) / width
    is_color = first.type == "RGBA"
    strength = 1.0
    for entry in entries:
        output = entry.links[0].from_socket if entry.is_linked else None
        wanted = list(channels.get(entry.name, (0, 1, 2)))
        if output is None:
            pixels[:, :, wanted] = list(entry.default_value)[:3] if entry.type == "RGBA" else entry.default_value
            continue
        if entry.type == "VECTOR":
            output = _as_codes(rewrite, output)
        elif entry.type == "VALUE":
            output = _as_value(rewrite, output)
        values = studio.picture(rewrite, output, part.layer, part.size, part.bounds, step)
        pixels[:, :, wanted] = values[:, :, : len(wanted)]
    if first.name == "Emission Color":
        strength = max(float(pixels[:, :, :3].max()), 1.0)
        pixels[:, :, :3] /= strength
        entry = first.node.inputs["Emission Strength"]
        entry.default_value *= strength
    if is_color:
        pixels[:, :, :3] = encode(pixels[:, :, :3])
    image = rewrite.new_image(width, height, "sRGB" if is_color else "Non-Color")
    image.pixels.foreach_set(np.clip(pixels, 0.0, 1.0).ravel())
    image.pack()
    _link(rewrite, entries, image, part)


def _link(rewrite: Any, entries: list[Any], image: Any, part: _Map) -> None:
    texture = rewrite.add("ShaderNodeTexImage", image=image)
    place = rewrite.add("ShaderNodeUVMap", uv_map=part.layer)
    left, low, right, high = part.bounds
    if part.bounds == (0.0, 0.0, 1.0, 1.0):
        rewrite.give(texture.inputs["Vector"], place.outputs[0])
    else:
        mapping = rewrite.add("ShaderNodeMapping")
        scale = (1.0 / (right - left), 1.0 / (high - low), 1.0)
        mapping.inputs["Scale"].default_value = scale
        mapping.inputs["Location"].default_value = (-left * scale[0], -low * scale[1], 0.0)
        rewrite.give(mapping.inputs["Vector"], place.outputs[0])
        rewrite.give(texture.inputs["Vector"], mapping.outputs[0])
    numbers = None
    for entry in entries:
        if entry.name in ("Metallic", "Roughness"):
            numbers = numbers or rewrite.add("ShaderNodeSeparateColor")
            rewrite.give(numbers.inputs[0], texture.outputs["Color"])
            _set(rewrite, entry, numbers.outputs["Blue" if entry.name == "Metallic" else "Green"])
        elif entry.type == "VECTOR":
            normal = rewrite.add("ShaderNodeNormalMap", uv_map=part.layer)
            rewrite.give(normal.inputs["Color"], texture.outputs["Color"])
            _set(rewrite, entry, normal.outputs[0])
        elif entry.name != "Alpha" or entry.is_linked:
            _set(rewrite, entry, texture.outputs["Alpha" if entry.name == "Alpha" else "Color"])


def _as_codes(rewrite: Any, output: Any) -> Any:
    """A unit vector's components from 0 to 1."""
    node = rewrite.add("ShaderNodeVectorMath", operation="MULTIPLY_ADD")
    rewrite.give(node.inputs[0], output)
    node.inputs[1].default_value = node.inputs[2].default_value = (0.5, 0.5, 0.5)
    return node.outputs[0]


def _as_value(rewrite: Any, output: Any) -> Any:
    """A number, also where colours are linked to an input for one."""
    node = rewrite.add("ShaderNodeMath", operation="ADD")
    rewrite.give(node.inputs[0], output)
    node.inputs[1].default_value = 0.0
    return node.outputs[0]


def _read(path: str, width: int, height: int) -> Any:
    image = bpy.data.images.load(path)
    try:
        image.colorspace_settings.name = "Non-Color"
        values = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(values)
        return values.reshape(height, width, image.channels)
    finally:
        bpy.data.images.remove(image)


def _to_scene(color: tuple[float, ...]) -> tuple[float, ...]:
    """Linear Rec. 709 in the file's working space."""
    return tuple(Color(color).from_rec709_linear_to_scene_linear())
