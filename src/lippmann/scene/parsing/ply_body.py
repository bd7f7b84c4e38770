"""Entries of Stanford polygon files: each element's properties as columns of numbers, text and binary."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.parsing.ply_header import Element, Header

# Numbers may be followed by remarks, as in the header.
_REMARK = re.compile(rb"(?m)^[ \t]*comment\b.*$|#.*$")

Numbers = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Lists:
    """A list property: all values in a row, and how many belong to each entry."""

    values: Numbers
    sizes: Integers


Columns = Mapping[str, "Numbers | Lists"]


def read_body(data: bytes, header: Header, where: str) -> dict[str, Columns]:
    """The columns of each element by name.

    Raises
    ------
    SceneError
        The file is cut short, or a word is no number.
    """
    columns: dict[str, Columns] = {}
    position = header.end
    lines: list[bytes] = []
    if header.order is None:
        lines = _text_rows(data[header.end :])
        position = 0
    for element in header.elements:
        if header.order is None:
            rows = lines[position : position + element.count]
            if len(rows) < element.count:
                raise _cut_short(element, len(rows), where)
            columns[element.name] = _text_columns(element, rows, where)
            position += element.count
        else:
            columns[element.name], position = _binary_columns(element, data, position, header.order, where)
    return columns


def _text_rows(body: bytes) -> list[bytes]:
    """The lines of numbers, without empty ones and remarks."""
    if b"#" in body or b"comment" in body:
        body = _REMARK.sub(b"", body)
    return [line for line in body.split(b"\n" if b"\n" in body else b"\r") if line.strip()]


def _cut_short(element: Element, count: int, where: str) -> SceneError:
    return SceneError(
        f"ends after {count} of {element.count} entries of '{element.name}'", where=where, fix="is it cut short?"
    )


def _text_columns(element: Element, rows: list[bytes], where: str) -> Columns:
    try:
        table = [[float(word) for word in row.split()] for row in rows]
    except ValueError as error:
        raise SceneError(f"element '{element.name}': {error}", where=where, rule="numbers only") from None
    scalars: dict[str, list[float]] = {each.name: [] for each in element.properties if each.count_type is None}
    lists: dict[str, tuple[list[float], list[int]]] = {
        each.name: ([], []) for each in element.properties if each.count_type is not None
    }
    for number, row in enumerate(table):
        place = 0
        for each in element.properties:
            if place >= len(row):
                raise _short_row(element, number, where)
            if each.count_type is None:
                scalars[each.name].append(row[place])
                place += 1
                continue
            size = int(row[place]) if np.isfinite(row[place]) else -1
            if size < 0 or place + 1 + size > len(row):
                raise _short_row(element, number, where)
            values, sizes = lists[each.name]
            values.extend(row[place + 1 : place + 1 + size])
            sizes.append(size)
            place += 1 + size
    columns: dict[str, Numbers | Lists] = {name: np.array(values) for name, values in scalars.items()}
    columns |= {name: Lists(np.array(values), np.array(sizes, int)) for name, (values, sizes) in lists.items()}
    return columns


def _short_row(element: Element, number: int, where: str) -> SceneError:
    return SceneError(
        f"entry {number} of '{element.name}' has too few numbers", where=where, fix="is the file cut short?"
    )


@np.errstate(invalid="ignore")  # of damaged floats, which are looked at where they are used
def _binary_columns(element: Element, data: bytes, start: int, order: str, where: str) -> tuple[Columns, int]:
    """The element's columns and where the next element begins."""
    if not element.properties or element.count == 0:
        return {}, start
    first = _sizes_at(element, data, start, order, where)
    kinds: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
    for number, each in enumerate(element.properties):
        if each.count_type is not None:
            kinds.append((f"count {number}", order + each.count_type))
            kinds.append((f"{number}", order + each.type, (first[number],)))
        else:
            kinds.append((f"{number}", order + each.type))
    row = np.dtype(kinds)
    fits = start + element.count * row.itemsize <= len(data)
    if fits:
        table = np.frombuffer(data, row, element.count, start)
        if all((table[f"count {number}"] == size).all() for number, size in first.items()):
            columns: dict[str, Numbers | Lists] = {}
            for number, each in enumerate(element.properties):
                values = table[f"{number}"].astype(np.float64)
                if each.count_type is None:
                    columns[each.name] = values
                else:
                    columns[each.name] = Lists(values.ravel(), np.full(element.count, first[number]))
            return columns, start + element.count * row.itemsize
    elif not first:
        raise _cut_short(element, (len(data) - start) // row.itemsize, where)
    return _mixed_columns(element, data, start, order, where)


def _sizes_at(element: Element, data: bytes, start: int, order: str, where: str) -> dict[int, int]:
    """The size of each list of the entry at ``start``, by the number of its property."""
    sizes: dict[int, int] = {}
    place = start
    for number, each in enumerate(element.properties):
        if each.count_type is not None:
            kind = np.dtype(order + each.count_type)
            if place + kind.itemsize > len(data):
                raise _cut_short(element, 0, where)
            sizes[number] = int(np.frombuffer(data, kind, 1, place)[0])
            if sizes[number] < 0:
                raise SceneError(f"a list of {sizes[number]} numbers in '{element.name}'", where=where)
            place += kind.itemsize + sizes[number] * np.dtype(each.type).itemsize
        else:
            place += np.dtype(each.type).itemsize
    if place > len(data):
        raise _cut_short(element, 0, where)
    return sizes


def _mixed_columns(element: Element, data: bytes, start: int, order: str, where: str) -> tuple[Columns, int]:
    """Entries of different lengths: one after the other to find their places, then each column in one go."""
    endian = "little" if order == "<" else "big"
    shapes = [
        (
            np.dtype(each.count_type).itemsize if each.count_type is not None else 0,
            each.count_type is not None and each.count_type[0] == "i",
            np.dtype(each.type).itemsize,
        )
        for each in element.properties
    ]
    starts: list[list[int]] = [[] for _ in shapes]
    sizes: list[list[int]] = [[] for _ in shapes]
    place = start
    for entry in range(element.count):
        for number, (count_bytes, signed, item_bytes) in enumerate(shapes):
            size = 1
            if count_bytes:
                size = int.from_bytes(data[place : place + count_bytes], endian, signed=signed)  # type: ignore[arg-type]
                place += count_bytes
            starts[number].append(place)
            sizes[number].append(size)
            place += size * item_bytes
            if place > len(data) or size < 0:
                raise _cut_short(element, entry, where)
    buffer = np.frombuffer(data, np.uint8)
    columns: dict[str, Numbers | Lists] = {}
    for number, each in enumerate(element.properties):
        size_of = np.array(sizes[number])
        item = np.dtype(order + each.type)
        within = np.arange(size_of.sum()) - np.repeat(np.cumsum(size_of) - size_of, size_of)
        offsets = np.repeat(np.array(starts[number]), size_of) + within * item.itemsize
        raw = buffer[offsets[:, None] + np.arange(item.itemsize)]
        values = np.ascontiguousarray(raw).view(item).ravel().astype(np.float64)
        columns[each.name] = values if each.count_type is None else Lists(values, size_of)
    return columns, place
