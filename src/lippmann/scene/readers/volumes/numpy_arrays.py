"""Volumes in NumPy's files: an array of three axes, (z, y, x), slice 0 in front and row 0 on top."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LippmannError, SceneError, UsageError
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.parsing.numpy_array import read_numpy_array
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.volumes.description import describe_volume

#: The array of an ``.npz`` file with the distances of voxels along its axes z, y and x.
SPACING = "spacing"
_RULE = "an array (z, y, x) of real numbers"


def read_array(path: Path, *, series: str | None = None) -> SceneDescription:
    """Read an array of three axes; voxels are 1 mm wide, or as ``spacing`` (z, y, x) of an ``.npz`` file says.

    Parameters
    ----------
    series:
        Name of an array of an ``.npz`` file; None for the only one of three axes.

    Raises
    ------
    SceneError
        The file is missing or damaged, or holds no such array.
    MemoryLimitError
        It holds more than the memory that is left.
    UsageError
        There is no array of that name.
    """
    where = path.name
    is_archive = read_bytes(path, 64).startswith(b"PK")
    if series is not None and not is_archive:
        raise UsageError(f"'{series}'", parameter="series", rule=f"{where} holds one array")
    spacing = np.ones(3)
    try:
        if is_archive:
            grid, spacing = _of_archive(path, series)
        else:
            with path.open("rb") as file:
                grid = read_numpy_array(file, where, where)
    except LippmannError:
        raise
    except Exception as error:  # noqa: BLE001  # it parses headers as Python, and raises errors of many kinds
        raise SceneError(f"cannot be read ({' '.join(str(error).split())[:200]})", where=where, rule=_RULE) from None
    if grid.ndim != 3:
        raise SceneError(f"its array is {grid.shape}", where=where, rule=_RULE)
    depth_step, height_step, width_step = spacing
    world_from_voxel = np.diag([width_step, -height_step, -depth_step, 1.0])
    return describe_volume(path.stem, grid, world_from_voxel)


def _of_archive(path: Path, series: str | None) -> tuple[NDArray[np.generic], NDArray[np.float64]]:
    where = path.name
    with zipfile.ZipFile(path) as archive:
        names = [name.removesuffix(".npy") for name in archive.namelist()[:1000] if name.endswith(".npy")]
        spacing = np.ones(3)
        if SPACING in names:
            with archive.open(f"{SPACING}.npy") as file:
                spacing = np.asarray(read_numpy_array(file, SPACING, where), np.float64).ravel()
            if len(spacing) != 3 or not np.isfinite(spacing).all() or spacing.min() <= 0.0:
                raise SceneError("its spacing is no distance along z, y and x", where=where, rule="three numbers > 0")
        others = [name for name in names if name != SPACING]
        if series is not None and series not in others:
            raise UsageError.unknown("array", series, others, parameter="series")
        if series is None and len(others) != 1:
            listed = ", ".join(others[:20]) or "no array"
            raise SceneError(f"holds {listed}", where=where, rule="one array is shown", fix="choose it with series=...")
        chosen = series or others[0]
        with archive.open(f"{chosen}.npy") as file:
            return read_numpy_array(file, chosen, where), spacing
