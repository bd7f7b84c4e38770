"""VTK's files: surfaces in colour, and images (``.vti``) with numbers as volumes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError, UsageError
from lippmann.runtime.helper_process import HelperEndedError, HelperProcess
from lippmann.runtime.machine import check_input
from lippmann.runtime.optional_import import check_installed
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.readers.vtk.data_set import Surface, describe_surface
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.volumes.description import describe_volume

_MOST_SECONDS = 300.0

_process = HelperProcess("from lippmann.scene.readers.vtk.child import main; main()", _MOST_SECONDS)


def read_vtk(path: Path, *, series: str | None = None) -> SceneDescription:
    """Read a data set of VTK's: its outer surface, or of an image with scalars the volume.

    Parameters
    ----------
    series:
        Name of the array that is shown; None for the active one.

    Raises
    ------
    SceneError
        PyVista is not installed; the file is missing or damaged, or has no surface.
    MemoryLimitError
        It holds more than the memory that is left.
    UsageError
        There is no array of that name.
    """
    where = path.name
    read_bytes(path, 64)
    check_installed("pyvista", "vtk", "VTK's files need it", where)
    try:
        arrays = _process.ask_arrays(path, series=series)
    except HelperEndedError as error:
        raise SceneError(f"VTK breaks down at the file ({error})", where=where, fix="is it whole?") from None
    if "usage" in arrays:
        raise UsageError(f"'{series}'", where=where, parameter="series", rule=f"the file has {arrays['usage']}")
    if "error" in arrays:
        raise SceneError(f"is no data set that is understood ({arrays['error']})", where=where)
    check_input(2 * sum(array.nbytes for array in arrays.values()), "the data set", where=where)
    notes = arrays["notes"].tolist()
    if "grid" in arrays:
        return describe_volume(path.stem, arrays["grid"], arrays["matrix"].astype(np.float64), notes=notes)
    return _surface(path.stem, arrays, notes, where)


def _surface(name: str, arrays: dict[str, NDArray[np.generic]], notes: list[str], where: str) -> SceneDescription:
    positions, faces = np.asarray(arrays["positions"], np.float64), np.asarray(arrays["faces"], np.int64)
    finite = np.asarray((np.abs(positions) < 1e30).all(axis=1))
    if len(faces) and not 0 <= int(faces.min()) <= int(faces.max()) < len(positions):
        raise SceneError("a face names a point that is not found", where=where)
    whole = np.asarray(finite[faces].all(axis=1))
    if not whole.all():
        notes = [*notes, f"{int((~whole).sum())} triangles or points with numbers that are not finite are left out"]
        faces, positions = faces[whole], np.where(finite[:, None], positions, 0.0)
    if not len(faces):
        raise SceneError("has no surface", where=where, rule="there must be at least one face")
    normals = arrays.get("normals")
    if normals is not None and not (np.isfinite(normals).all() and normals.shape == positions.shape):
        normals = None
    surface = Surface(positions, faces, normals, None, arrays.get("colors"))  # type: ignore[arg-type]  # as written
    return describe_surface(surface, name, notes)
