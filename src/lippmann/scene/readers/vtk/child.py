"""The process that reads VTK's files by PyVista: native code, with nothing else in it."""

from __future__ import annotations

import numpy as np
import pyvista
from numpy.typing import NDArray

from lippmann.runtime.helper_process import RefusedFileError, serve_arrays
from lippmann.scene.readers.vtk.data_set import image_of, surface_of, unshown_arrays


def main() -> None:
    """Answer requests, with a ``series``, by a surface, a ``grid``, or as ``usage`` the arrays that there are."""
    serve_arrays(lambda request: _read(request["path"], request["series"]))


def _read(path: str, series: str | None) -> dict[str, NDArray[np.generic]]:
    data = pyvista.read(path)
    remarks: list[str] = []
    if isinstance(data, pyvista.DataSet):
        remarks = _choose(data, series)
    elif series is not None:
        raise RefusedFileError("usage", "several blocks, of which none can be chosen")
    if isinstance(data, pyvista.ImageData):
        image = image_of(data)
        if image is not None:
            grid, matrix = image
            remarks.append(f"the scalars '{data.active_scalars_name}'")
            return {"grid": grid, "matrix": matrix, "notes": np.array(remarks)}
    surface = surface_of(data)
    arrays: dict[str, NDArray[np.generic]] = {
        "positions": surface.positions,
        "faces": surface.faces,
        "notes": np.array([*remarks, *surface.notes], dtype=np.str_),
    }
    for name in ("normals", "colors"):
        values = getattr(surface, name)
        if values is not None:
            arrays[name] = values
    return arrays


def _choose(data: pyvista.DataSet, series: str | None) -> list[str]:
    """Make an array active, by its name; without one a remark on those that are there, where none is active."""
    if series is not None:
        if series not in data.array_names:
            names = ", ".join(f"'{name[:40]}'" for name in data.array_names[:20])
            raise RefusedFileError("usage", names or "no arrays")
        data.set_active_scalars(series, preference="point" if series in data.point_data else "cell")
    elif names := unshown_arrays(data):
        return [f"none of its arrays is active, so that none is shown of {names} (series=NAME chooses one)"]
    return []
