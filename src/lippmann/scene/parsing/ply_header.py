"""Headers of Stanford polygon files: which elements follow, and how their numbers are written."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from lippmann.errors import SceneError
from lippmann.scene.values.description import Direction

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_BYTE_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}

#: Digits of a number of entries; no file has room for more.
_LONGEST_COUNT = 18

# A comment that says which axis points up, and its value: an axis, or a direction.
_VERTICAL = re.compile(r"vertical[ _-]?axis\s*[:=]?(.*)", re.IGNORECASE)
_AXIS = re.compile(r"([+-]?)([xyz])\b")
_NUMBERS = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?")
_MOST_SQUARED = 1e30

# Properties that are read; others may share a name, as those that only fill a gap do.
_MEANINGFUL = {"x", "y", "z", "nx", "ny", "nz", "s", "t", "u", "v", "texture_u", "texture_v"}
_MEANINGFUL |= {"red", "green", "blue", "alpha", "vertex_index", "vertex_indices", "texcoord"}


@dataclass(frozen=True)
class Property:
    """A number, or a list of numbers, of each entry: NumPy's letters for its type, and for that of a list's length."""

    name: str
    type: str
    count_type: str | None  # of a list, None for a scalar

    @property
    def brightest(self) -> float:
        """Value of full brightness, where it is a colour: reals count to 1, whole numbers to 255 or 65535."""
        return 1.0 if self.type[0] == "f" else 65535.0 if self.type == "u2" else 255.0


@dataclass
class Element:
    """A kind of entries, such as vertices, and how many there are."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)


@dataclass
class Header:
    """The header of a PLY file: elements, textures, byte order, where its numbers begin, and notes.

    ``order`` is "<" or ">" of a binary file, None of text; ``end`` is the first byte of the numbers; ``up`` is the
    direction that a comment says is up.
    """

    elements: list[Element] = field(default_factory=list)
    textures: list[str] = field(default_factory=list)
    order: str | None = None
    end: int = 0
    notes: list[str] = field(default_factory=list)
    up: Direction | None = None


def read_header(data: bytes, where: str) -> Header:
    """The header of a PLY file.

    Raises
    ------
    SceneError
        The bytes are no PLY file, or its header has no end, or a line or a format that no header has, or an element or
        a property twice.
    """
    if not data.startswith((b"ply\n", b"ply\r")):
        raise SceneError("is no PLY file", where=where, rule="one begins with the line 'ply'")
    header = Header()
    comments: list[str] = []
    form = ""
    position, number = 0, 0
    end_of_line = b"\r" if data[3:4] == b"\r" and data[4:5] != b"\n" else b"\n"  # the former of the old Mac OS
    while True:
        stop = data.find(end_of_line, position)
        if stop < 0:
            raise SceneError("the header has no end", where=where, rule="it ends with 'end_header'")
        line = data[position:stop].decode("latin-1").strip()
        position, number = stop + 1, number + 1
        words = line.split()
        if not words or words[0] in ("ply", "obj_info"):
            continue
        if words[0] == "end_header":
            break
        if words[0] == "comment":
            if len(words) > 2 and words[1].lower() == "texturefile":
                header.textures.append(line.split(None, 2)[2])
            comments.append(line.partition(words[0])[2].strip())
            continue
        if words[0] == "format":
            form = words[1] if len(words) > 1 else ""
        else:
            _read_declaration(header, words, f"{where}:{number}")
    if form != "ascii" and form not in _BYTE_ORDERS:
        raise SceneError.unknown("format", form, ("ascii", *_BYTE_ORDERS), where=where)
    known = [element.name for element in header.elements]
    if len(set(known)) < len(known):
        twice = next(name for name in known if known.count(name) > 1)
        raise SceneError(f"has element '{twice[:40]}' twice", where=where, rule="names of elements differ")
    for element in header.elements:
        names = [each.name for each in element.properties if each.name in _MEANINGFUL]
        if len(set(names)) < len(names):
            raise SceneError(f"'{element.name[:40]}' has a property twice", where=where, rule="names tell them apart")
    header.order, header.end = _BYTE_ORDERS.get(form), position
    _read_up(header, comments)
    return header


def _read_up(header: Header, comments: list[str]) -> None:
    """Take over the last comment that says which axis points up.

    Nerfstudio writes "Vertical Axis: z". Brush writes a direction, "Vertical axis: 0 -1 0", and its older versions
    always "Vertical axis: y", by which they mean -y, and read z as -z.
    """
    is_of_brush = any("exported from brush" in comment.lower() for comment in comments)
    for comment in comments:
        match = _VERTICAL.match(comment)
        if match is None:
            continue
        value = match[1].strip().lower()
        axis = _AXIS.match(value)
        numbers = _NUMBERS.findall(value)
        if axis is not None:
            sign = -1.0 if axis[1] == "-" or (is_of_brush and not axis[1] and axis[2] != "x") else 1.0
            x, y, z = (sign if each == axis[2] else 0.0 for each in "xyz")
            header.up = (x, y, z)
        elif len(numbers) == 3 and 0.0 < sum(float(each) ** 2 for each in numbers) < _MOST_SQUARED:
            header.up = (float(numbers[0]), float(numbers[1]), float(numbers[2]))
        else:
            header.notes.append(f"the comment '{comment[:60]}' names no axis, and is passed over")


def _read_declaration(header: Header, words: list[str], where: str) -> None:
    match words:
        case ["element", name, count] if count.isdecimal() and len(count) <= _LONGEST_COUNT:
            header.elements.append(Element(name, int(count)))
        case ["property", "list", count, kind, name] if (
            header.elements and {count, kind} <= _TYPES.keys() and _TYPES[count][0] in "iu"
        ):
            header.elements[-1].properties.append(Property(name, _TYPES[kind], _TYPES[count]))
        case ["property", kind, name] if header.elements and kind in _TYPES:
            header.elements[-1].properties.append(Property(name, _TYPES[kind], None))
        case [word, *_] if not header.elements and word not in ("element", "property"):
            header.notes.append(f"{where}: '{' '.join(words)[:60]}' is no line of a PLY header, and is passed over")
        case _:
            raise SceneError(f"header line '{' '.join(words)[:60]}'", where=where, rule="no such line in a PLY header")
