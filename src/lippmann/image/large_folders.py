"""The views and micro-images of pictures larger than memory, as folders: the same that :mod:`.folders` writes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.atomic import replacing_folder
from lippmann.display import micro_image_shape, pixel_indices_under_lens, pixel_lenses
from lippmann.image.codec import FormatName, converted_values, encode_values
from lippmann.image.folders import part_name, storage_of, write_manifest
from lippmann.image.large import LargePicture
from lippmann.image.metadata import Metadata
from lippmann.image.permutation import row_blocks
from lippmann.image.views import ViewGrid, lens_rows, panel_rows_of_view_rows, pixels_of_view_rows, view_grid
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.store.grid import Window

#: Bytes of views that are gathered at a time; the picture is read once for each such lot.
LOT_BYTES = 1 << 29

View = tuple[int, int]


def write_large_views(
    picture: LargePicture,
    folder: Path,
    *,
    format: FormatName | None = None,
    bits: int | None = None,
    progress: ProgressCallback = silent,
) -> int:
    """:func:`lippmann.image.folders.write_views` for a picture that is read piece by piece."""
    name, stored = storage_of(picture, folder, format, bits)
    display, transfer = picture.display, picture.provenance.transfer
    grid = view_grid(display)
    shape = len(grid.down), len(grid.right)
    files: list[list[str | None]] = [[None] * shape[1] for _ in range(shape[0])]
    written = 0
    with replacing_folder(folder) as temporary:
        for lot in _lots(picture, grid):
            for view, (values, has_any) in zip(lot, _gathered(picture, grid, lot), strict=True):
                written += has_any
                if not has_any:
                    continue
                files[view[0]][view[1]] = part_name("views", name, shape, view)
                place = temporary / str(files[view[0]][view[1]])
                encode_values(place, name, {"": converted_values(values, stored, transfer)}, transfer=transfer)
                progress(Progress("write", view[0] * shape[1] + view[1] + 1, shape[0] * shape[1]))
        write_manifest(temporary, _metadata(picture), "views", stored, files, exact=grid.exact)
    return written


def write_large_micro_images(
    picture: LargePicture,
    folder: Path,
    *,
    format: FormatName | None = None,
    bits: int | None = None,
    progress: ProgressCallback = silent,
) -> int:
    """:func:`lippmann.image.folders.write_micro_images` for a picture that is read piece by piece.

    A row of lenses is held at a time; of a lenticular sheet, whose one row has all pixels, as many lenses as fit.
    """
    name, stored = storage_of(picture, folder, format, bits)
    display, transfer = picture.display, picture.provenance.transfer
    lenses = display.lens_grid
    shape = lenses.rows, lenses.columns
    files: list[list[str | None]] = [[None] * shape[1] for _ in range(shape[0])]
    written = 0
    with replacing_folder(folder) as temporary:
        for row, first, values, present in _lenses(picture):
            for number in np.flatnonzero(present).tolist():
                column = first + number
                files[row][column] = part_name("micro-images", name, shape, (row, column))
                place = temporary / str(files[row][column])
                encode_values(place, name, {"": converted_values(values[number], stored, transfer)}, transfer=transfer)
                written += 1
            progress(Progress("write", row * shape[1] + first + len(values), shape[0] * shape[1]))
        write_manifest(temporary, _metadata(picture), "micro-images", stored, files, exact=True)
    return written


def _lots(picture: LargePicture, grid: ViewGrid) -> Iterator[list[View]]:
    """Views that are gathered together."""
    display = picture.display
    size = lens_rows(display) * display.lens_grid.columns * 3 * picture.source.dtype.itemsize
    views = [(ky, kx) for ky in range(len(grid.down)) for kx in range(len(grid.right))]
    step = max(1, LOT_BYTES // size)
    return (views[first : first + step] for first in range(0, len(views), step))


def _gathered(picture: LargePicture, grid: ViewGrid, lot: list[View]) -> Iterator[tuple[NDArray[Any], bool]]:
    """Values as stored of every view of a lot, and whether it has any pixel."""
    display, source = picture.display, picture.source
    rows, columns = lens_rows(display), display.lens_grid.columns
    views = np.zeros((len(lot), rows, columns, 3), dtype=source.dtype)
    has_any = [False] * len(lot)
    panel_rows = max(1, display.panel.height // rows)
    for first, last in row_blocks(rows, display.panel.width * panel_rows):
        top, bottom = panel_rows_of_view_rows(display, first, last)
        values = source.window(Window(top, 0, bottom - top, display.panel.width))
        for number, view in enumerate(lot):
            found, at_row, at_column = pixels_of_view_rows(display, grid, view, first, last)
            if not found.any():
                continue
            has_any[number] = True
            part = values[np.where(found, at_row - top, 0), np.where(found, at_column, 0)]
            views[number, first:last] = np.where(found[..., None], part, 0)
    return zip(views, has_any, strict=True)


def _lenses(picture: LargePicture) -> Iterator[tuple[int, int, NDArray[Any], NDArray[np.bool_]]]:
    """Lens row, first lens column, values ``(lenses, ny, nx, 3)`` as stored, and which lenses have a pixel."""
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
            yield row, first, values.reshape(count, ny, nx, 3), present


def _metadata(picture: LargePicture) -> Metadata:
    return Metadata(picture.display, picture.world_from_display, picture.provenance)
