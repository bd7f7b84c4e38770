"""An integral image as a folder of views or of micro-images, and back.

The folder holds one picture file per view (lens) and ``lippmann.json``, which says what they are: the metadata of the
picture, the kind of the parts, how values are stored, and the files in rows and columns. Together they give the
picture back exactly, in the depth in which it was stored. Pictures larger than memory are written piece by piece.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from lippmann.display import micro_image_shape, pixel_indices_under_lens, pixel_lenses
from lippmann.display.pixel_window import PixelWindow
from lippmann.errors import OutputError, PictureError
from lippmann.image.encoding import (
    STORED,
    FormatName,
    converted_values,
    decode_file,
    encode_values,
    read_header,
)
from lippmann.image.integral_image import IntegralImage
from lippmann.image.metadata import KEY, Metadata, from_dict, parse_json
from lippmann.image.micro_images import Permutation, micro_images_as_views, row_blocks
from lippmann.image.stored_values import Stored
from lippmann.image.streamed import LargePicture
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

MANIFEST = "lippmann.json"

#: Bytes of views that are gathered at a time; a large picture is read once for each such lot.
LOT_BYTES = 1 << 29

Kind = Literal["views", "micro-images"]
#: Row and column of a view or lens, its layers with the RGB linear or as stored, and how far the work is with it.
Part = tuple[tuple[int, int], dict[str, NDArray[Any]], Progress]

#: Beginnings of the files' names.
_PREFIX: dict[Kind, str] = {"views": "view", "micro-images": "lens"}

#: What the rows and columns of the files are, for the people who read the manifest.
_ORDER: dict[Kind, str] = {
    "views": "by row, then column, of the pixel under each lens; the rightmost column is seen from the far left",
    "micro-images": "by row, then column, of the lens, from the top left",
}


@dataclass(frozen=True, eq=False)
class _Manifest:
    """``files`` are the names in rows and columns, None where there is nothing to see."""

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
    image: IntegralImage,
    folder: Path,
    *,
    format: FormatName | None = None,
    bits: int | None = None,
    progress: ProgressCallback = silent,
) -> int:
    """Write one picture per view, ``view_ROW_COLUMN``, each with one pixel per lens.

    Those of a lenticular sheet are as high as the panel. ``format`` and ``bits`` say how values are stored (``png`` 8
    or 16, ``exr`` 32 or 16, ``tiff`` 8, 16 or 32); by default as in the file that the picture came from, computed
    pictures as 32-bit OpenEXR. Where lenses do not cover whole pixels the views are resampled, and cannot be put
    together again; elsewhere OpenEXR keeps the picture's maps too.

    Returns
    -------
    The number of views written: those that hold any pixel.

    Raises
    ------
    OutputError
        If the format is unknown or has no such bits, or the folder cannot be written.
    """
    storage = _storage(image, folder, format, bits)
    views, mask = image.views_and_mask()
    parts: dict[str, NDArray[Any]] = {"": views}
    if storage[0] == "exr" and image.views_are_exact:
        split = Permutation(image.display).split
        parts |= {k: micro_images_as_views(split(v), image.display) for k, v in image.maps.items()}
    return _write_parts(image, folder, "views", mask.shape[:2], _parts(parts, mask), storage, progress)


def write_micro_images(
    image: IntegralImage,
    folder: Path,
    *,
    format: FormatName | None = None,
    bits: int | None = None,
    progress: ProgressCallback = silent,
) -> int:
    """Write one picture per lens, ``lens_ROW_COLUMN``; parameters and errors as for :func:`write_views`.

    Exact on every display. Places of a micro-image's box that hold no pixel of the lens are black. Returns the number
    of micro-images written.
    """
    storage = _storage(image, folder, format, bits)
    permutation = Permutation(image.display)
    layers = {"": image.pixels, **image.maps} if storage[0] == "exr" else {"": image.pixels}
    cut = _parts({k: permutation.split(v) for k, v in layers.items()}, permutation.mask)
    return _write_parts(image, folder, "micro-images", permutation.shape[:2], cut, storage, progress)


def write_large_views(
    picture: LargePicture,
    folder: Path,
    *,
    format: FormatName | None = None,
    bits: int | None = None,
    progress: ProgressCallback = silent,
) -> int:
    """:func:`write_views` for a picture that is read piece by piece."""
    storage = _storage(picture, folder, format, bits)
    grid = view_grid(picture.display)
    shape = len(grid.down), len(grid.right)
    return _write_parts(picture, folder, "views", shape, _large_views(picture, grid), storage, progress)


def write_large_micro_images(
    picture: LargePicture,
    folder: Path,
    *,
    format: FormatName | None = None,
    bits: int | None = None,
    progress: ProgressCallback = silent,
) -> int:
    """:func:`write_micro_images` for a picture that is read piece by piece.

    A row of lenses is held at a time; of a lenticular sheet, whose one row has all pixels, as many lenses as fit.
    """
    storage = _storage(picture, folder, format, bits)
    shape = picture.display.lens_grid.rows, picture.display.lens_grid.columns
    return _write_parts(picture, folder, "micro-images", shape, _large_lenses(picture), storage, progress)


def compose(folder: Path, *, progress: ProgressCallback = silent) -> IntegralImage:
    """The integral image of a folder that :func:`write_views` or :func:`write_micro_images` wrote.

    Raises
    ------
    PictureError
        If the manifest or a file is missing, damaged or does not fit the others; names the file.
    """
    manifest = _read_manifest(folder)
    rows, columns, height, width = _part_shape(manifest, folder)
    parts: dict[str, NDArray[Any]] = {}
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
    pixels = maps.pop("")
    return IntegralImage(
        pixels, metadata.display, metadata.world_from_display, metadata.provenance, maps, stored=manifest.stored
    )


def _storage(
    image: IntegralImage | LargePicture, folder: Path, name: FormatName | None, bits: int | None
) -> tuple[FormatName, Stored]:
    """The format and the type of the values of a folder's files: as asked for, else as the picture is stored."""
    if name is None:
        name = "png" if image.stored in STORED["png"].values() else "exr"
    if name not in STORED:
        rule = f"known are {', '.join(STORED)}"
        raise OutputError(f"the format {name!r} is unknown", where=str(folder), rule=rule)
    if bits is None and image.stored in STORED[name].values():
        return name, image.stored
    return name, stored_as(name, folder, bits, image.stored)


def _write_parts(
    picture: IntegralImage | LargePicture,
    folder: Path,
    kind: Kind,
    shape: tuple[int, int],
    parts: Iterator[Part],
    storage: tuple[FormatName, Stored],
    progress: ProgressCallback,
) -> int:
    """Write the parts, of ``shape`` rows and columns, and the manifest; the number of parts."""
    name, stored = storage
    transfer = picture.provenance.transfer
    files: list[list[str | None]] = [[None] * shape[1] for _ in range(shape[0])]
    with replacing_folder(folder) as temporary:
        for (row, column), layers, report in parts:
            file = _part_name(kind, name, shape, (row, column))
            files[row][column] = file
            values = converted_values(layers[""], stored, transfer)
            encode_values(temporary / file, name, {**layers, "": values}, transfer=transfer)
            progress(report)
        metadata = Metadata(picture.display, picture.world_from_display, picture.provenance)
        exact = kind == "micro-images" or picture.views_are_exact
        _write_manifest(temporary, metadata, kind, stored, files, exact=exact)
    return sum(file is not None for row in files for file in row)


def _parts(layers: Mapping[str, NDArray[Any]], mask: NDArray[np.bool_]) -> Iterator[Part]:
    """The parts of layers ``(rows, columns, ...)`` of which the mask shows anything."""
    places = np.argwhere(np.any(mask, axis=(2, 3))).tolist()
    for done, (row, column) in enumerate(places, start=1):
        part = {key: values[row, column] for key, values in layers.items()}
        yield (row, column), part, Progress("write", done, len(places))


def _large_views(picture: LargePicture, grid: ViewGrid) -> Iterator[Part]:
    """The views that have any pixel, gathered in lots of :data:`LOT_BYTES`."""
    display, source = picture.display, picture.source
    rows, columns = lens_rows(display), display.lens_grid.columns
    panel_rows = max(1, display.panel.height // rows)
    places = [(ky, kx) for ky in range(len(grid.down)) for kx in range(len(grid.right))]
    step = max(1, LOT_BYTES // (rows * columns * 3 * source.dtype.itemsize))
    for lot in (places[start : start + step] for start in range(0, len(places), step)):
        views = np.zeros((len(lot), rows, columns, 3), dtype=source.dtype)
        has_any = [False] * len(lot)
        for first, last in row_blocks(rows, display.panel.width * panel_rows):
            top, bottom = panel_rows_of_view_rows(display, first, last)
            values = source.window(PixelWindow(0, top, display.panel.width, bottom - top))
            for number, view in enumerate(lot):
                found, at_row, at_column = pixels_of_view_rows(display, grid, view, first, last)
                if not found.any():
                    continue
                has_any[number] = True
                part = values[np.where(found, at_row - top, 0), np.where(found, at_column, 0)]
                views[number, first:last] = np.where(found[..., None], part, 0)
        for number in np.flatnonzero(has_any).tolist():
            done = lot[number][0] * len(grid.right) + lot[number][1] + 1
            yield lot[number], {"": views[number]}, Progress("write", done, len(places))


def _large_lenses(picture: LargePicture) -> Iterator[Part]:
    """The micro-images ``(ny, nx, 3)`` of the lenses that have a pixel."""
    display, source = picture.display, picture.source
    ny, nx = micro_image_shape(display)
    grid, panel = display.lens_grid, display.panel
    is_sheet = display.lens_array.layout == "lenticular"
    together = max(1, LOT_BYTES // (ny * nx * 3 * source.dtype.itemsize))
    for row in range(grid.rows):
        reach = (0, panel.height) if is_sheet else panel_rows_of_view_rows(display, row, row + 1)
        for first in range(0, grid.columns, together):
            count = min(together, grid.columns - first)
            values = np.zeros((count * ny * nx, 3), dtype=source.dtype)
            present = np.zeros(count, dtype=np.bool_)
            for top, bottom in row_blocks(reach[1] - reach[0], panel.width):
                span = reach[0] + top, reach[0] + bottom
                i, j = pixel_lenses(display, span)
                k_x, k_y = pixel_indices_under_lens(display, span)
                v, u = np.nonzero((j == row) & (i >= first) & (i < first + count))
                lens = i[v, u].astype(np.int64) - first
                values[(lens * ny + k_y[v, u]) * nx + k_x[v, u]] = source.take(v + span[0], u)
                present[lens] = True
            micro_images = values.reshape(count, ny, nx, 3)
            for number in np.flatnonzero(present).tolist():
                done = row * grid.columns + first + number + 1
                report = Progress("write", done, grid.rows * grid.columns)
                yield (row, first + number), {"": micro_images[number]}, report


def _part_name(kind: Kind, name: FormatName, shape: tuple[int, int], place: tuple[int, int]) -> str:
    """The file of the part in row and column ``place`` of ``shape`` rows and columns."""
    digits = len(str(max(shape) - 1))
    ending = {"png": ".png", "exr": ".exr", "tiff": ".tif", "zarr": ".zarr"}[name]
    return f"{_PREFIX[kind]}_{place[0]:0{digits}}_{place[1]:0{digits}}{ending}"


def _write_manifest(
    folder: Path,
    metadata: Metadata,
    kind: Kind,
    stored: Stored,
    files: list[list[str | None]],
    *,
    exact: bool,
) -> None:
    """Write what says what the parts in ``folder`` are."""
    manifest = {
        **metadata.to_dict(),
        "kind": kind,
        "stored": stored,
        "order": _ORDER[kind],
        "exact": exact,
        "files": files,
    }
    text = json.dumps(manifest, allow_nan=False, indent=1)
    (folder / MANIFEST).write_text(text + "\n", encoding="ascii")


def _read_manifest(folder: Path) -> _Manifest:
    path = folder / MANIFEST
    try:
        values = parse_json(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        fix = "give a folder written by 'lippmann views' or 'lippmann micro-images'"
        raise PictureError("is not there", where=str(path), fix=fix) from None
    except OSError as error:
        raise PictureError(f"cannot be read: {error.strerror}", where=str(path)) from error
    except UnicodeDecodeError:
        values = None
    if not isinstance(values, dict) or KEY not in values:
        raise PictureError("describes no folder of views or micro-images", where=str(path))
    metadata = from_dict(values, str(path))
    kind: Any = values.get("kind")
    stored: Any = values.get("stored")
    files: Any = values.get("files")
    if kind not in get_args(Kind):
        raise PictureError(f"kind is {kind!r}", where=str(path), rule=f"it must be one of {', '.join(get_args(Kind))}")
    if stored not in get_args(Stored):
        rule = f"it must be one of {', '.join(get_args(Stored))}"
        raise PictureError(f"stored is {stored!r}", where=str(path), rule=rule)
    if not isinstance(files, list) or not all(isinstance(row, list) and all(map(_is_name, row)) for row in files):
        rule = "it must be rows of names of files in this folder"
        raise PictureError("'files' makes no sense", where=str(path), rule=rule)
    return _Manifest(metadata, kind, stored, files)


def _is_name(value: object) -> bool:
    """Whether this is None or the name of a file in the folder itself: no path may lead out of it."""
    if not isinstance(value, str):
        return value is None
    is_text = not any(sign == "\0" or "\ud800" <= sign <= "\udfff" for sign in value)
    return is_text and Path(value).name == value and value != ".."


def _part_shape(manifest: _Manifest, folder: Path) -> tuple[int, int, int, int]:
    """Rows and columns of files, height and width of each, as the display wants them."""
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
    wanted = (micro_images_as_views(present, display) if manifest.kind == "views" else present).any(axis=(2, 3))
    for row, column in np.argwhere(wanted).tolist():
        if manifest.files[row][column] is None:
            raise PictureError(f"'files' has no name in row {row}, column {column}", where=path)
    return shape


def _read_part(path: Path, manifest: _Manifest, height: int, width: int) -> dict[str, NDArray[Any]]:
    header = read_header(path)
    if (header.height, header.width) != (height, width):
        rule = f"the {manifest.kind} of this folder have {width} x {height}"
        raise PictureError(f"has {header.width} x {header.height} pixels", where=str(path), rule=rule)
    layers, stored = decode_file(path, header.format, manifest.metadata.provenance.transfer)
    if stored != manifest.stored:
        raise PictureError(f"holds {stored} values", where=str(path), rule=f"{MANIFEST} says {manifest.stored}")
    return layers


def _names(layers: Mapping[str, NDArray[Any]]) -> str:
    return ", ".join(name or "RGB" for name in layers)
