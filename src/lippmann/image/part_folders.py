"""Folders of views or micro-images: an integral image as one picture file per view or lens, and back.

The manifest ``lippmann.json`` holds the metadata of the picture, the kind of the parts, the type of their values, and
their file names in rows and columns. A folder gives its picture back exactly, in the type in which it was stored.
Pictures on disk are read and written piece by piece.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal, cast, get_args

import numpy as np

from lippmann.display import Display, micro_image_shape, pixel_indices_under_lens, pixel_lenses
from lippmann.display.micro_image_layout import row_blocks
from lippmann.display.panel import PixelWindow
from lippmann.errors import OutputError, PictureError
from lippmann.image.encoding import STORED, FormatName, converted_values, encode_values, linear_values
from lippmann.image.integral_image import IntegralImage, Picture
from lippmann.image.metadata import KEY, Metadata, from_dict, parse_json
from lippmann.image.micro_images import Permutation, micro_images_as_views
from lippmann.image.read import open_file
from lippmann.image.stored_values import Layer, Stored, Values
from lippmann.image.views import (
    ViewGrid,
    exact_view_shape,
    lens_rows,
    panel_rows_of_view_rows,
    pixels_of_view_rows,
    view_grid,
)
from lippmann.image.write import stored_as
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.runtime.atomic_write import replacing_folder
from lippmann.runtime.regular_file import check_kind, unreadable

MANIFEST = "lippmann.json"

#: Bytes of views gathered at a time; a picture on disk is read once for each lot of views.
LOT_BYTES = 1 << 29

Kind = Literal["views", "micro-images"]
#: Gives the values of a rectangle of pixels, one or more each.
Source = Callable[[PixelWindow], Layer]
#: Row and column of a view or lens, its layers (RGB linear or as stored), and the progress made with it.
Part = tuple[tuple[int, int], dict[str, Layer], Progress]

#: Beginnings of the files' names.
_PREFIX: dict[Kind, str] = {"views": "view", "micro-images": "lens"}

#: Order of the rows and columns of files, for people who read the manifest.
_ORDER: dict[Kind, str] = {
    "views": "by row, then column, of the pixel under each lens; the rightmost column is seen from the far left",
    "micro-images": "by row, then column, of the lens, from the top left",
}


@dataclass(frozen=True, eq=False)
class _Manifest:
    """Content of a manifest; ``files`` are names in rows and columns, None for a part without pixels."""

    metadata: Metadata
    kind: Kind
    stored: Stored
    files: list[list[str | None]]

    @property
    def named(self) -> Iterator[tuple[int, int, str]]:
        for row, names in enumerate(self.files):
            for column, name in enumerate(names):
                if name is not None:
                    yield row, column, name


def write_views(
    picture: Picture,
    folder: Path,
    *,
    format: FormatName | None = None,
    bits: int | None = None,
    progress: ProgressCallback = silent,
) -> int:
    """Write one picture per view, ``view_ROW_COLUMN``, each with one pixel per lens.

    The views of a lenticular sheet are as high as the panel. Where lenses do not cover whole pixels the views are
    resampled (nearest pixel), and cannot be composed again. :data:`LOT_BYTES` of views are held at a time, and a
    picture on disk is read once for each such lot.

    Parameters
    ----------
    picture:
        In memory or on disk.
    folder:
        The folder to make.
    format:
        ``png``, ``exr``, ``tiff`` or ``zarr``; by default PNG for pictures from files with codes, else OpenEXR, which
        keeps the maps of a picture in memory where its views are exact.
    bits:
        Per channel: 8 or 16 (``png``), 32 or 16 (``exr``), 8, 16 or 32 (``tiff``, ``zarr``); by default as in the file
        that the picture came from.
    progress:
        Called for every view written.

    Returns
    -------
    The number of views written: those that hold any pixel.

    Raises
    ------
    OutputError
        If the format is unknown or has no such bits, or the folder cannot be written.
    """
    storage = _storage(picture, folder, format, bits)
    grid = view_grid(picture.display)
    layers = _layers(picture, with_maps=storage[0] == "exr" and grid.exact)
    shape = len(grid.down), len(grid.right)
    return _write_parts(picture, folder, "views", shape, _views(picture.display, grid, layers), storage, progress)


def write_micro_images(
    picture: Picture,
    folder: Path,
    *,
    format: FormatName | None = None,
    bits: int | None = None,
    progress: ProgressCallback = silent,
) -> int:
    """Write one picture per lens, ``lens_ROW_COLUMN``, exactly; places that hold no pixel of the lens are black.

    Parameters
    ----------
    picture:
        In memory or on disk.
    folder:
        The folder to make.
    format, bits:
        File format and bits per channel, as for :func:`write_views`; OpenEXR keeps the maps of a picture in memory.
    progress:
        Called for every micro-image written.

    Returns
    -------
    The number of micro-images written: those of lenses that have any pixel.

    Raises
    ------
    OutputError
        If the format is unknown or has no such bits, or the folder cannot be written.
    """
    storage = _storage(picture, folder, format, bits)
    grid, layers = picture.display.lens_grid, _layers(picture, with_maps=storage[0] == "exr")
    parts = _micro_images(picture.display, layers)
    return _write_parts(picture, folder, "micro-images", (grid.rows, grid.columns), parts, storage, progress)


def compose(folder: Path, *, progress: ProgressCallback = silent) -> IntegralImage:
    """Read the integral image of a folder of views or micro-images.

    Parameters
    ----------
    folder:
        Written by :func:`write_views` or :func:`write_micro_images`.
    progress:
        Called for every file read.

    Raises
    ------
    PictureError
        If the manifest or a file is missing, damaged or does not fit the others; names the file.
    """
    manifest = _read_manifest(folder)
    rows, columns, height, width = _part_shape(manifest, folder)
    parts: dict[str, Layer] = {}
    for row, column, name in manifest.named:
        layers = _read_part(folder / name, manifest, height, width)
        if not parts:
            parts = {key: np.zeros((rows, columns, *values.shape), values.dtype) for key, values in layers.items()}
        if {k: (v.shape, v.dtype) for k, v in layers.items()} != {k: (v.shape[2:], v.dtype) for k, v in parts.items()}:
            rule = "all files of a folder have the same"
            raise PictureError(f"has the layers {_names(layers)}", where=str(folder / name), rule=rule)
        for key, values in layers.items():
            parts[key][row, column] = values
        progress(Progress("read", row * columns + column + 1, rows * columns))
    metadata = manifest.metadata
    permutation = Permutation(metadata.display)
    if manifest.kind == "views":
        parts = {key: micro_images_as_views(values, metadata.display) for key, values in parts.items()}
    maps = {key: permutation.join(values) for key, values in parts.items()}
    pixels = np.asarray(maps.pop(""), dtype=np.float32)
    return IntegralImage(
        pixels, metadata.display, metadata.world_from_display, metadata.provenance, maps, stored=manifest.stored
    )


def _storage(picture: Picture, folder: Path, name: FormatName | None, bits: int | None) -> tuple[FormatName, Stored]:
    """Format and type of the values of a folder's files: as requested, else as the picture is stored."""
    if name is None:
        name = "png" if picture.stored in STORED["png"].values() else "exr"
    if name not in STORED:
        raise OutputError.unknown("format", name, STORED, where=str(folder))
    if bits is None and picture.stored in STORED[name].values():
        return name, picture.stored
    return name, stored_as(name, folder, bits, picture.stored)


def _layers(picture: Picture, *, with_maps: bool) -> dict[str, Source]:
    """Sources of the RGB, ``""``, as the picture holds it, and of its maps by name."""
    maps = {name: partial(_window_of, values) for name, values in picture.maps.items()} if with_maps else {}
    return {"": picture.window, **maps}


def _window_of(values: Layer, window: PixelWindow) -> Layer:
    return values[window.slices]


def _write_parts(
    picture: Picture,
    folder: Path,
    kind: Kind,
    shape: tuple[int, int],
    parts: Iterator[Part],
    storage: tuple[FormatName, Stored],
    progress: ProgressCallback,
) -> int:
    """Write the parts, in ``shape`` rows and columns, and the manifest; returns the number of parts."""
    name, stored = storage
    transfer = picture.provenance.transfer
    files: list[list[str | None]] = [[None] * shape[1] for _ in range(shape[0])]
    with replacing_folder(folder) as temporary:
        for (row, column), layers, report in parts:
            file = _part_name(kind, name, shape, (row, column))
            files[row][column] = file
            values = converted_values(cast("Values", layers[""]), stored, transfer)
            encode_values(temporary / file, name, {**layers, "": values}, transfer=transfer)
            progress(report)
        manifest = {
            **picture.metadata.to_dict(),
            "kind": kind,
            "stored": stored,
            "order": _ORDER[kind],
            "exact": kind == "micro-images" or picture.views_are_exact,
            "files": files,
        }
        text = json.dumps(manifest, allow_nan=False, indent=1)
        (temporary / MANIFEST).write_text(text + "\n", encoding="ascii")
    return sum(file is not None for row in files for file in row)


def _views(display: Display, grid: ViewGrid, layers: Mapping[str, Source]) -> Iterator[Part]:
    """The views that have any pixel, gathered in lots of :data:`LOT_BYTES`."""
    rows, columns = lens_rows(display), display.lens_grid.columns
    panel_rows = max(1, display.panel.height // rows)
    places = list(np.ndindex(len(grid.down), len(grid.right)))
    pixels, step = _first_pixels(layers, rows * columns)
    for lot in (places[start : start + step] for start in range(0, len(places), step)):
        views = {key: np.zeros((len(lot), rows, columns, *one.shape), one.dtype) for key, one in pixels.items()}
        has_any = np.zeros(len(lot), dtype=np.bool_)
        for first, last in row_blocks(rows, display.panel.width * panel_rows):
            top, bottom = panel_rows_of_view_rows(display, first, last)
            window = PixelWindow(0, top, display.panel.width, bottom - top)
            values = {key: layer(window) for key, layer in layers.items()}
            for number, view in enumerate(lot):
                valid, row, column = pixels_of_view_rows(display, grid, view, first, last)
                if not valid.any():
                    continue
                has_any[number] = True
                place = np.where(valid, row - top, 0), np.where(valid, column, 0)
                absent = np.broadcast_to(~valid, place[0].shape)
                for key, layer in values.items():
                    part = layer[place]
                    part[absent] = 0
                    views[key][number, first:last] = part
        for number in np.flatnonzero(has_any).tolist():
            ky, kx = lot[number]
            report = Progress("write", ky * len(grid.right) + kx + 1, len(places))
            yield (ky, kx), {key: values[number] for key, values in views.items()}, report


def _micro_images(display: Display, layers: Mapping[str, Source]) -> Iterator[Part]:
    """The micro-images ``(ny, nx, ...)`` of the lenses that have a pixel.

    A row of lenses is held at a time; of a lenticular sheet, whose one row has all pixels, as many lenses as fit into
    :data:`LOT_BYTES`.
    """
    ny, nx = micro_image_shape(display)
    grid, panel = display.lens_grid, display.panel
    pixels, together = _first_pixels(layers, ny * nx)
    is_sheet = display.lens_array.layout == "lenticular"
    for row, first in itertools.product(range(grid.rows), range(0, grid.columns, together)):
        reach = (0, panel.height) if is_sheet else panel_rows_of_view_rows(display, row, row + 1)
        count = min(together, grid.columns - first)
        lenses = {key: np.zeros((count, ny, nx, *one.shape), one.dtype) for key, one in pixels.items()}
        has_any = np.zeros(count, dtype=np.bool_)
        for start, stop in row_blocks(reach[1] - reach[0], panel.width):
            span = reach[0] + start, reach[0] + stop
            i, j = pixel_lenses(display, span)
            k_x, k_y = pixel_indices_under_lens(display, span)
            v, u = np.nonzero((j == row) & (i >= first) & (i < first + count))
            if not len(u):
                continue
            place = i[v, u] - first, k_y[v, u], k_x[v, u]
            has_any[place[0]] = True
            left, right = int(u.min()), int(u.max()) + 1
            window = PixelWindow(left, span[0], right - left, span[1] - span[0])
            for key, layer in layers.items():
                lenses[key][place] = layer(window)[v, u - left]
        for number in np.flatnonzero(has_any).tolist():
            report = Progress("write", row * grid.columns + first + number + 1, grid.rows * grid.columns)
            yield (row, first + number), {key: values[number] for key, values in lenses.items()}, report


def _first_pixels(layers: Mapping[str, Source], size: int) -> tuple[dict[str, Layer], int]:
    """First pixel of each layer, for its shape and type, and the number of parts of ``size`` pixels held at a time."""
    pixels = {key: layer(PixelWindow(0, 0, 1, 1))[0, 0] for key, layer in layers.items()}
    return pixels, max(1, LOT_BYTES // (size * sum(pixel.nbytes for pixel in pixels.values())))


def _part_name(kind: Kind, name: FormatName, shape: tuple[int, int], place: tuple[int, int]) -> str:
    """File name of the part in row and column ``place`` of ``shape`` rows and columns."""
    digits = len(str(max(shape) - 1))
    ending = {"png": ".png", "exr": ".exr", "tiff": ".tif", "zarr": ".zarr"}[name]
    return f"{_PREFIX[kind]}_{place[0]:0{digits}}_{place[1]:0{digits}}{ending}"


def _read_manifest(folder: Path) -> _Manifest:
    path = folder / MANIFEST
    try:
        check_kind(path, PictureError)
        values = parse_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        rule = "give a folder written by 'lippmann views' or 'lippmann micro-images'"
        raise unreadable(path, error, PictureError, rule) from error
    except UnicodeDecodeError:
        values = None
    if not isinstance(values, dict) or KEY not in values:
        raise PictureError("describes no folder of views or micro-images", where=str(path))
    metadata = from_dict(values, str(path))
    kind, stored, files = (values.get(key) for key in ("kind", "stored", "files"))
    if kind not in get_args(Kind):
        raise PictureError(f"kind is {kind!r}", where=str(path), rule=f"it must be one of {', '.join(get_args(Kind))}")
    if stored not in get_args(Stored):
        rule = f"it must be one of {', '.join(get_args(Stored))}"
        raise PictureError(f"stored is {stored!r}", where=str(path), rule=rule)
    if not isinstance(files, list) or not all(isinstance(row, list) and all(map(_is_name, row)) for row in files):
        rule = "it must be rows of names of files in this folder"
        raise PictureError("'files' makes no sense", where=str(path), rule=rule)
    return _Manifest(metadata, cast("Kind", kind), cast("Stored", stored), files)


def _is_name(value: object) -> bool:
    """Whether this is None or the name of a file in the folder itself; no path may lead out of it."""
    if not isinstance(value, str):
        return value is None
    is_text = not any(sign == "\0" or "\ud800" <= sign <= "\udfff" for sign in value)
    return is_text and Path(value).name == value and value != ".."


def _part_shape(manifest: _Manifest, folder: Path) -> tuple[int, int, int, int]:
    """Rows and columns of files, height and width of each, checked against the display."""
    path, display = str(folder / MANIFEST), manifest.metadata.display
    try:
        shape = exact_view_shape(display) if manifest.kind == "views" else Permutation(display).shape
    except PictureError as error:
        raise PictureError(error.what, where=path, rule=error.rule, fix=error.fix) from error
    rows, columns = shape[:2]
    if len(manifest.files) != rows or any(len(row) != columns for row in manifest.files):
        rule = f"the {manifest.kind} of the display {display.name} are {columns} x {rows}"
        raise PictureError(f"'files' does not have {rows} rows of {columns}", where=path, rule=rule)
    present = Permutation(display).mask
    mask = micro_images_as_views(present, display) if manifest.kind == "views" else present
    for row, column in np.argwhere(mask.any(axis=(2, 3))).tolist():
        if manifest.files[row][column] is None:
            raise PictureError(f"'files' has no name in row {row}, column {column}", where=path)
    return shape


def _read_part(path: Path, manifest: _Manifest, height: int, width: int) -> dict[str, Layer]:
    """Layers of a part: linear RGB under ``""``, and its maps."""
    file = open_file(path)
    if (file.height, file.width) != (height, width):
        rule = f"the {manifest.kind} of this folder have {width} x {height}"
        raise PictureError(f"has {file.width} x {file.height} pixels", where=str(path), rule=rule)
    values, layers = file.decode()
    if values.dtype.name != manifest.stored:
        rule = f"{MANIFEST} says {manifest.stored}"
        raise PictureError(f"holds {values.dtype.name} values", where=str(path), rule=rule)
    return {"": linear_values(values, manifest.metadata.provenance.transfer), **layers}


def _names(layers: Mapping[str, Layer]) -> str:
    return ", ".join(name or "RGB" for name in layers)
