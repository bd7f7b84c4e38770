"""Views as picture files, one each, for the layouts that are folders of pictures: codes stay codes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Transfer, dequantize, quantize
from lippmann.errors import PictureError
from lippmann.image.encoding import FormatName, decode_file, encode_file, read_header
from lippmann.image.stored_values import Stored
from lippmann.progress import Progress, ProgressCallback, silent

_BITS = {"uint8": 8, "uint16": 16}


def write_view(path: Path, name: FormatName, values: NDArray[Any], transfer: Transfer) -> None:
    """Write ``(H, W, 3)`` codes (PNG) or floats (OpenEXR), exactly as they are."""
    linear = dequantize(values, transfer) if values.dtype.kind == "u" else values.astype(np.float32)
    encode_file(path, name, {"": linear}, stored=cast(Stored, values.dtype.name), transfer=transfer)


def read_view_files(
    paths: Sequence[Sequence[Path]], transfer: Transfer, progress: ProgressCallback = silent
) -> NDArray[Any]:
    """``(t, s, v, u, 3)`` codes or floats of these rows of files, as they are stored.

    Raises
    ------
    PictureError
        If a file is missing, damaged, no picture of opaque colours, or of another size or type than the first.
    """
    down, across = len(paths), len(paths[0])
    first = _read(paths[0][0], transfer)
    views = np.empty((down, across, *first.shape), dtype=first.dtype)
    for number, path in enumerate(path for row in paths for path in row):
        view = first if number == 0 else _read(path, transfer)
        if view.shape != first.shape:
            rule = f"the first view, {paths[0][0].name}, has {_size(first)}"
            raise PictureError(f"has {_size(view)} pixels", where=str(path), rule=rule)
        if view.dtype != first.dtype:
            rule = f"the first view, {paths[0][0].name}, holds {first.dtype}"
            raise PictureError(f"holds {view.dtype} values", where=str(path), rule=rule)
        views[divmod(number, across)] = view
        progress(Progress("read", number + 1, down * across))
    return views


def _read(path: Path, transfer: Transfer) -> NDArray[Any]:
    layers, stored = decode_file(path, read_header(path).format, transfer)
    linear: NDArray[Any] = layers[""]
    return quantize(linear, _BITS[stored], transfer) if stored in _BITS else linear.astype(stored)


def _size(view: NDArray[Any]) -> str:
    return f"{view.shape[1]} x {view.shape[0]}"
