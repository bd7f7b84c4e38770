"""Volumes in OpenVDB files (``.vdb``): smoke, clouds, and what else holds a density."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lippmann.errors import SceneError, UsageError
from lippmann.runtime.helper_process import HelperEndedError, HelperProcess
from lippmann.runtime.machine import check_input
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.readers.volumes.vdb_module import find_module
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.volumes.description import describe_volume

#: First bytes of such a file.
_BEGINNING = b" BDV\0\0\0\0"
_MOST_SECONDS = 300.0

_process = HelperProcess("from lippmann.scene.readers.volumes.vdb_child import main; main()", _MOST_SECONDS)


def read_vdb(path: Path, *, series: str | None = None) -> SceneDescription:
    """Read a grid of one number a voxel; the box of its active voxels is shown.

    World units are the file's; +y is up.

    Parameters
    ----------
    series:
        Name of a grid; None for ``density``, and where there is none for the first.

    Raises
    ------
    SceneError
        OpenVDB's module is not installed; the file is missing or damaged, or holds no such grid, or one that is no box
        of densities (a level set, a frustum).
    MemoryLimitError
        It holds more than the memory that is left.
    UsageError
        There is no grid of that name.
    """
    where = path.name
    if read_bytes(path, len(_BEGINNING)) != _BEGINNING:
        raise SceneError("is no OpenVDB file", where=where, rule="it begins with ' BDV'")
    if find_module() is None:
        raise SceneError(
            "OpenVDB's Python module is not installed",
            where=where,
            rule="Blender's wheel (pip install bpy), conda-forge's openvdb and Debian's python3-openvdb have it",
            fix="install one, or save an array by its copyToArray as .npy",
        )
    try:
        arrays = _process.ask_arrays(path, series=series)
    except HelperEndedError as error:
        fix = "is it whole, and was the module built for this NumPy?"
        raise SceneError(f"OpenVDB breaks down at the file ({error})", where=where, fix=fix) from None
    if "usage" in arrays:
        raise UsageError(f"'{series}'", where=where, parameter="series", rule=str(arrays["usage"]))
    if "refused" in arrays:
        raise SceneError(str(arrays["refused"]), where=where)
    if "error" in arrays:
        raise SceneError(f"cannot be read ({arrays['error']})", where=where, rule="an OpenVDB file")
    grid, matrix, notes = arrays["grid"], arrays["matrix"].astype(np.float64), arrays["notes"].tolist()
    check_input(2 * grid.nbytes, "the grid", where=where)
    if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix[:3, :3])) == 0.0:
        raise SceneError("its voxels have no extent", where=where)
    return describe_volume(path.stem, grid, matrix, notes=notes)
