"""What a socket of a material's nodes depends on, and whether Blender's exporter understands it as it stands."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

#: Nodes whose values change with the place on an object, the object or the direction that it is seen from.
_PLACED = frozenset(
    {"AMBIENT_OCCLUSION", "ATTRIBUTE", "BEVEL", "CAMERA", "FRESNEL", "HAIR_INFO", "LAYER_WEIGHT", "NEW_GEOMETRY"}
    | {"OBJECT_INFO", "PARTICLE_INFO", "POINT_INFO", "RAYCAST", "SCRIPT", "TANGENT", "TEX_ENVIRONMENT", "TEX_SKY"}
    | {"UVALONGSTROKE", "VERTEX_COLOR", "VOLUME_INFO", "WIREFRAME"}
)


@dataclass
class Reach:
    """What a socket depends on: nodes, pictures, names of UV maps ("" for the active one), the largest scale of UV."""

    nodes: list[Any] = field(default_factory=list)
    images: list[Any] = field(default_factory=list)
    maps: set[str] = field(default_factory=set)
    placed: set[str] = field(default_factory=set)
    scale: float = 1.0
    repeats: bool = True

    @property
    def is_constant(self) -> bool:
        """Whether it has one value."""
        return not (self.images or self.maps or self.placed)

    @property
    def is_flat(self) -> bool:
        """Whether one UV map tells it."""
        return not self.placed and len(self.maps) == 1


def reach(socket: Any) -> Reach:
    """All that an output, in the material's own tree, depends on; groups are entered."""
    found, visited = Reach(), set()
    waiting: list[tuple[Any, tuple[Any, ...]]] = [(socket, ())]
    while waiting:
        output, path = waiting.pop()
        node = output.node
        key = (output.as_pointer(), *(group.as_pointer() for group in path))
        if key in visited:
            continue
        visited.add(key)
        entries: Any = node.inputs
        if node.type == "GROUP_INPUT" and path:
            entries, path = [by_identifier(path[-1].inputs, output.identifier)], path[:-1]
        elif node.type == "GROUP" and node.node_tree is not None:
            entries, path = [by_identifier(group_output(node.node_tree).inputs, output.identifier)], (*path, node)
        else:
            found.nodes.append(node)
            _add(found, node, output)
        waiting += [(link.from_socket, path) for entry in entries if entry is not None for link in entry.links]
    return found


def by_identifier(sockets: Any, identifier: str) -> Any:
    """The socket of an identifier; None if there is none."""
    return next((socket for socket in sockets if socket.identifier == identifier), None)


def group_output(tree: Any) -> Any:
    """The output of a group of nodes."""
    outputs = [node for node in tree.nodes if node.type == "GROUP_OUTPUT"]
    return next((node for node in outputs if node.is_active_output), outputs[0])


def is_plain(entry: Any) -> bool:
    """Whether the exporter understands an input: a picture, vertex colours, one times a constant, no more."""
    if not entry.is_linked:
        return True
    source = _source(entry)
    if source is None:
        return False
    node = source.node
    if entry.name.endswith("Normal"):
        strength = node.inputs.get("Strength")
        return bool(
            node.type == "NORMAL_MAP"
            and node.space == "TANGENT"
            and not strength.is_linked
            and _is_picture(_source(node.inputs["Color"]))
        )
    if node.type == "MATH" and entry.name == "Alpha" and node.operation == "ROUND":
        return is_plain(node.inputs[0])
    factors = _factors(node)
    if factors:
        linked = [factor for factor in factors if factor.is_linked]
        return len(linked) == 1 and _is_part(_source(linked[0]))
    return _is_part(source)


def _add(found: Reach, node: Any, output: Any) -> None:
    kind, vector = node.type, node.inputs.get("Vector")
    if kind in _PLACED or (kind == "TEX_COORD" and output.name != "UV"):
        found.placed.add(node.bl_label)
    elif kind == "TEX_COORD":
        found.maps.add("")
    elif kind == "UVMAP":
        found.maps.add(node.uv_map)
    elif kind == "TEX_IMAGE":
        if node.image is not None:
            found.images.append(node.image)
        if node.projection != "FLAT":
            found.placed.add(node.bl_label)
        elif not vector.is_linked:
            found.maps.add("")
        found.repeats &= node.extension in ("REPEAT", "MIRROR")
    elif kind.startswith("TEX_"):
        found.repeats = False
        if vector is not None and not vector.is_linked:
            found.placed.add(node.bl_label)
    elif kind == "MAPPING":
        values = [node.inputs[name] for name in ("Scale", "Rotation")]
        if any(value.is_linked for value in values):
            found.repeats = False
            return
        scale, turn = (tuple(value.default_value) for value in values)
        found.scale = max(found.scale, *(abs(each) for each in scale[:2]))
        found.repeats &= all(each == round(each) for each in scale[:2]) and not any(turn)


def _source(entry: Any) -> Any:
    """The output that an input is linked to, through reroutes; None if it is not."""
    while entry.is_linked:
        source = entry.links[0].from_socket
        if source.node.mute:
            return None
        if source.node.type != "REROUTE":
            return source
        entry = source.node.inputs[0]
    return None


def _factors(node: Any) -> list[Any]:
    """Inputs that a node multiplies, as the exporter knows it."""
    if node.type == "MATH" and node.operation == "MULTIPLY" and not node.use_clamp:
        return list(node.inputs[:2])
    if node.type == "MIX" and node.data_type == "RGBA" and node.blend_type == "MULTIPLY":
        factor = node.inputs[0]
        if not factor.is_linked and factor.default_value == 1.0:
            return list(node.inputs[6:8])
    return []


def _is_part(source: Any) -> bool:
    if source is None:
        return False
    if source.node.type in ("SEPARATE_COLOR", "SEPRGB"):
        source = _source(source.node.inputs[0])
        return source is not None and source.name == "Color" and _is_picture(source)
    if source.node.type == "VERTEX_COLOR":
        return True
    return source.node.type in ("RGB", "VALUE") or _is_picture(source)


def _is_picture(source: Any) -> bool:
    if source is None or source.node.type != "TEX_IMAGE" or source.node.projection != "FLAT":
        return False
    place = _source(source.node.inputs["Vector"])
    if place is not None and place.node.type == "MAPPING":
        node = place.node
        values = [node.inputs[name] for name in ("Location", "Rotation", "Scale") if name in node.inputs]
        if any(value.is_linked for value in values) or any(tuple(node.inputs["Rotation"].default_value)[:2]):
            return False
        place = _source(node.inputs["Vector"])
        if place is None:
            return False
    return not source.node.inputs["Vector"].is_linked or (
        place is not None and (place.node.type == "UVMAP" or (place.node.type == "TEX_COORD" and place.name == "UV"))
    )
