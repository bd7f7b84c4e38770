"""Volumes of NRRD (``.nrrd``, ``.nhdr``) and MetaImage files (``.mha``, ``.mhd``): a header of lines, then the voxels.

Sources: "Definition of NRRD File Format" (teem.sourceforge.net), ITK's "MetaIO" documentation; a row of MetaImage's
``TransformMatrix`` is the direction of an axis, and its places are those of a patient: left, back, head.
"""

from __future__ import annotations

import bz2
import math
import re
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.runtime.machine import check_input
from lippmann.scene.parsing.files import NamedFiles, read_bytes
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.volumes.description import WORLD_FROM_LPS, describe_volume

#: The longest header.
_MOST_HEADER = 1 << 20
#: Types of voxels by the names that NRRD and MetaImage have for them, in small letters.
_TYPES = {
    **dict.fromkeys(("char", "int8", "int8_t"), "i1"),
    **dict.fromkeys(("uchar", "unsigned char", "uint8", "uint8_t"), "u1"),
    **dict.fromkeys(("short", "short int", "int16", "int16_t"), "i2"),
    **dict.fromkeys(("ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"), "u2"),
    **dict.fromkeys(("int", "int32", "int32_t"), "i4"),
    **dict.fromkeys(("uint", "unsigned int", "uint32", "uint32_t"), "u4"),
    **dict.fromkeys(("longlong", "long long", "long long int", "long_long", "int64", "int64_t"), "i8"),
    **dict.fromkeys(("ulonglong", "unsigned long long", "ulong_long", "uint64", "uint64_t"), "u8"),
    "unsigned long long int": "u8",
    "long": "i4",
    "ulong": "u4",  # of MetaImage
    "float": "f4",
    "double": "f8",
}
#: NRRD's encodings by their names; text is numbers, and blanks or commas between them.
_ENCODINGS = {
    "raw": "raw",
    **dict.fromkeys(("gzip", "gz"), "zlib"),
    **dict.fromkeys(("bzip2", "bz2"), "bzip2"),
    **dict.fromkeys(("ascii", "text", "txt"), "text"),
}
#: Bytes that a byte of text takes while its numbers are read.
_BYTES_PER_BYTE = 32
#: Without a word on how a patient lies: slice 0 in front, row 0 on top.
_WORLD_FROM_SLICES = np.diag([1.0, -1.0, -1.0, 1.0])
#: Kinds of axes along which places, and not the numbers of one voxel, lie.
_PLACES = ("domain", "space", "time", "none", "???")
#: Files with a slice each: the pattern of their names, with the first and last number and the step.
_NUMBERED, _MOST_FILES = re.compile(r"([^%]*%0?\d?d[^%\s]*)\s+(-?\d+)\s+(-?\d+)\s+(-?\d+)(?:\s+\d+)?"), 1 << 16
_LINE = re.compile(r"\s*([^:=#]+?)\s*[:=]\s*(.*?)\s*")


@dataclass(frozen=True)
class _Grid:
    """Voxels of ``dtype``, ``sizes`` along each axis (the fastest first), in ``file`` (None: behind the header).

    ``encoding`` is a value of :data:`_ENCODINGS`. ``lines`` and then ``skip`` bytes stand before the voxels, the bytes
    within what is packed; -1: the voxels end the file.
    """

    sizes: list[int]
    dtype: np.dtype[np.generic]
    matrix: NDArray[np.float64]
    file: str | None
    skip: int
    encoding: str
    notes: list[str]
    lines: int = 0


def read_header_grid(path: Path, *, files: NamedFiles) -> SceneDescription:
    """Read a volume of one number a voxel: raw, as text, or packed by zlib or bzip2. World units are millimetres.

    A patient is seen from the front, head up.

    Raises
    ------
    SceneError
        The file or that of its voxels is missing, damaged or cut short; it holds no such volume.
    MemoryLimitError
        It holds more than the memory that is left.
    """
    where, data = path.name, read_bytes(path)
    is_nrrd = data.startswith(b"NRRD")
    end = re.search(rb"\r?\n\r?\n" if is_nrrd else rb"ElementDataFile[^\n]*\n?", data[:_MOST_HEADER])
    if end is None and not is_nrrd:
        raise SceneError("is no volume", where=where, rule="NRRD begins with NRRD, MetaImage names its ElementDataFile")
    text = data[: end.end() if end else _MOST_HEADER].decode("latin-1")
    entries = {match[1].lower(): match[2] for line in text.splitlines() if (match := _LINE.fullmatch(line))}
    try:
        grid = _nrrd(entries) if is_nrrd else _metaimage(entries)
    except (KeyError, ValueError, IndexError) as error:
        raise SceneError(f"has a header without sense ({error})", where=where, rule="NRRD or MetaImage") from None
    sizes = [size for size in grid.sizes if size != 1] if len(grid.sizes) > 3 else grid.sizes
    if not 2 <= len(sizes) <= 3 or min(sizes) < 1:
        raise SceneError(f"has {grid.sizes} values", where=where, rule="one number a voxel on three axes is shown")
    shape = [*sizes, 1][2::-1]
    size = math.prod(shape) * grid.dtype.itemsize
    check_input(size + 4 * math.prod(shape), f"{' x '.join(map(str, sizes))} voxels", where=where)
    if grid.file is None:
        body = _voxels(data, 0 if end is None else end.end(), size, grid, where)
    else:
        names = _file_names(grid.file, data[:_MOST_HEADER].decode("latin-1"))
        if not names or size % len(names):
            raise SceneError(f"names {len(names)} files of voxels", where=where, rule="each holds as many of them")
        found = (files.find(name, where=where, what="file of voxels") for name in names)
        body = b"".join(_voxels(read_bytes(part), 0, size // len(names), grid, where) for part in found)
    return describe_volume(path.stem, np.frombuffer(body, grid.dtype).reshape(shape), grid.matrix, notes=grid.notes)


def _file_names(file: str, header: str) -> list[str]:
    """Files that hold the voxels one after the other: numbered by a pattern, in a list that ends the header, or one."""
    if file.split()[0] == "LIST":
        listed = re.split(r"[:=]\s*LIST[^\n]*\n", re.split(r"\r?\n\r?\n", header)[0], maxsplit=1)[1:]
        return [line.strip() for line in "".join(listed).splitlines() if line.strip()]
    if (numbered := _NUMBERED.fullmatch(file)) is None:
        return [file]
    first, last, step = map(int, numbered.groups()[1:])
    return [numbered[1] % number for number in range(first, last + 1, step)[:_MOST_FILES]] if step else []


def _voxels(data: bytes, start: int, size: int, grid: _Grid, where: str) -> bytes:
    """``size`` bytes of voxels, unpacked, of a file in which they or what stands before them begin at ``start``."""
    for _ in range(grid.lines):
        if (start := data.find(b"\n", start) + 1) == 0:
            raise SceneError(f"has no {grid.lines} lines before its voxels", where=where, fix="is it whole?")
    skip = max(grid.skip, 0)
    if grid.encoding == "text":
        check_input(_BYTES_PER_BYTE * len(data), "voxels as text", where=where)
        try:
            words = data[start + skip :].replace(b",", b" ").split()
            body = np.array(words[: size // grid.dtype.itemsize], np.float64).astype(grid.dtype).tobytes()
        except ValueError as error:
            raise SceneError(f"holds voxels that are no numbers ({error})", where=where, fix="is it whole?") from None
    elif grid.encoding != "raw":
        check_input(skip + size, f"{skip} bytes before the voxels", where=where)
        unpacker = bz2.BZ2Decompressor() if grid.encoding == "bzip2" else zlib.decompressobj(47)  # of zlib or gzip
        try:
            body = unpacker.decompress(data[start:], skip + size)[skip:]
        except (zlib.error, OSError) as error:
            raise SceneError(f"cannot be unpacked ({error})", where=where, fix="is it whole?") from None
    else:
        body = data[-size:] if grid.skip < 0 else data[start + skip : start + skip + size]
    if len(body) < size:
        raise SceneError(f"holds {len(body)} of {size} bytes of voxels", where=where, fix="is it whole?")
    return body


def _matrix(steps: NDArray[np.float64], origin: NDArray[np.float64]) -> NDArray[np.float64]:
    """From voxels to places: a row of ``steps`` ``(n, 3)`` for each axis."""
    matrix = np.eye(4)
    matrix[: len(steps[0]), : len(steps)] = steps.T
    matrix[: len(origin), 3] = origin
    if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix)) == 0.0:
        raise ValueError("its voxels have no extent")
    return matrix


def _numbers(text: str) -> NDArray[np.float64]:
    return np.array([float(word) for word in text.replace(",", " ").strip("() ").split()])


def _nrrd(entries: Mapping[str, str]) -> _Grid:
    encoding = entries["encoding"].lower()
    if encoding not in _ENCODINGS:
        raise ValueError(f"encoding {encoding}; raw, text, gzip and bzip2 are read")
    order = ">" if entries.get("endian", "little").lower() == "big" else "<"
    dtype = np.dtype(order + _TYPES[entries["type"].lower().removeprefix("signed ")])
    sizes = [int(word) for word in entries["sizes"].split()]
    for kind, size in zip(entries.get("kinds", "").lower().split(), sizes, strict=False):
        if size > 1 and kind not in _PLACES:
            raise ValueError(f"{size} values a voxel, {kind}; one is read")
    space = entries.get("space", "").lower().replace("-", " ").split()
    letters = space[0] if len(space) == 1 else "".join(word[:1] for word in space)
    to_lps = [{"l": 1.0, "r": -1.0}.get(letters[:1]), {"p": 1.0, "a": -1.0}.get(letters[1:2])]
    to_lps.append({"s": 1.0, "i": -1.0}.get(letters[2:3]))
    notes, world = [], _WORLD_FROM_SLICES
    if None not in to_lps:
        world = WORLD_FROM_LPS @ np.diag([*map(float, filter(None, to_lps)), 1.0])
    else:
        notes.append("nothing says how a patient lies: slice 0 is in front, its row 0 on top")
    directions = [_numbers(word) for word in re.findall(r"\([^)]*\)", entries.get("space directions", ""))]
    if directions:
        origin = _numbers(entries.get("space origin", "0 0 0"))
        matrix = _matrix(np.array(directions)[:3, :3], origin[:3])  # the fourth is time, which the sizes tell
    else:
        spacings = _numbers(entries.get("spacings", "1 1 1"))
        matrix = _matrix(np.diag(spacings[np.isfinite(spacings)][:3]), np.zeros(3))
    file = entries.get("data file", entries.get("datafile"))
    skip, lines = (int(entries.get(f"{unit} skip", 0)) for unit in ("byte", "line"))
    return _Grid(sizes, dtype, world @ matrix, file, skip, _ENCODINGS[encoding], notes, lines)


def _metaimage(entries: Mapping[str, str]) -> _Grid:
    def says(name: str) -> bool:
        return entries.get(name, "").lower() in ("true", "1")

    is_big = says("binarydatabyteordermsb") or says("elementbyteordermsb")
    dtype = np.dtype((">" if is_big else "<") + _TYPES[entries["elementtype"].lower().removeprefix("met_")])
    sizes = [int(word) for word in entries["dimsize"].split()]
    if (channels := int(entries.get("elementnumberofchannels", 1))) > 1:
        sizes = [channels, *sizes]
    if entries.get("binarydata", "true").lower() in ("false", "0"):
        encoding = "text"
    else:
        encoding = "zlib" if says("compresseddata") else "raw"
    axes = min(int(entries["ndims"]), 3)
    names = ("transformmatrix", "orientation", "rotation")
    turn = next((_numbers(entries[name]) for name in names if name in entries), np.eye(int(entries["ndims"])).ravel())
    side = math.isqrt(len(turn))
    spacing = _numbers(entries.get("elementspacing", entries.get("elementsize", "1 1 1")))[:axes]
    steps = turn.reshape(side, side)[:axes, :axes] * spacing[:, None]
    origin = next(
        (_numbers(entries[name])[:axes] for name in ("offset", "origin", "position") if name in entries), None
    )
    file = entries["elementdatafile"]
    matrix = WORLD_FROM_LPS @ _matrix(steps, np.zeros(axes) if origin is None else origin)
    skip = int(entries.get("headersize", 0))
    return _Grid(sizes, dtype, matrix, None if file == "LOCAL" else file, skip, encoding, [])
