"""An integral image as a folder of views or of micro-images, and back.

The folder holds one picture file per view (lens) and ``lippmann.json``, which says what they are: the metadata of the
picture, the kind of the parts, how values are stored, and the files in rows and columns. Together they give the
picture back exactly, in the depth in which it was stored.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from lippmann.atomic import replacing_folder
from lippmann.errors import OutputError, PictureError
from lippmann.image.codec import STORED, FormatName, decode_file, encode_file, read_header
from lippmann.image.formats import stored_as
from lippmann.image.integral_image import IntegralImage, Stored
from lippmann.image.large import LargePicture
from lippmann.image.metadata import KEY, Metadata, from_dict, metadata_of, parse_json
from lippmann.image.permutation import Permutation, micro_images_as_views
from lippmann.image.views import exact_view_shape
from lippmann.progress import Progress, ProgressCallback, silent

MANIFEST = "lippmann.json"

Kind = Literal["views", "micro-images"]

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
    name, stored = storage_of(image, folder, format, bits)
    views, mask = image.views_and_mask()
    parts: dict[str, NDArray[Any]] = {"": views}
    if name == "exr" and image.views_are_exact:
        split = Permutation(image.display).split
        parts |= {k: micro_images_as_views(split(v), image.display) for k, v in image.maps.items()}
    return _write_parts(image, folder, "views", parts, mask, (name, stored), progress)


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
    name, stored = storage_of(image, folder, format, bits)
    permutation = Permutation(image.display)
    layers = {"": image.pixels, **image.maps} if name == "exr" else {"": image.pixels}
    parts = {k: permutation.split(v) for k, v in layers.items()}
    return _write_parts(image, folder, "micro-images", parts, permutation.mask, (name, stored), progress)


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


def storage_of(
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
    image: IntegralImage,
    folder: Path,
    kind: Kind,
    parts: Mapping[str, NDArray[Any]],
    mask: NDArray[np.bool_],
    storage: tuple[FormatName, Stored],
    progress: ProgressCallback,
) -> int:
    """Write the parts ``(rows, columns, ...)`` of which the mask shows anything, and the manifest; their number."""
    name, stored = storage
    present = np.any(mask, axis=(2, 3))
    count = int(present.sum())
    rows, columns = present.shape
    files: list[list[str | None]] = [[None] * columns for _ in range(rows)]
    with replacing_folder(folder) as temporary:
        for done, (row, column) in enumerate(np.argwhere(present).tolist(), start=1):
            file = part_name(kind, name, (rows, columns), (row, column))
            files[row][column] = file
            layers = {key: values[row, column] for key, values in parts.items()}
            encode_file(temporary / file, name, layers, stored=stored, transfer=image.provenance.transfer)
            progress(Progress("write", done, count))
        exact = kind == "micro-images" or image.views_are_exact
        write_manifest(temporary, metadata_of(image), kind, stored, files, exact=exact)
    return count


def part_name(kind: Kind, name: FormatName, shape: tuple[int, int], place: tuple[int, int]) -> str:
    """The file of the part in row and column ``place`` of ``shape`` rows and columns."""
    digits = len(str(max(shape) - 1))
    ending = {"png": ".png", "exr": ".exr", "tiff": ".tif", "zarr": ".zarr"}[name]
    return f"{_PREFIX[kind]}_{place[0]:0{digits}}_{place[1]:0{digits}}{ending}"


def write_manifest(
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
    return is_text and Path(value).name == value


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
