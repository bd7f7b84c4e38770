"""Blender's light sources in physical units, and where its cameras focus.

Blender gives watts. A point light of P watts has the radiant intensity P / (4 pi), and so has a spot along its axis,
whatever its cone; an area light of P watts and area A has the radiance P / (pi A); a sun gives its irradiance. Lights
that are not normalised by their size have the power, or irradiance, of a surface as bright as that.
"""

from __future__ import annotations

import math
from typing import Any

from .working_space import rec709

#: Half-angle of the thinnest cone, radians.
_THINNEST = 2e-3


def describe_lights(depsgraph: Any, remark: Any) -> dict[str, dict[str, Any]]:
    """Light sources as :func:`.additions.add_lights` takes them, by the names of their objects.

    ``remark`` takes a line on what is left out.
    """
    described: dict[str, dict[str, Any]] = {}
    for instance in depsgraph.object_instances:
        item = instance.object
        if item.type != "LIGHT" or item.name in described:
            continue
        light = _describe(item, remark)
        if light is not None:
            described[item.name] = light
    return described


def focus_distances(scene: Any) -> dict[str, float]:
    """Distance in front of each camera that has depth of field, by the camera's name, in Blender's units."""
    distances = {}
    for item in scene.objects:
        if item.type != "CAMERA" or not item.data.dof.use_dof:
            continue
        target = item.data.dof.focus_object
        distance = item.data.dof.focus_distance
        if target is not None:
            distance = -(item.matrix_world.normalized().inverted() @ target.matrix_world.translation).z
        if distance > 0.0:
            distances[item.name] = distance
    return distances


def camera_frames(scene: Any) -> dict[str, tuple[float, ...]]:
    """Extent of each camera's picture: its middle, right of the camera's axis and up, and half its width and height.

    Slopes; of orthographic cameras lengths in Blender's units. By the camera's name, for pictures of the scene's size.
    """
    frames = {}
    for item in scene.objects:
        if item.type != "CAMERA" or item.data.type not in ("PERSP", "ORTHO"):
            continue
        corners = item.data.view_frame(scene=scene)
        scale = -corners[0].z if item.data.type == "PERSP" else 1.0
        ends = [(min(corner[axis] for corner in corners), max(corner[axis] for corner in corners)) for axis in (0, 1)]
        middles = [(low + high) / 2.0 / scale for low, high in ends]
        frames[item.name] = (*middles, *((high - low) / 2.0 / scale for low, high in ends))
    return frames


def _describe(item: Any, remark: Any) -> dict[str, Any] | None:
    light = item.data
    color, factor = _color(light, item.name, remark)
    power = light.energy * 2.0 ** getattr(light, "exposure", 0.0) * factor
    is_normalized = getattr(light, "normalize", True)
    if power <= 0.0 or max(color) <= 0.0:
        if power < 0.0:
            remark(f"light '{item.name}': a light that takes light away is left out")
        return None
    if light.type == "AREA":
        return _area(item, color, power, remark, is_normalized=is_normalized)
    if light.type == "SUN":
        if not is_normalized:
            power *= math.pi * math.sin(min(light.angle, math.pi) / 2.0) ** 2
        return {"kind": "directional", "color": color, "strength": power}
    if not is_normalized:
        power *= 4.0 * math.pi * light.shadow_soft_size**2
    described: dict[str, Any] = {"kind": "point", "color": color, "strength": power / (4.0 * math.pi)}
    if light.type == "SPOT":
        outer = max(light.spot_size / 2.0, _THINNEST)
        described |= {"kind": "spot", "outer": outer, "inner": _inner(outer, light.spot_blend)}
        if light.use_square:
            remark(f"light '{item.name}': its square cone is read as a round one")
        scales = item.matrix_world.to_scale()
        if max(scales) - min(scales) > 1e-3 * max(map(abs, scales)):
            remark(f"light '{item.name}': its scale, which makes its cone wider or narrower, is not honoured")
    return described


def _inner(outer: float, blend: float) -> float:
    """Half-angle within which a spot has its whole strength, so that as much light leaves it as in Cycles.

    Cycles' edge is a smoothstep of the cosine of the angle from the axis, over the share ``blend`` of 1 - cos(outer):
    half of the light there is lost. Readers of glTF have an edge that falls evenly with the angle.
    """
    light = (1.0 - math.cos(outer)) * (1.0 - blend / 2.0)
    least, most = 0.0, outer * 0.999
    for _ in range(40):
        inner = (least + most) / 2.0
        if 1.0 - (math.sin(outer) - math.sin(inner)) / (outer - inner) < light:
            least = inner
        else:
            most = inner
    return least


def _area(item: Any, color: list[float], power: float, remark: Any, *, is_normalized: bool) -> dict[str, Any] | None:
    light = item.data
    width = light.size
    height = light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size
    is_round = light.shape in ("DISK", "ELLIPSE")
    scale_x, scale_y, _ = item.matrix_world.to_scale()
    area = abs(width * scale_x * height * scale_y) * (math.pi / 4.0 if is_round else 1.0)
    if area <= 0.0:
        remark(f"light '{item.name}': an area light without area is left out")
        return None
    if light.spread < math.pi * 0.999:
        remark(f"light '{item.name}': an area light's narrower spread is not honoured")
    radiance = power / (math.pi * area) if is_normalized else power / math.pi
    described = {"kind": "area", "color": color, "strength": radiance}
    return {**described, "width": width, "height": height, "is_round": is_round}


def _color(light: Any, name: str, remark: Any) -> tuple[list[float], float]:
    """Colour, and the factor on the power that the light's nodes bring."""
    color = [max(float(channel), 0.0) for channel in light.color]
    if getattr(light, "use_temperature", False):
        color = [own * float(warm) for own, warm in zip(color, light.temperature_color, strict=True)]
    color = rec709(color)
    tree = light.node_tree if light.use_nodes else None
    if tree is None:
        return color, 1.0
    emission = next((node for node in tree.nodes if node.bl_idname == "ShaderNodeEmission"), None)
    if emission is None or any(socket.is_linked for socket in emission.inputs):
        remark(f"light '{name}': its nodes are not read")
        return color, 1.0
    own = emission.inputs["Color"].default_value
    factor = float(emission.inputs["Strength"].default_value)
    return [channel * shade for channel, shade in zip(color, rec709(own), strict=True)], factor
