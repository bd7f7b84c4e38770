"""SMF files (Simple Model Format) as QSlim has them: vertices, and polygons with a colour each."""

from collections import defaultdict
from itertools import pairwise
from pathlib import Path

import numpy as np

from lippmann.plugins import Instance, Material, Mesh, Reader, SceneDescription, SceneError


def read(path: Path, roughness: float = 0.5) -> SceneDescription:
    """A mesh for each colour, three sRGB-coded numbers from 0 to 1; polygons without one are grey."""
    positions, polygons, colors = [], [], []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        word, _, rest = line.partition(" ")
        try:
            if word == "v":
                positions.append([float(each) for each in rest.split()])
            elif word == "f":
                polygons.append([int(each) - 1 for each in rest.split()])
            elif word == "c":
                colors.append(tuple(float(each) for each in rest.split()))
        except ValueError as error:
            raise SceneError(f"is damaged ({error})", where=f"{path.name}, line {number}") from None
    faces = defaultdict(list)
    for corners, color in zip(polygons, colors or [(0.7, 0.7, 0.7)] * len(polygons), strict=True):
        faces[color] += [[corners[0], *pair] for pair in pairwise(corners[1:])]
    materials = [Material(base_color=linear(color), roughness=roughness, double_sided=True) for color in faces]
    vertices = np.array(positions, np.float32)
    meshes = [Mesh("", vertices, np.array(each, np.uint32), material) for material, each in enumerate(faces.values())]
    return SceneDescription(path.stem, meshes, materials, [Instance(index, np.eye(4)) for index in range(len(meshes))])


def linear(codes: tuple[float, ...]) -> tuple[float, ...]:
    return tuple((np.array(codes) ** 2.2).tolist())


READER = Reader((".smf",), read, beginnings={b"#$SMF": ".smf"}, up="y", settings={"roughness": 0.5})
