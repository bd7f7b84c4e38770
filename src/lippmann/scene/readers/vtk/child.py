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
from lippmann.scene.readers.vtk.data_set import image_of, surface_of


def main() -> None:
    """Answer requests, JSON with ``path`` and ``memory``, by ``.npz``: a surface, a ``grid``, or an ``error``."""
    serve(_answer)


def _answer(data: bytes) -> bytes:
    request = json.loads(data)
    limit_memory(request["memory"])
    try:
        found = _read(request["path"])
    except MemoryError:
        found = {"error": np.array("it takes more memory than is left")}
    except LippmannError as error:
        found = {"error": np.array(error.what)}
    except Exception as error:  # noqa: BLE001  # it raises errors of many kinds
        said = " ".join(str(error).split()).replace(os.path.join(os.path.dirname(request["path"]), ""), "")
        found = {"error": np.array(said[:200] or type(error).__name__)}
    written = io.BytesIO()
    np.savez(written, **found)  # type: ignore[arg-type]  # names are free
    return written.getvalue()


def _read(path: str) -> dict[str, NDArray[np.generic]]:
    data = pyvista.read(path)
    if isinstance(data, pyvista.ImageData):
        image = image_of(data)
        if image is not None:
            grid, matrix = image
            note = f"the scalars '{data.active_scalars_name}'"
            return {"grid": grid, "matrix": matrix, "notes": np.array([note])}
    surface = surface_of(data)
    found: dict[str, NDArray[np.generic]] = {
        "positions": surface.positions,
        "faces": surface.faces,
        "notes": np.array(surface.notes, dtype=np.str_),
    }
    for name in ("normals", "colors"):
        values = getattr(surface, name)
        if values is not None:
            found[name] = values
    return found
