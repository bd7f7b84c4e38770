"""Volumes of NIfTI files (``.nii``, ``.nii.gz``): versions 1 and 2, in one file."""

from __future__ import annotations

import gzip
import io
import math
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError, UsageError
from lippmann.runtime.machine import check_input
from lippmann.runtime.optional_import import optional
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.parsing.parts import read_up_to
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.volumes.description import WORLD_FROM_RAS, describe_volume

#: First bytes of a file, and the length of its header.
_LENGTHS = {348: 348, 540: 540}
#: Most bytes between the header and the voxels.
_MOST_OFFSET = 1 << 24
_RULE = "NIfTI-1 or NIfTI-2 in one file"
#: Millimetres of a unit of length, by NIfTI's code; most files that say nothing mean millimetres.
_MILLIMETRES = {0: 1.0, 1: 1000.0, 2: 1.0, 3: 1e-3}


def read_nifti(path: Path, *, series: str | None = None) -> SceneDescription:
    """Read a volume of a NIfTI file. World units are millimetres; the patient is seen from the front, head up.

    Parameters
    ----------
    series:
        Number of one of several volumes, from 1; None for the first.

    Raises
    ------
    SceneError
        ``nibabel`` is not installed; the file is missing, damaged, cut short, or holds colours.
    MemoryLimitError
        It holds more than the memory that is left.
    UsageError
        There is no volume of that number.
    """
    where = path.name
    read_bytes(path, 64)
    nibabel = optional("nibabel", "volumes", "NIfTI files need it", where)
    try:
        with path.open("rb") as raw:
            is_packed = raw.read(2) == b"\x1f\x8b"
        with gzip.open(path, "rb") if is_packed else path.open("rb") as file:
            header = _header(nibabel, file.read(540), where)
            shape, count = _shape(header, where)
            number = _number(series, count)
            dtype = np.dtype(header.get_data_dtype())
            if dtype.kind not in "iuf" or dtype.itemsize > 8:
                kind = "colours" if dtype.names else str(dtype)
                raise SceneError(f"its voxels are {kind}", where=where, rule="single real numbers are shown")
            voxels = math.prod(shape)
            # The bytes, and numbers of another kind made of them.
            check_input(voxels * (dtype.itemsize + 4), f"{' x '.join(map(str, shape))} voxels", where=where)
            offset = int(header.get_data_offset())
            if not 0 <= offset <= _MOST_OFFSET:
                raise SceneError(f"its voxels begin at byte {offset}", where=where, rule=f"0 to {_MOST_OFFSET}")
            file.seek(offset + (number - 1) * voxels * dtype.itemsize)
            data = read_up_to(file, voxels * dtype.itemsize)
            affine = _affine(header)
            slope, intercept = header.get_slope_inter()
            unit = _MILLIMETRES.get(int(header["xyzt_units"]) & 7, 1.0)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise SceneError(f"cannot be unpacked ({error})", where=where, fix="is it whole?") from None
    except (OSError, nibabel.spatialimages.HeaderDataError, ValueError, LookupError, OverflowError) as error:
        raise SceneError(f"has a damaged header ({str(error)[:200]})", where=where, rule=_RULE) from None
    if len(data) < voxels * dtype.itemsize:
        raise SceneError(f"holds {len(data)} of {voxels * dtype.itemsize} bytes of voxels", where=where)
    scale, zero = _read_scale(slope, intercept)
    grid = np.frombuffer(data, dtype).reshape(shape[::-1])
    scaling = np.diag([unit, unit, unit, 1.0])
    notes = [f"volume {number} of {count} (series)"] if count > 1 else []
    if not (header["qform_code"] > 0 or header["sform_code"] > 0):
        notes.append("nothing says how the patient lies: x is taken to run to the left, y to the front, z to the head")
    return describe_volume(
        path.name.removesuffix(".gz").removesuffix(".nii"),
        grid,
        WORLD_FROM_RAS @ scaling @ affine,
        slope=scale,
        intercept=zero,
        notes=notes,
    )


def _header(nibabel: Any, data: bytes, where: str) -> Any:
    """The header, whose own numbers are not trusted yet."""
    for order in ("<", ">"):
        size = int(np.frombuffer(data[:4].ljust(4, b"\0"), f"{order}i4")[0])
        if size in _LENGTHS and len(data) >= size:
            kind = nibabel.Nifti1Header if size == 348 else nibabel.Nifti2Header
            header = kind.from_fileobj(io.BytesIO(data[:size]), endianness=order, check=False)
            if bytes(header["magic"].tobytes())[:3] in (b"n+1", b"n+2"):
                return header
    raise SceneError("is no NIfTI file", where=where, rule=_RULE)


def _shape(header: Any, where: str) -> tuple[tuple[int, int, int], int]:
    """Voxels along x, y and z, and the number of volumes."""
    shape = [int(side) for side in header.get_data_shape()]
    if not 2 <= len(shape) <= 7 or min(shape) < 1:
        raise SceneError(f"its voxels are {shape}", where=where, rule="a volume of 1 voxel or more along each axis")
    width, height, depth = [*shape, 1][:3]
    return (width, height, depth), math.prod(shape[3:])


def _number(series: str | None, count: int) -> int:
    if series is None:
        return 1
    if not series.isascii() or not series.isdigit() or not 1 <= int(series) <= count:
        raise UsageError(f"'{series}'", parameter="series", rule=f"the file has volumes 1 to {count}")
    return int(series)


def _affine(header: Any) -> NDArray[np.float64]:
    """From voxels to millimetres toward right, front and head; of a header without it, by its spacing."""
    affine = np.asarray(header.get_best_affine(), np.float64)
    if np.isfinite(affine).all() and abs(np.linalg.det(affine[:3, :3])) > 0.0:
        return affine
    return np.asarray(header.get_base_affine(), np.float64)


def _read_scale(slope: float | None, intercept: float | None) -> tuple[float, float]:
    """Slope and intercept of values, where the header has some that mean something."""
    if slope is None or intercept is None or not np.isfinite([slope, intercept]).all() or slope == 0.0:
        return 1.0, 0.0
    return float(slope), float(intercept)
