"""Places of a folder's views, by the numbers in their files' names.

Numbers that all names share say nothing. Of the others the last one counts the views, or the last two side by side are
row and column, where rows and columns repeat; column and row where names say so (``x3_y0``, ``col3_row0``). Folders
of the 4D Light Field Benchmark count row by row, in rows as long as their ``parameters.cfg`` says; without it a square
number of views, counted from 0, is a square grid. Views of JPEG Pleno (``004_012.ppm``) are named by column, then
row, as its reference software (ISO/IEC 21794-4) writes and reads them. Names of the Stanford light field archive also
hold where the camera stood, ``out_ROW_COLUMN_Y_X``, in mm, x to the right and y downwards; their rows and columns run
either way.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from statistics import fmean

import numpy as np

from lippmann.errors import PictureError
from lippmann.quilts.quilt import QUILT_NAME
from lippmann.runtime.regular_file import unreadable

#: Row and column of a view, counted from the top left camera, or its number alone.
Place = tuple[int, ...]

_NUMBER = re.compile(r"[0-9]{1,9}")
#: The end of a name that says itself that its column comes first.
_COLUMN_FIRST = re.compile(r"(?<![a-z])(x|col|column)[ _=-]?\d+[^a-z0-9]*(y|row)[ _=-]?\d+\D*$", re.IGNORECASE)
_HCI = re.compile(r"input_Cam(\d{3,6})")
_HCI_COLUMNS = re.compile(rb"^\s*num_cams_x\s*=\s*([1-9]\d{0,4})\s*$", re.MULTILINE)
_PLENO = re.compile(r"(\d{3})_(\d{3})\.ppm", re.IGNORECASE)
_STANFORD = re.compile(r"_(\d{1,6})_(\d{1,6})_(-?\d{1,9}\.\d{1,9})_(-?\d{1,9}\.\d{1,9})(?![\d.])")


def list_views(folder: Path, endings: Collection[str]) -> list[Path]:
    """The pictures of a folder by name; hidden files and quilts are none.

    Raises
    ------
    PictureError
        If the folder cannot be read, or holds no picture.
    """
    try:
        paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in endings and path.name[0] != ".")
    except OSError as error:
        raise unreadable(folder, error, PictureError) from None
    if not (views := [path for path in paths if not QUILT_NAME.search(path.stem)]):
        raise PictureError("there are no views", where=str(folder), rule=f"they end in {', '.join(endings)}")
    return views


def places_of_views(paths: Sequence[Path]) -> dict[Place, Path]:
    """The files by row and column, or by one number.

    Raises
    ------
    PictureError
        If a name has no number, or two files are the same view.
    """
    stems = [path.stem for path in paths]
    if all(_STANFORD.search(stem) for stem in stems):
        return _by_place(paths, _stanford_places(stems))
    pleno = [match for path in paths if (match := _PLENO.fullmatch(path.name))]
    if len(pleno) == len(paths):
        return _by_place(paths, [(int(match[2]), int(match[1])) for match in pleno])
    if across := _benchmark_columns(paths):
        return _by_place(paths, [divmod(int(stem[len("input_Cam") :]), across) for stem in stems])
    numbers = [tuple(int(number) for number in _NUMBER.findall(stem)) for stem in stems]
    for path, parts in zip(paths, numbers, strict=True):
        if not parts:
            rule = "views are numbered, or named by row and column"
            raise PictureError("the name has no number", where=str(path), rule=rule, fix="rename it: view_00, view_01")
    if len({len(parts) for parts in numbers}) > 1:
        return _by_place(paths, [parts[-1:] for parts in numbers])
    columns = list(zip(*numbers, strict=True))
    varying = [index for index, column in enumerate(columns) if len(set(column)) > 1] or [len(columns) - 1]
    last = varying[-1]
    repeating = [index for index in varying if len(set(columns[index])) < len(paths)]
    pair = (last - 1, last) if {last - 1, last} <= {*repeating} else (last,)
    if all(map(_COLUMN_FIRST.search, stems)):
        pair = pair[::-1]
    return _by_place(paths, [tuple(parts[index] for index in pair) for parts in numbers])


def _by_place(paths: Iterable[Path], places: Iterable[Place]) -> dict[Place, Path]:
    by_place: dict[Place, Path] = {}
    for path, place in zip(paths, places, strict=True):
        if place in by_place:
            raise PictureError(f"is the same view as {by_place[place].name}", where=str(path))
        by_place[place] = path
    return by_place


def _stanford_places(stems: Sequence[str]) -> list[Place]:
    """Row and column, turned where the cameras stand the other way round."""
    fields = [match.groups() for stem in stems if (match := _STANFORD.search(stem))]
    places = np.array([[int(row), int(column)] for row, column, _, _ in fields])
    for axis in (0, 1):
        numbers = places[:, axis]
        first, last = int(numbers.min()), int(numbers.max())
        ends = [
            fmean(float(parts[2 + axis]) for parts, number in zip(fields, numbers, strict=True) if number == end)
            for end in (first, last)
        ]
        if ends[0] > ends[1]:
            places[:, axis] = first + last - numbers
    return [(int(row), int(column)) for row, column in places]


def _benchmark_columns(paths: Sequence[Path]) -> int | None:
    """Views in a row of a folder of the 4D Light Field Benchmark, None of other folders."""
    if not all(_HCI.fullmatch(path.stem) for path in paths):
        return None
    parameters, side = paths[0].with_name("parameters.cfg"), math.isqrt(len(paths))
    if not parameters.is_file():
        is_square = {int(path.stem[len("input_Cam") :]) for path in paths} == set(range(side * side))
        return side if is_square else None
    with parameters.open("rb") as file:
        match = _HCI_COLUMNS.search(file.read(1 << 16))
    return int(match[1]) if match else None


def line_of_grid(paths: Sequence[Path], *, down: bool = False) -> tuple[list[Path], tuple[str, ...]]:
    """Of a whole grid of cameras the middle row, or the middle column where views part ``down``; and notes.

    Pictures of other names are returned as they are, none as none.
    """
    if not paths:
        return [], ()
    try:
        by_place = places_of_views(paths)
    except PictureError:
        return list(paths), ()
    axes = [sorted(set(numbers)) for numbers in zip(*by_place, strict=True)]
    if len(axes) != 2 or min(map(len, axes)) < 2 or len(axes[0]) * len(axes[1]) != len(paths):
        return list(paths), ()
    kept = 1 if down else 0
    middle = axes[kept][len(axes[kept]) // 2]
    line = [by_place[place] for place in sorted(by_place) if place[kept] == middle]
    word = "column" if down else "row"
    note = f"of a grid of {len(axes[1])} x {len(axes[0])} cameras the middle {word} is taken: {len(line)} views"
    return line, (note,)


def middle_row(by_place: Mapping[Place, Path]) -> tuple[dict[int, Path], int]:
    """Of a grid the views of the middle row by column, else all by number; and how many rows there are."""
    rows = sorted({place[:-1] for place in by_place})
    middle = rows[len(rows) // 2]
    return {place[-1]: path for place, path in by_place.items() if place[:-1] == middle}, len(rows)
