"""What slicers keep beside the model of a 3MF package: filaments, painted triangles, parts that are not printed.

PrusaSlicer, Bambu Studio and OrcaSlicer write the colours of a model so, and none of the format's own.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.readers.three_mf.parts import Package, code_of_color

_PRUSA, _PRUSA_PIECES = "Metadata/Slic3r_PE.config", "Metadata/Slic3r_PE_model.config"
_BAMBU, _BAMBU_PIECES = "Metadata/project_settings.config", "Metadata/model_settings.config"
#: Kinds of pieces that are printed as they stand; all others modify, support, or are cut away.
_PRINTED = {"normal_part", "ModelPart"}

#: Filaments of a project, and digits of the paint of a triangle, at most.
_MOST_FILAMENTS, _LONGEST_PAINT = 1 << 16, 1 << 16

#: A triangle in a triangle: a row of three weights for each of its corners.
Corners = NDArray[np.float64]


@dataclass
class Piece:
    """An object, a part of it (Bambu), or a run of its triangles (Prusa), with its filament counted from 1; 0: none."""

    filament: int = 0
    is_printed: bool = True
    first: int = 0
    last: int = -1


@dataclass
class SlicerProject:
    """Filaments of a project: their colours, sRGB codes ``(r, g, b, a)``, and which the pieces of objects have."""

    colors: list[tuple[float, ...]] = field(default_factory=list)
    objects: dict[str, Piece] = field(default_factory=dict)
    parts: dict[tuple[str, str], Piece] = field(default_factory=dict)
    runs: dict[str, list[Piece]] = field(default_factory=dict)
    plates: int = 0

    def color(self, filament: int) -> tuple[float, ...]:
        """The colour of a filament; that of the first for what has none."""
        return self.colors[filament - 1 if 0 < filament <= len(self.colors) else 0]


def read_project(package: Package) -> SlicerProject:
    """The slicer's project in a package; an empty one where no slicer wrote it.

    Raises
    ------
    SceneError
        A file of the project is damaged.
    """
    project = SlicerProject()
    for name in (_PRUSA_PIECES, _BAMBU_PIECES):
        if package.has(name):
            package.parse(name, _Pieces(project).begin)
    try:
        project.colors = [code_of_color(text) for text in _filaments(package)]
    except (ValueError, TypeError, AttributeError, RecursionError) as error:
        raise SceneError(f"its slicer's filaments are damaged ({error})", where=package.where) from None
    return project


def _filaments(package: Package) -> list[str]:
    if package.has(_BAMBU):
        given: list[str] = json.loads(package.bytes_of(_BAMBU)).get("filament_colour", [])
        return given
    if not package.has(_PRUSA):
        return []
    text = package.bytes_of(_PRUSA).decode("utf-8", "replace")
    lists = [re.search(rf"(?m)^; {key}_colour = (.*)$", text) for key in ("extruder", "filament")]
    own, of_filaments = ([word.strip('" \r') for word in each[1].split(";")] if each else [] for each in lists)
    rest = of_filaments[len(own) :]
    colors = [mine or other for mine, other in zip(own, [*of_filaments, *[""] * len(own)], strict=False)] + rest
    return colors if all(colors) else []


class _Pieces:
    """Takes the elements of a list of objects and their pieces."""

    def __init__(self, project: SlicerProject) -> None:
        self._project = project
        self._number, self._object, self._piece = "", Piece(), Piece()

    def begin(self, tag: str, given: dict[str, str]) -> None:
        """Take an element."""
        if tag == "object":
            self._number = given["id"]
            self._object = self._piece = self._project.objects[self._number] = Piece()
        elif tag == "part":
            self._piece = Piece(self._object.filament, given.get("subtype", "normal_part") in _PRINTED)
            self._project.parts[self._number, given["id"]] = self._piece
        elif tag == "volume":
            self._piece = Piece(self._object.filament, True, int(given["firstid"]), int(given["lastid"]))
            self._project.runs.setdefault(self._number, []).append(self._piece)
        elif tag == "plate":
            self._project.plates += 1
            self._piece = Piece()  # whose properties are nobody's
        elif tag == "metadata":
            key, value = given.get("key"), given.get("value", "")
            if key == "extruder":
                self._piece.filament = min(max(int(value), 0), _MOST_FILAMENTS) or self._object.filament
            elif key == "volume_type":
                self._piece.is_printed = value in _PRINTED
            elif key == "modifier" and value == "1":
                self._piece.is_printed = False


@lru_cache(maxsize=4096)
def painted(text: str) -> tuple[tuple[Corners, int], ...]:
    """The parts of a painted triangle, and the filament of each (0: that of its piece).

    Hexadecimal digits, of which the last comes first, are a tree in depth-first order: the lower two bits tell how
    many sides are split, the upper two from which corner on, or the filament, of which the next digit tells more than
    2. The last part of a split triangle comes first.

    Raises
    ------
    ValueError
        The text ends too early, or has other letters.
    """
    if len(text) > _LONGEST_PAINT:
        raise ValueError(f"{len(text)} digits")
    return tuple(_parts([int(digit, 16) for digit in reversed(text)]))


def _parts(codes: list[int]) -> Iterator[tuple[Corners, int]]:
    rest = iter(codes)
    waiting = [np.eye(3)]
    while waiting:
        corners = waiting.pop()
        code = next(rest, None)
        if code is None:
            raise ValueError("the end of a painted triangle")
        sides, value = code & 3, code >> 2
        if sides == 0:
            yield corners, value if value < 3 else 3 + next(rest, 0)
            continue
        a, b, c = np.roll(corners, -value, axis=0)
        ab, bc, ca = (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0
        within = {
            1: [(a, b, bc), (bc, c, a)],
            2: [(a, ab, ca), (ab, b, ca), (b, c, ca)],
            3: [(a, ab, ca), (ab, b, bc), (bc, c, ca), (ab, bc, ca)],
        }
        waiting += [np.stack(each) for each in within[sides]]
