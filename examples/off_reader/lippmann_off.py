"""OFF files (Object File Format): vertices, and polygons with a colour each."""

from itertools import pairwise
from pathlib import Path

import numpy as np

from lippmann.plugins import Instance, Material, Mesh, Reader, SceneDescription, SceneError


def read(path: Path, roughness: float = 0.5) -> SceneDescription:
    """A mesh for each colour, whose three numbers are sRGB codes, 0 to 255; polygons without one are grey."""
    lines = [line.partition("#")[0].split() for line in path.read_text(encoding="utf-8").splitlines()]
    rows = [line for line in lines if line]
    if not rows or rows[0] != ["OFF"]:
        raise SceneError("is no OFF file", where=path.name, rule="its first line is OFF")
    try:
        vertices, polygons = (int(word) for word in rows[1][:2])
        positions = np.array(rows[2 : 2 + vertices], dtype=np.float32).reshape(vertices, 3)
        faces: dict[tuple[int, ...], list[list[int]]] = {}
        for row in rows[2 + vertices : 2 + vertices + polygons]:
            count, *numbers = (int(word) for word in row)
            corners, color = numbers[:count], tuple(numbers[count : count + 3]) or (180, 180, 180)
            faces.setdefault(color, []).extend([corners[0], *pair] for pair in pairwise(corners[1:]))
    except (ValueError, IndexError) as error:
        raise SceneError(f"is damaged ({error})", where=path.name) from None
    materials = [Material(base_color=linear(color), roughness=roughness, double_sided=True) for color in faces]
    meshes = [
        Mesh(path.stem, positions, np.array(each, dtype=np.uint32), material=index)
        for index, each in enumerate(faces.values())
    ]
    return SceneDescription(path.stem, meshes, materials, [Instance(index, np.eye(4)) for index in range(len(meshes))])


def linear(codes: tuple[int, ...]) -> tuple[float, ...]:
    return tuple(((np.array(codes) / 255) ** 2.2).tolist())


READER = Reader((".off",), read, beginnings={b"OFF": ".off"}, up="y", settings={"roughness": 0.5})
