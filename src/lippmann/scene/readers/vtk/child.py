"""The process that reads VTK's files by PyVista: native code, with nothing else in it."""

from __future__ import annotations

import io
import json
import os

import numpy as np
import pyvista
from numpy.typing import NDArray

from lippmann.errors import LippmannError
from lippmann.runtime.helper_process import limit_memory, serve
from lippmann.scene.readers.vtk.data_set import image_of, surface_of, unshown_arrays


def main() -> None:
    """Answer requests, JSON with ``path``, ``series`` and ``memory``, by ``.npz``.

    That holds a surface, a ``grid``, an ``error``, or as ``usage`` the names of the arrays that there are.
    """
    serve(_answer)


def _answer(data: bytes) -> bytes:
    request = json.loads(data)
    limit_memory(request["memory"])
    try:
        found = _read(request["path"], request["series"])
    except MemoryError:
        found = {"error": np.array("it takes more memory than is left")}
    except KeyError as error:
        found = {"usage": np.array(error.args[0])}
    except LippmannError as error:
        found = {"error": np.array(error.what)}
    except Exception as error:  # noqa: BLE001  # it raises errors of many kinds
        said = " ".join(str(error).split()).replace(os.path.join(os.path.dirname(request["path"]), ""), "")
        found = {"error": np.array(said[:200] or type(error).__name__)}
    written = io.BytesIO()
    np.savez(written, **found)  # type: ignore[arg-type]  # names are free
    return written.getvalue()


def _read(path: str, series: str | None) -> dict[str, NDArray[np.generic]]:
    data = pyvista.read(path)
    remarks: list[str] = []
    if isinstance(data, pyvista.DataSet):
        remarks = _choose(data, series)
    elif series is not None:
        raise KeyError("several blocks, of which none can be chosen")
    if isinstance(data, pyvista.ImageData):
        image = image_of(data)
        if image is not None:
            grid, matrix = image
            remarks.append(f"the scalars '{data.active_scalars_name}'")
            return {"grid": grid, "matrix": matrix, "notes": np.array(remarks)}
    surface = surface_of(data)
    found: dict[str, NDArray[np.generic]] = {
        "positions": surface.positions,
        "faces": surface.faces,
        "notes": np.array([*remarks, *surface.notes], dtype=np.str_),
    }
    for name in ("normals", "colors"):
        values = getattr(surface, name)
        if values is not None:
            found[name] = values
    return found


def _choose(data: pyvista.DataSet, series: str | None) -> list[str]:
    """Make an array active, by its name; without one a remark on those that are there, where none is active."""
    if series is not None:
        if series not in data.array_names:
            raise KeyError(", ".join(f"'{name[:40]}'" for name in data.array_names[:20]) or "no arrays")
        data.set_active_scalars(series, preference="point" if series in data.point_data else "cell")
    elif names := unshown_arrays(data):
        return [f"none of its arrays is active, so that none is shown of {names} (series=NAME chooses one)"]
    return []
