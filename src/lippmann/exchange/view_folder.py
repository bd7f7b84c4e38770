"""Folders of views: one picture file per camera, named ``cam_ROW_COLUMN``, counted from the top left.

Folders of other programs are read if the file names end in two numbers (row and column) or in one number that counts
row by row, from 0 or 1. The folders that :func:`lippmann.image.write_views` writes are a different layout: their views
are counted by the pixel under each lens, which runs opposite to the cameras.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import get_args

import numpy as np

from lippmann.codecs.picture_notes import FileNotes
from lippmann.color.transfer import Transfer
from lippmann.display import Display
from lippmann.errors import PictureError
from lippmann.exchange.light_field import LightField, check_rectangular
from lippmann.exchange.metadata_text import read_note_file, write_note_file
from lippmann.image.encoding import FormatName, encode_values
from lippmann.image.metadata import parse_json
from lippmann.image.part_folders import MANIFEST, Kind
from lippmann.image.stored_values import Values
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.quilts.files import READ, open_view
from lippmann.quilts.view_names import Place, list_views, places_of_views
from lippmann.runtime.atomic_write import replacing_folder

LAYOUT = "views"

#: The end of names of a single row or column of views, whose other number all share.
_TWO = re.compile(r"(\d{1,6})\D(\d{1,6})\D*$")


def write_view_folder(
    light_field: LightField, display: Display, folder: Path, *, progress: ProgressCallback = silent
) -> None:
    """Write a folder of views: codes as PNG, floats as OpenEXR.

    Parameters
    ----------
    light_field:
        The views; maps are not written.
    display:
        The display whose views these are.
    folder:
        The folder; appears whole or not at all.
    progress:
        Called after every view.

    Raises
    ------
    PictureError
        If the display's views are not those of a rectangular grid of cameras.
    OutputError
        If the folder cannot be written.
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

    Parameters
    ----------
    folder:
        The folder.
    grid:
        Views across and down; required if the file names hold a single number.
    progress:
        Called after every view.

    Raises
    ------
    PictureError
        If a view is missing, doubled or damaged, differs from the first in size or type, or has no number in its name.
    """
    metadata = read_note_file(folder, LAYOUT)
    paths = _in_rows(places_of_views(list_views(folder, READ)), folder, grid)
    values, notes = read_view_files(paths, progress)
    return LightField(values, metadata, notes=notes)


def _in_rows(by_place: Mapping[Place, Path], folder: Path, grid: tuple[int, int] | None) -> list[list[Path]]:
    """The files in rows; a missing view raises :class:`PictureError`."""
    if grid is None and all(len(place) == 1 for place in by_place):
        by_place = _in_line(by_place)
    first = np.array(sorted(by_place)).min(axis=0)
    if (first > 1).any():
        raise PictureError("the first view is missing", where=str(folder), rule="views are counted from 0 or 1")
    counted = len(first) == 1
    if counted and grid is None:
        rule = "their names hold one number"
        raise PictureError(
            "the number of views in a row is unknown", where=str(folder), rule=rule, fix="say display=..."
        )
    last = np.array(list(by_place)).max(axis=0) - first
    across, down = grid if grid is not None and counted else (int(last[-1]) + 1, int(last[0]) + 1)
    if counted and len(by_place) != across * down:
        rule = f"the display has {across} x {down}"
        fix = "weave views of a camera that moves sideways: lippmann weave"
        raise PictureError(f"holds {len(by_place)} views", where=str(folder), rule=rule, fix=fix)
    rows: list[list[Path]] = []
    for row in range(down):
        rows.append([])
        for column in range(across):
            place = (row * across + column,) if counted else (row, column)
            number = tuple(int(n) for n in np.add(place, first))
            if number not in by_place:
                what = f"view {number[0]}" if counted else f"the view in row {number[0]}, column {number[1]},"
                raise PictureError(f"{what} is missing", where=str(folder))
            rows[row].append(by_place[number])
    return rows


def _in_line(by_place: Mapping[Place, Path]) -> Mapping[Place, Path]:
    """Numbered files as one row or column of views, if their names end in the two numbers of such."""
    rows = [int(match[1]) for path in by_place.values() if (match := _TWO.search(path.stem))]
    if len(rows) < len(by_place):
        return by_place
    if len(set(rows)) == 1:
        return {(0, number): path for (number,), path in by_place.items()}
    if rows == [number for (number,) in by_place]:
        return {(number, 0): path for (number,), path in by_place.items()}
    return by_place


def is_composable(folder: Path) -> bool:
    """Whether :func:`lippmann.image.compose` reads the folder: written by ``write_views`` or ``write_micro_images``."""
    try:
        values = parse_json((folder / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError):
        return False
    return isinstance(values, dict) and values.get("kind") in get_args(Kind)


# ---- Picture files of the views --------------------------------------------------------------------------------------


def write_view(path: Path, name: FormatName, values: Values, transfer: Transfer) -> None:
    """Write a view ``(H, W, 3)``: codes as PNG, or floats as OpenEXR (``name``), without loss."""
    # A view may be cut out of an array in another order, which encoders do not take.
    encode_values(path, name, {"": values.copy()}, transfer=transfer)


def read_view_files(
    paths: Sequence[Sequence[Path]], progress: ProgressCallback = silent
) -> tuple[Values, tuple[str, ...]]:
    """The views of rows of picture files, ``(t, s, v, u, 3)``, in the type in which they are stored, and notes.

    ``progress`` is called after every file.

    Raises
    ------
    PictureError
        If a file is missing or damaged, holds transparent colours, or differs from the first in size or type.
    """
    down, across = len(paths), len(paths[0])
    views, notes = None, FileNotes()
    for number, path in enumerate(path for row in paths for path in row):
        with open_view(path) as file:
            notes.add(path.name, file.notes)
            view = file.read()
        if views is None:
            first = view
            views = np.empty((down, across, *first.shape), dtype=first.dtype)
        if view.shape != first.shape:
            rule = f"the first view, {paths[0][0].name}, has {_size(first)}"
            raise PictureError(f"has {_size(view)} pixels", where=str(path), rule=rule)
        if view.dtype != first.dtype:
            rule = f"the first view, {paths[0][0].name}, holds {first.dtype}"
            raise PictureError(f"holds {view.dtype} values", where=str(path), rule=rule)
        views[divmod(number, across)] = view
        progress(Progress("read", number + 1, down * across))
    assert views is not None  # there are views
    return views, notes.lines()


def _size(view: Values) -> str:
    return f"{view.shape[1]} x {view.shape[0]}"
