"""Folders of views: one picture per camera, ``cam_ROW_COLUMN``, counted from the top left.

Other programs' folders are read, too: files whose names end in two numbers, row and column, or in one that counts row
by row, from 0 or 1. (``lippmann views`` writes folders of another kind: views counted by the pixel under each lens.)
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import get_args

import numpy as np

from lippmann.display import Display
from lippmann.errors import PictureError
from lippmann.exchange.light_field import LightField, check_rectangular
from lippmann.exchange.metadata_text import read_note_file, write_note_file
from lippmann.exchange.view_files import read_view_files, write_view
from lippmann.image.encoding import FormatName
from lippmann.image.metadata import parse_json
from lippmann.image.part_folders import MANIFEST, Kind
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.runtime.atomic_write import replacing_folder

LAYOUT = "views"

Place = tuple[int, ...]

#: Endings of the pictures that are read.
_READ = (".png", ".exr", ".tif", ".tiff")

_TWO = re.compile(r"(\d{1,6})\D(\d{1,6})\D*$")
_ONE = re.compile(r"(\d{1,9})\D*$")


def write_view_folder(
    light_field: LightField, display: Display, folder: Path, *, progress: ProgressCallback = silent
) -> None:
    """Write codes as PNG, floats as OpenEXR.

    Raises
    ------
    PictureError, OutputError
        If the display's views are not what a grid of cameras sees, or the folder cannot be written.
    """
    check_rectangular(display, "a folder of views")
    name: FormatName = "png" if light_field.values.dtype.kind == "u" else "exr"
    down, across = light_field.shape[:2]
    digits = len(str(max(down, across) - 1))
    with replacing_folder(folder) as temporary:
        for number in range(down * across):
            row, column = divmod(number, across)
            path = temporary / f"cam_{row:0{digits}}_{column:0{digits}}.{name}"
            write_view(path, name, light_field.values[row, column], light_field.transfer)
            progress(Progress("write", number + 1, down * across))
        write_note_file(temporary, light_field.metadata, LAYOUT)


def read_view_folder(
    folder: Path, *, grid: tuple[int, int] | None = None, progress: ProgressCallback = silent
) -> LightField:
    """Read a folder of views.

    ``grid`` is how many there are across and down; needed where their names count row by row.

    Raises
    ------
    PictureError
        If a view is absent, doubled, damaged or of another size or type than the first, or there is no telling which
        view a file is.
    """
    metadata = read_note_file(folder, LAYOUT)
    paths = _in_rows(_numbered(folder), folder, grid)
    transfer = "srgb" if metadata is None else metadata.provenance.transfer
    return LightField(read_view_files(paths, transfer, progress), metadata)


def _numbered(folder: Path) -> Mapping[Place, Path]:
    """The files by the numbers in their names: row and column, or one number."""
    try:
        paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in _READ and path.name[0] != ".")
    except OSError as error:
        raise PictureError(f"cannot be read: {error.strerror}", where=str(folder)) from None
    if not paths:
        raise PictureError("there are no views", where=str(folder), rule=f"they end in {', '.join(_READ)}")
    pattern = _TWO if all(_TWO.search(path.stem) for path in paths) else _ONE
    found: dict[Place, Path] = {}
    for path in paths:
        numbers = pattern.search(path.stem)
        if numbers is None:
            rule = "views are named by row and column, or counted row by row"
            raise PictureError("the name has no number", where=str(path), rule=rule)
        place = tuple(int(number) for number in numbers.groups())
        if place in found:
            raise PictureError(f"is the same view as {found[place].name}", where=str(path))
        found[place] = path
    return found


def _in_rows(found: Mapping[Place, Path], folder: Path, grid: tuple[int, int] | None) -> list[list[Path]]:
    first = np.array(sorted(found)).min(axis=0)
    if (first > 1).any():
        raise PictureError("the first view is absent", where=str(folder), rule="views are counted from 0 or 1")
    counted = len(first) == 1
    if counted and grid is None:
        rule = "their names count them row by row"
        raise PictureError(
            "there is no telling how many views make a row", where=str(folder), rule=rule, fix="say --display"
        )
    last = np.array(list(found)).max(axis=0) - first
    across, down = grid if grid is not None and counted else (int(last[-1]) + 1, int(last[0]) + 1)
    if counted and len(found) != across * down:
        rule = f"the display has {across} x {down}"
        raise PictureError(f"holds {len(found)} views", where=str(folder), rule=rule)
    rows: list[list[Path]] = []
    for row in range(down):
        rows.append([])
        for column in range(across):
            place = (row * across + column,) if counted else (row, column)
            number = tuple(int(n) for n in np.add(place, first))
            if number not in found:
                what = f"view {number[0]}" if counted else f"the view in row {number[0]}, column {number[1]},"
                raise PictureError(f"{what} is absent", where=str(folder))
            rows[row].append(found[number])
    return rows


def is_composable(folder: Path) -> bool:
    """Whether the folder is one of ``lippmann views`` or ``micro-images``, for :func:`lippmann.image.compose`."""
    try:
        values = parse_json((folder / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError):
        return False
    return isinstance(values, dict) and values.get("kind") in get_args(Kind)
