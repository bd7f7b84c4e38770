"""Parts of a 3MF package: its models as they stand in XML.

By the 3MF Core Specification 1.3 and its extensions Materials and Properties 1.2, Production 1.1 and Beam Lattice 1.2.
"""

from __future__ import annotations

import posixpath
import re
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.runtime.machine import check_input
from lippmann.scene.parsing.files import read_bytes

#: Millimetres of the units that a model may be in.
UNITS = {"micron": 1e-3, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1000.0}

#: Bytes that an element takes while a model is read, at most, over its bytes as text.
_BYTES_PER_BYTE = 8
_MODEL = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
#: Elements that are not read, and what they would show.
_UNREAD = {
    "compositematerials": "mixtures of materials",
    "slicestack": "slices",
    "volumedata": "volumes of functions",
    "levelset": "shapes of functions",
}
_COLOR = re.compile("#([0-9a-fA-F]{6})([0-9a-fA-F]{2})?")


class Placed(NamedTuple):
    """An object of a part, and where: ``world_from_object`` ``(4, 4)`` in units of the model."""

    part: str
    number: str
    matrix: NDArray[np.float64]


@dataclass
class Group:
    """Properties that corners refer to by their places: sRGB codes ``(r, g, b, a)``, or ``(u, v)`` on a picture.

    ``below`` is the colour that shows through the picture.
    """

    values: list[tuple[float, ...]] = field(default_factory=list)
    picture: str = ""
    below: tuple[float, ...] = (1.0, 1.0, 1.0)


#: Vertices, the group of the properties of its corners, and their places there.
Triangle = tuple[int, int, int, str | None, int, int, int]


class Beam(NamedTuple):
    """A beam between two vertices: its radii there, whether it ends round there, and its colours as of a triangle."""

    ends: tuple[int, int]
    radii: tuple[float, float]
    is_round: tuple[bool, bool]
    group: str | None
    colors: tuple[int, int]


@dataclass
class Shape:
    """An object: vertices ``x, y, z``, triangles, beams, radii of balls by their vertex, or objects of which it is.

    ``paint`` are the texts of triangles that a slicer painted.
    """

    group: str | None
    index: int
    vertices: list[tuple[float, float, float]] = field(default_factory=list)
    triangles: list[Triangle] = field(default_factory=list)
    paint: dict[int, str] = field(default_factory=dict)
    beams: list[Beam] = field(default_factory=list)
    balls: dict[int, float] = field(default_factory=dict)
    components: list[Placed] = field(default_factory=list)


@dataclass
class Part:
    """A model: its objects and properties by their numbers, what is to be built of them, the files of its pictures."""

    scale: float = 1.0
    shapes: dict[str, Shape] = field(default_factory=dict)
    groups: dict[str, Group] = field(default_factory=dict)
    pictures: dict[str, tuple[str, str]] = field(default_factory=dict)
    build: list[Placed] = field(default_factory=list)
    unread: dict[str, None] = field(default_factory=dict)


class Package:
    """A 3MF package, whose parts are read when they are asked for."""

    def __init__(self, path: Path) -> None:
        """Open a package; a :class:`SceneError` where it is none."""
        self.where = path.name
        read_bytes(path, 4)
        try:
            self._archive = zipfile.ZipFile(path)
        except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
            raise SceneError(f"is no 3MF package ({error})", where=self.where, rule="it is a ZIP archive") from None
        self._parts: dict[str, Part] = {}

    def close(self) -> None:
        """Close the archive."""
        self._archive.close()

    def bytes_of(self, name: str) -> bytes:
        """What a file of the package holds."""
        try:
            entry = self._archive.getinfo(name.lstrip("/"))
            check_input(_BYTES_PER_BYTE * entry.file_size, f"'{name}'", where=self.where)
            return self._archive.read(entry)
        except (KeyError, zipfile.BadZipFile, OSError, ValueError, RuntimeError, NotImplementedError, EOFError):
            raise SceneError(f"has no whole file '{name}'", where=self.where, fix="is the package cut short?") from None

    def start(self) -> str:
        """The name of the model that is shown: that of the package's relations."""
        target = ""

        def begin(_: str, attributes: dict[str, str]) -> None:
            nonlocal target
            if attributes.get("Type") == _MODEL:
                target = target or attributes.get("Target", "")

        self.parse("_rels/.rels", begin)
        return posixpath.join("/", target or "3D/3dmodel.model")

    def part(self, name: str) -> Part:
        """A model of the package."""
        if name not in self._parts:
            reader = _PartReader(name)
            self._parts[name] = reader.part
            self.parse(name, reader.begin)
        return self._parts[name]

    def has(self, name: str) -> bool:
        """Whether the package holds a file."""
        return name in self._archive.namelist()

    def parse(self, name: str, begin: Callable[[str, dict[str, str]], None]) -> None:
        """Hand each element of a file in XML to ``begin``; a :class:`SceneError` where it takes none of it."""
        parser = expat.ParserCreate()
        parser.StartElementHandler = begin

        def refuse(*_: object) -> None:
            raise SceneError(f"'{name}' declares a document type", where=self.where, rule="models have none")

        parser.StartDoctypeDeclHandler = refuse
        try:
            parser.Parse(self.bytes_of(name), True)
        except expat.ExpatError as error:
            is_locked = any("keystore" in each.lower() for each in self._archive.namelist())
            fix = "the package holds keys: save it unencrypted" if is_locked else ""
            raise SceneError(f"'{name}' is no well-formed XML ({error})", where=self.where, fix=fix) from None
        except (KeyError, ValueError, LookupError) as error:
            fault = f"'{name}', line {parser.CurrentLineNumber}: {error} is missing or no value of its kind"
            raise SceneError(fault, where=self.where, fix="is the file whole?") from None


class _PartReader:
    """Takes the elements of a model in the order in which they begin."""

    def __init__(self, name: str) -> None:
        self.part = Part()
        self._name = name
        self._group, self._shape = Group(), Shape(None, 0)
        self._lattice: dict[str, str] = {}
        self._first, self._last, self._layer = Group(), Group(), 0  # what properties in layers are taken from
        self._take = {
            "model": self._model,
            "object": self._object,
            "component": self._component,
            "item": self._item,
            **dict.fromkeys(("basematerials", "colorgroup"), self._colors),
            "base": self._base,
            "color": self._color,
            "texture2d": self._texture2d,
            "texture2dgroup": self._texture2dgroup,
            "tex2coord": self._tex2coord,
            "multiproperties": self._multiproperties,
            "multi": self._multi,
            "beamlattice": self._beamlattice,
            "beam": self._beam,
            "ball": self._ball,
        }

    def begin(self, tag: str, given: dict[str, str]) -> None:
        """Take an element."""
        if tag == "vertex":
            self._shape.vertices.append((float(given["x"]), float(given["y"]), float(given["z"])))
            return
        if tag == "triangle":
            group = given.get("pid", self._shape.group)
            first = int(given.get("p1", self._shape.index))
            paint = given.get("paint_color") or given.get("slic3rpe:mmu_segmentation")
            if paint:
                self._shape.paint[len(self._shape.triangles)] = paint
            self._shape.triangles.append(
                (
                    *(int(given["v1"]), int(given["v2"]), int(given["v3"])),
                    *(group, first, int(given.get("p2", first)), int(given.get("p3", first))),
                )
            )
            return
        plain = {key.rpartition(":")[2]: value for key, value in given.items()}
        name = tag.rpartition(":")[2]
        if name in self._take and "functionid" not in plain:  # "color" is a channel of a function, too
            self._take[name](plain)
        elif name in _UNREAD:
            self.part.unread[_UNREAD[name]] = None

    def _model(self, given: dict[str, str]) -> None:
        self.part.scale = UNITS[given.get("unit", "millimeter")]

    def _object(self, given: dict[str, str]) -> None:
        self._shape = self.part.shapes[given["id"]] = Shape(given.get("pid"), int(given.get("pindex", 0)))

    def _component(self, given: dict[str, str]) -> None:
        self._shape.components.append(self._place(given))

    def _item(self, given: dict[str, str]) -> None:
        if given.get("printable") != "0":
            self.part.build.append(self._place(given))

    def _multiproperties(self, given: dict[str, str]) -> None:
        """Layers of properties: the last lies on top, and is taken alone, a picture over the first's colour."""
        self._first, *_, self._last = [self.part.groups[each] for each in (given["pids"].split() * 2)]
        self._layer = len(given["pids"].split()) - 1
        if not self._last.picture:
            self.part.unread["layers of colour below others"] = None
        self._group = self.part.groups[given["id"]] = Group(picture=self._last.picture)

    def _multi(self, given: dict[str, str]) -> None:
        indices = [int(index) for index in given["pindices"].split()]
        index = indices[self._layer] if self._layer < len(indices) else 0
        if not 0 <= index < len(self._last.values):
            raise ValueError(f"the place {index} of a property")
        if self._group.picture and not self._group.values and not self._first.picture and indices:
            self._group.below = self._first.values[indices[0]][:3]
        self._group.values.append(self._last.values[index])

    def _place(self, given: dict[str, str]) -> Placed:
        matrix = np.eye(4)
        if "transform" in given:  # rows of the matrix that acts on row vectors, without the last column
            matrix[:3] = np.array([float(value) for value in given["transform"].split()]).reshape(4, 3).T
        return Placed(posixpath.join("/", given.get("path", self._name)), given["objectid"], matrix)

    def _colors(self, given: dict[str, str]) -> None:
        self._group = self.part.groups[given["id"]] = Group()

    def _base(self, given: dict[str, str]) -> None:
        red, green, blue, alpha = code_of_color(given.get("displaycolor", "#FFFFFF"))
        if alpha == 0.0:  # as SolidWorks writes it, of parts that are there
            self.part.unread["opacities of 0 of base materials"] = None
        self._group.values.append((red, green, blue, alpha or 1.0))

    def _color(self, given: dict[str, str]) -> None:
        self._group.values.append(code_of_color(given["color"]))

    def _beamlattice(self, given: dict[str, str]) -> None:
        self._lattice = given
        if "clippingmesh" in given and given.get("clippingmode") != "none":
            self.part.unread["clippings of lattices of beams"] = None

    def _beam(self, given: dict[str, str]) -> None:
        group = given.get("pid", self._lattice.get("pid", self._shape.group))
        first = int(given.get("p1", self._lattice.get("pindex", self._shape.index)))
        radius = float(given.get("r1", self._lattice["radius"]))
        cap = self._lattice.get("cap", "sphere")
        beam = Beam(
            (int(given["v1"]), int(given["v2"])),
            (radius, float(given.get("r2", radius))),
            (given.get("cap1", cap) != "butt", given.get("cap2", cap) != "butt"),
            group,
            (first, int(given.get("p2", first))),
        )
        self._shape.beams.append(beam)
        if self._lattice.get("ballmode") == "all":
            self._shape.balls |= dict.fromkeys(beam.ends, float(self._lattice["ballradius"]))

    def _ball(self, given: dict[str, str]) -> None:
        self._shape.balls[int(given["vindex"])] = float(given.get("r", self._lattice.get("ballradius", "0")))

    def _texture2d(self, given: dict[str, str]) -> None:
        self.part.pictures[given["id"]] = given["path"], given.get("tilestyleu", "wrap")

    def _texture2dgroup(self, given: dict[str, str]) -> None:
        self._group = self.part.groups[given["id"]] = Group(picture=given["texid"])

    def _tex2coord(self, given: dict[str, str]) -> None:
        self._group.values.append((float(given["u"]), float(given["v"])))


def code_of_color(text: str) -> tuple[float, ...]:
    """sRGB codes ``(r, g, b, a)`` in [0, 1] of ``#RRGGBB`` or ``#RRGGBBAA``; a ValueError of all else."""
    match = _COLOR.fullmatch(text.strip())
    if match is None:
        raise ValueError(f"the colour '{text}'")
    return (*(value / 255.0 for value in bytes.fromhex(match[1] + (match[2] or "ff"))),)
