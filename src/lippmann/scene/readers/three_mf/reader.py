"""Reader of 3MF packages (``.3mf``), as slicers and programs for 3D printing write them: upright on the build plate."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.parsing.files import decode_image
from lippmann.scene.parsing.points_lines import as_mesh
from lippmann.scene.parsing.texture_maps import unit
from lippmann.scene.parsing.vertex_colors import COLORED, GREY, GREY_CODES, linear_colors, material_of
from lippmann.scene.readers.three_mf.parts import Beam, Package, Part, Placed, Shape, Triangle
from lippmann.scene.readers.three_mf.slicer_project import Piece, painted, read_project
from lippmann.scene.values.description import Image, Instance, Material, Mesh, SceneDescription, Texture, Wrap

#: Objects within others, and copies of objects, at most.
_DEEPEST, _MOST = 16, 1 << 20
_NOT_PRINTED = "modifiers, supports and parts that the slicer cuts away are not shown"


def read_three_mf(path: Path) -> SceneDescription:
    """Read what a package says is to be built, in millimetres, with its colours and pictures.

    Raises
    ------
    SceneError
        The file is missing or no 3MF package, a part of it is missing or damaged, or nothing is to be built.
    """
    package = Package(path)
    try:
        return _Reader(package, path.stem).read()
    finally:
        package.close()


class _Reader:
    def __init__(self, package: Package, name: str) -> None:
        self._package, self._name = package, name
        self._notes: dict[str, None] = {}
        self._meshes: list[Mesh] = []
        self._materials: list[Material] = []
        self._images: dict[str, Image] = {}
        self._meshes_of_part: dict[tuple[str, str, int], list[int]] = {}
        self._places: dict[int, list[NDArray[np.float64]]] = {}
        self._copies = 0

    def read(self) -> SceneDescription:
        """The scene."""
        start = self._package.part(self._package.start())
        self._project = read_project(self._package)
        if self._project.plates > 1:
            self._notes[f"the {self._project.plates} plates of the slicer's project lie side by side"] = None
        for item in start.build:
            piece = self._project.objects.get(item.number, Piece())
            self._place(item, np.diag([start.scale, start.scale, start.scale, 1.0]), 0, piece)
        if not self._places:
            raise self._error("; ".join(["has nothing to build that is made of triangles or beams", *self._notes]))
        return SceneDescription(
            self._name,
            self._meshes,
            self._materials,
            [Instance(mesh, np.stack(worlds)) for mesh, worlds in self._places.items()],
            notes=[*self._notes],
            up=(0.0, 0.0, 1.0),
        )

    def _place(self, placed: Placed, world: NDArray[np.float64], depth: int, piece: Piece) -> None:
        part = self._package.part(placed.part)
        self._notes |= {f"{what} are not shown": None for what in part.unread}
        shape = part.shapes.get(placed.number)
        self._copies += 1
        if shape is None or depth > _DEEPEST or self._copies > _MOST:
            what = f"has no object {placed.number}" if shape is None else "places objects within objects without end"
            raise self._error(f"'{placed.part}' {what}")
        world = world @ placed.matrix
        for component in shape.components:
            own = self._project.parts.get((placed.number, component.number), piece)
            if own.is_printed:
                self._place(component, world, depth + 1, own)
            else:
                self._notes[_NOT_PRINTED] = None
        key = placed.part, placed.number, piece.filament
        if key not in self._meshes_of_part:
            filaments = self._filaments(placed.number, len(shape.triangles), piece)
            self._meshes_of_part[key] = self._meshes_of(part, shape, filaments) if (filaments >= 0).any() else []
            self._meshes_of_part[key] += self._lattice_of(part, shape) if shape.beams else []
        for mesh in self._meshes_of_part[key]:
            self._places.setdefault(mesh, []).append(world)

    def _filaments(self, number: str, count: int, piece: Piece) -> NDArray[np.int64]:
        """The filament of each triangle of an object; -1 of those that are not printed."""
        filaments = np.full(count, piece.filament)
        for run in self._project.runs.get(number, []):
            filaments[run.first : run.last + 1] = run.filament if run.is_printed else -1
        if (filaments < 0).any():
            self._notes[_NOT_PRINTED] = None
        return filaments

    def _lattice_of(self, part: Part, shape: Shape) -> list[int]:
        """Numbers of the meshes of an object's beams, and of balls at their ends, which are as wide as the widest."""
        vertices = np.array(shape.vertices, np.float64).reshape(-1, 3)
        ends = np.array([beam.ends for beam in shape.beams]).ravel()
        radii = np.array([beam.radii for beam in shape.beams]).ravel()
        is_round = np.array([beam.is_round for beam in shape.beams]).ravel()
        at = np.concatenate([ends[is_round], np.array([*shape.balls], np.int64)])
        if not (0 <= ends.min() <= ends.max() < len(vertices) and np.isin(at, ends).all()):
            raise self._error("has a beam or a ball whose vertices are not there")
        widths = np.concatenate([radii[is_round], [*shape.balls.values()]])
        if not all(np.isfinite(values).all() for values in (vertices[ends], radii, widths)):
            raise self._error("has a beam whose places or radii are no numbers")
        wide = np.zeros(len(vertices))
        np.maximum.at(wide, at, widths)
        codes = np.concatenate([self._colors_of(part, beam) for beam in shape.beams])
        colors, balls = linear_colors(codes), np.unique(at)
        of_balls = np.zeros((len(vertices), colors.shape[1]), np.float32)
        of_balls[ends] = colors
        order = np.arange(len(ends), dtype=np.uint32)
        number, points = len(self._materials), vertices.astype(np.float32)
        rods = Mesh(self._name, points[ends], order.reshape(-1, 2), number, colors=colors)
        thin = [(rods, radii.astype(np.float32))]
        if len(balls):
            one = Mesh(self._name, points[balls], order[: len(balls), None], number, colors=of_balls[balls])
            thin.append((one, wide[balls].astype(np.float32)))
        first = len(self._meshes)
        self._meshes += [replace(as_mesh(mesh, np.eye(4)[None], width, number), points=0) for mesh, width in thin]
        self._materials.append(material_of(codes))
        return [*range(first, len(self._meshes))]

    def _colors_of(self, part: Part, beam: Beam) -> NDArray[np.float64]:
        """sRGB codes ``(2, 4)`` of a beam's ends, as those of a plain surface where it has no colours."""
        group = part.groups.get(beam.group or "")
        if group is None or group.picture:
            return np.tile(255.0 * np.append(GREY_CODES, 1.0), (2, 1))
        try:
            return np.rint(255.0 * np.array([group.values[at] for at in beam.colors]))
        except IndexError:
            raise self._error("has a beam whose colours are not there") from None

    def _meshes_of(self, part: Part, shape: Shape, filaments: NDArray[np.int64]) -> list[int]:
        """Numbers of the meshes of an object: one for each picture, one for all colours, one for what has neither."""
        vertices = np.array(shape.vertices, np.float64).reshape(-1, 3)
        faces = np.array([triangle[:3] for triangle in shape.triangles])
        if not (0 <= faces.min() <= faces.max() < len(vertices) and np.isfinite(vertices).all()):
            raise self._error("has a triangle whose vertices are not there")
        kinds: dict[tuple[str, tuple[float, ...]] | None, list[int]] = {}
        for number in np.flatnonzero(filaments >= 0).tolist():
            group = part.groups.get(shape.triangles[number][3] or "")
            kinds.setdefault(None if group is None else (group.picture, group.below), []).append(number)
        first = len(self._meshes)
        for kind, chosen in kinds.items():
            corners = vertices[faces[chosen]].reshape(-1, 3).astype(np.float32)
            order = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
            mesh = Mesh(self._name, corners, order, len(self._materials))
            if kind is None and self._project.colors:
                corners, codes = self._printed(shape, chosen, corners, filaments)
                order = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
                colors = linear_colors(codes)
                self._add(replace(mesh, positions=corners, faces=order, colors=colors), material_of(codes))
                continue
            if kind is None:
                self._add(mesh, GREY)
                continue
            values = self._values(part, [shape.triangles[number] for number in chosen])
            picture, below = kind
            if picture:
                uvs = (values * (1.0, -1.0) + (0.0, 1.0)).astype(np.float32)
                self._add(
                    replace(mesh, uvs=(uvs,)), replace(COLORED, base_color_texture=self._texture(part, picture, below))
                )
            else:
                codes = np.rint(255.0 * values)
                self._add(replace(mesh, colors=linear_colors(codes)), material_of(codes))
        return [*range(first, len(self._meshes))]

    def _printed(
        self, shape: Shape, chosen: list[int], corners: NDArray[np.float32], filaments: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
        """Corners ``(3 k, 3)`` of triangles, painted ones cut into parts, and sRGB codes of their filaments."""
        whole = corners.reshape(-1, 3, 3)
        pieces: list[NDArray[np.float32]] = []
        own: list[int] = []
        try:
            for triangle, number in zip(whole, chosen, strict=True):
                filament = int(filaments[number])
                if number not in shape.paint:
                    pieces.append(triangle)
                    own.append(filament)
                    continue
                for weights, of_paint in painted(shape.paint[number]):
                    pieces.append((weights @ triangle).astype(np.float32))
                    own.append(of_paint or filament)
        except ValueError as error:
            raise self._error(f"a painted triangle is damaged ({error})") from None
        codes = np.rint(255.0 * np.array([self._project.color(filament) for filament in own]))
        return np.concatenate(pieces), np.repeat(codes, 3, axis=0)

    def _add(self, mesh: Mesh, material: Material) -> None:
        self._meshes.append(mesh)
        self._materials.append(material)

    def _values(self, part: Part, triangles: list[Triangle]) -> NDArray[np.float64]:
        """The properties of all corners of triangles, one after the other."""
        try:
            values = [part.groups[group or ""].values for *_, group, _, _, _ in triangles]
            return np.array([own[at] for own, triangle in zip(values, triangles, strict=True) for at in triangle[4:]])
        except (IndexError, ValueError):
            raise self._error("has a triangle whose colours or coordinates are not there") from None

    def _texture(self, part: Part, picture: str, below: tuple[float, ...]) -> Texture:
        if picture not in part.pictures:
            raise self._error(f"has no picture {picture}")
        name, wrap = part.pictures[picture]
        if name not in self._images:
            self._images[name] = decode_image(self._package.bytes_of(name), name, where=self._package.where)
        wraps: Wrap = "repeat" if wrap == "wrap" else "mirror" if wrap == "mirror" else "clamp"
        return Texture(_over(self._images[name], below), srgb=True, wrap_u=wraps, wrap_v=wraps)

    def _error(self, what: str) -> SceneError:
        return SceneError(what, where=self._package.where)


def _over(image: Image, below: tuple[float, ...]) -> Image:
    """A picture over a colour, both of sRGB codes, which the format mixes as they stand."""
    if image.pixels.shape[2] < 4:
        return image
    pixels = unit(image)
    alpha = pixels[..., 3:]
    return Image(image.name, (alpha * pixels[..., :3] + (1.0 - alpha) * np.array(below)).astype(np.float32))
