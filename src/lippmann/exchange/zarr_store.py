"""Light fields in Zarr (format 2), for programs that read parts of a large one; a convention of Lippmann's own.

A Zarr group holds:

- the array ``LF[t, s, v, u, c]``. A chunk holds all views of one row of lenses; for a lenticular sheet, all views of as
  many rows of pixels as make about a megabyte;
- the group ``maps`` with the maps of the picture, on the same first four axes;
- the array ``mask[t, s, v, u]``, if some values belong to no pixel.

Every array names its axes in ``_ARRAY_DIMENSIONS``, as xarray expects. The attributes of the group are the metadata of
a picture file. The layout holds the pictures of every display without loss.
"""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.codecs.zarr_metadata import ArrayMetadata
from lippmann.codecs.zarr_reader import axis_names, node_kind, open_array, read_array_metadata, read_attributes
from lippmann.display import Display
from lippmann.errors import PictureError
from lippmann.exchange.light_field import LightField, check_shape
from lippmann.exchange.metadata_text import from_note, to_note
from lippmann.exchange.optional_import import optional
from lippmann.image.metadata import KEY, Metadata
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.runtime.atomic_write import replacing_folder

LAYOUT = "zarr"

AXES = ("t", "s", "v", "u", "c")

_VIEWS, _MASK, _MAPS = "LF", "mask", "maps"
_DIMENSIONS = "_ARRAY_DIMENSIONS"

#: Bytes of a chunk of a lenticular sheet, before compression.
_CHUNK = 1 << 20

_TYPES = (np.bool_, np.uint8, np.uint16, np.uint32, np.float16, np.float32)


def write_zarr(light_field: LightField, display: Display, folder: Path, *, progress: ProgressCallback = silent) -> None:
    """Write a Zarr group, losslessly compressed.

    Parameters
    ----------
    light_field:
        The views with all their maps.
    display:
        The display whose views these are, which their metadata name.
    folder:
        The folder; appears whole or not at all.
    progress:
        Called after every array.

    Raises
    ------
    UsageError
        If zarr is not installed.
    OutputError
        If the folder cannot be written.
    """
    del display
    zarr = optional("zarr")
    arrays: dict[str, NDArray[Any]] = {_VIEWS: light_field.values}
    arrays |= {f"{_MAPS}/{name}": values for name, values in light_field.maps.items()}
    if light_field.mask is not None:
        arrays[_MASK] = light_field.mask
    with replacing_folder(folder) as temporary:
        group = zarr.open_group(str(temporary), mode="w", **_format(zarr))
        if note := to_note(light_field.metadata, LAYOUT):
            group.attrs.put(json.loads(note))
        if light_field.maps:
            zarr.open_group(str(temporary), path=_MAPS, mode="a", **_format(zarr))
        for done, (name, values) in enumerate(arrays.items(), start=1):
            _write_array(zarr, temporary, name, values)
            progress(Progress("write", done, len(arrays)))
        # Readers then need not list the folder, and do not meet the list of its files there.
        zarr.consolidate_metadata(str(temporary))


def read_zarr(folder: Path, *, progress: ProgressCallback = silent) -> LightField:
    """Read a Zarr group.

    A group that Lippmann wrote must have all its chunks. In groups of other programs a missing chunk holds the fill
    value, as Zarr defines.

    Parameters
    ----------
    folder:
        The Zarr group.
    progress:
        Called after every array.

    Raises
    ------
    UsageError
        If zarr is not installed.
    PictureError
        If the folder is missing, no Zarr group, incomplete or damaged, or holds no light field.
    """
    zarr = optional("zarr")
    attributes = _group_attributes(folder)
    names, map_names = _array_names(folder, folder), _array_names(folder / _MAPS, folder)
    metadata = _metadata(attributes, folder)
    if _VIEWS not in names:
        held = ", ".join(names) or "nothing"
        raise PictureError(f"has no array {_VIEWS}; it holds {held}", where=str(folder))
    array_names = [_VIEWS, *(f"{_MAPS}/{name}" for name in map_names), *([_MASK] if _MASK in names else [])]
    arrays: dict[str, NDArray[Any]] = {}
    for done, name in enumerate(array_names, start=1):
        shape = arrays[_VIEWS].shape if arrays else None
        arrays[name] = _read_array(zarr, folder / name, folder, shape, whole=metadata is not None)
        progress(Progress("read", done, len(array_names)))
    maps = {name: arrays[f"{_MAPS}/{name}"] for name in map_names}
    try:
        return LightField(arrays[_VIEWS], metadata, maps, mask=arrays.get(_MASK))
    except PictureError as error:
        raise PictureError(error.what, where=str(folder), rule=error.rule) from None


def _group_attributes(folder: Path) -> dict[str, Any]:
    """The attributes of a Zarr group; anything else raises :class:`PictureError`."""
    try:
        if node_kind(folder) == "group":
            return read_attributes(folder)
        why = ""
    except PictureError as error:
        why = f": {error.what}"
    raise PictureError(f"is no Zarr group{why}", where=str(folder), rule=f"it holds the array {_VIEWS}")


def _array_names(folder: Path, root: Path) -> list[str]:
    """Names of the arrays of a group inside ``root``, in format 2 or 3."""
    if not folder.is_dir():
        return []
    return sorted(entry.name for entry in folder.iterdir() if entry.is_dir() and node_kind(entry, root) == "array")


@contextmanager
def _without_warnings() -> Iterator[None]:
    """Suppress the library's warnings of unknown files and of format versions."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _format(zarr: Any) -> dict[str, Any]:
    """The keyword for format 2, which version 3 of the library renamed."""
    if int(zarr.__version__.partition(".")[0]) < 3:
        return {"zarr_version": 2}
    return {"zarr_format": 2}


def _all_chunks_written(zarr: Any) -> AbstractContextManager[Any]:
    """A context in which chunks of zeros are written too, which version 3 of the library omits by default.

    The library's keyword of this name has no effect before 3.1.1.
    """
    if int(zarr.__version__.partition(".")[0]) < 3:
        return nullcontext()
    settings: AbstractContextManager[Any] = zarr.config.set({"array.write_empty_chunks": True})
    return settings


def _write_array(zarr: Any, folder: Path, name: str, values: NDArray[Any]) -> None:
    import numcodecs

    down, across, height, width = values.shape[:4]
    rows = 1
    if down == 1:
        rows = min(height, max(1, _CHUNK // (values.nbytes // height)))
    chunks = (down, across, rows, width, *values.shape[4:])
    with _all_chunks_written(zarr):
        array = zarr.open_array(
            str(folder),
            path=name,
            mode="w",
            shape=values.shape,
            chunks=chunks,
            dtype=values.dtype,
            fill_value=0,
            compressor=numcodecs.Blosc("zstd", clevel=5, shuffle=numcodecs.Blosc.SHUFFLE),
            **_format(zarr),
        )
        array[...] = values
    array.attrs[_DIMENSIONS] = list(AXES[: values.ndim])


def _read_array(
    zarr: Any, folder: Path, root: Path, views_shape: tuple[int, ...] | None, *, whole: bool
) -> NDArray[Any]:
    where = str(folder)
    metadata = read_array_metadata(folder, root)
    axes = axis_names(metadata, read_attributes(folder))
    if axes != AXES[: len(axes)] and sorted(axes) == sorted(AXES[: len(axes)]):
        rule = f"they must be {', '.join(AXES[: len(axes)])}"
        raise PictureError(f"has the axes {', '.join(axes)}", where=where, rule=rule, fix="store it in that order")
    if views_shape is None:
        check_shape(metadata.shape, where)
    elif metadata.shape[:4] != views_shape[:4]:
        rule = f"{_VIEWS} has {views_shape[:4]}"
        raise PictureError(f"has the shape {metadata.shape}", where=where, rule=rule)
    if metadata.dtype not in _TYPES:
        raise PictureError(
            f"holds {metadata.dtype}", where=where, rule=f"{', '.join(kind.__name__ for kind in _TYPES)} are read"
        )
    with _without_warnings():
        array = open_array(zarr, folder, metadata, root)
        _check_chunks(folder, metadata, whole)
        try:
            values: NDArray[Any] = np.asarray(array[...])
        except PictureError:
            raise
        except Exception as error:  # the library raises many kinds of errors for damaged chunks
            raise PictureError(f"is damaged: {error}", where=where, fix="make or fetch it anew") from error
    return values


#: Chunks of which any may be missing, where missing ones stand for zeros: each is looked for.
_FEW_CHUNKS = 4096


def _check_chunks(folder: Path, metadata: ArrayMetadata, whole: bool) -> None:
    """Raise :class:`PictureError` if the file of a chunk is missing; unless ``whole``, if most of very many are."""
    counts = [-(-size // step) for size, step in zip(metadata.shape, metadata.chunks, strict=True)]
    if not whole and math.prod(counts) <= _FEW_CHUNKS:
        return
    present = {path.relative_to(folder).as_posix() for path in folder.rglob("*")}
    missing = [name for place in np.ndindex(*counts) if (name := metadata.chunk_name(place)) not in present]
    if len(missing) > (0 if whole else math.prod(counts) // 2):
        what = f"{len(missing)} of its {math.prod(counts)} chunks are missing, the first {missing[0]}"
        raise PictureError(what, where=str(folder))


def _metadata(attributes: dict[str, Any], folder: Path) -> Metadata | None:
    if KEY not in attributes:
        return None
    return from_note(json.dumps(attributes), LAYOUT, str(folder))
