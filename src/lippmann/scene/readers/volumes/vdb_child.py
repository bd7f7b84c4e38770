"""The process that reads OpenVDB files by the library's own module: native code, with nothing else in it."""

from __future__ import annotations

import importlib.util
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.helper_process import RefusedFileError, serve_arrays
from lippmann.scene.readers.volumes.vdb_module import find_module

#: Kinds of grids that hold one number a voxel.
_SCALAR = ("float", "double", "half", "int32", "int64")
#: The grid that is shown of several, where nothing is chosen: what programs call smoke.
_USUAL = "density"
_LEVEL_SET = "level set"
_BYTES_PER_VOXEL = 4


def main() -> None:
    """Answer requests, with a ``series``, by a grid; ``refused`` says why it is not shown, ``usage`` what there is."""
    serve_arrays(lambda request: _read(request["path"], request["series"], request["memory"]))


def _load() -> Any:
    spec = find_module()
    if spec is None or spec.loader is None:
        raise ImportError("OpenVDB's Python module is gone")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _read(path: str, series: str | None, memory: int) -> dict[str, NDArray[np.generic]]:
    openvdb = _load()
    grids = openvdb.readAllGridMetadata(path)
    names = [str(each.name) for each in grids]
    scalar = [number for number, each in enumerate(grids) if str(each.valueTypeName) in _SCALAR]
    if series is not None and series not in (names[number] for number in scalar):
        known = ", ".join(names[number] for number in scalar[:20]) or "no grid of one number a voxel"
        raise RefusedFileError("usage", f"the file has {known}")
    if not scalar:
        raise RefusedFileError("refused", f"its grids ({', '.join(names[:20]) or 'none'}) hold no single numbers")
    preferred = series if series is not None else _USUAL
    name = names[next((number for number in scalar if names[number] == preferred), scalar[0])]
    grid = openvdb.read(path, name)
    if str(grid.gridClass) == _LEVEL_SET:
        raise RefusedFileError(
            "refused", f"the grid '{name}' is a level set, a surface: make it a mesh or a fog volume"
        )
    if grid.activeVoxelCount() == 0:
        raise RefusedFileError("refused", f"the grid '{name}' is empty")
    low, high = (np.array(corner, np.int64) for corner in grid.evalActiveVoxelBoundingBox())
    shape = high - low + 1
    if _BYTES_PER_VOXEL * int(np.prod(shape, dtype=object)) > memory:
        raise MemoryError
    values = np.empty(shape, np.float32)
    grid.copyToArray(values, ijk=tuple(low.tolist()))
    notes = [f"the grid '{name}' of {', '.join(names[:20])}"] if len(names) > 1 else []
    return {
        "grid": np.ascontiguousarray(values.T),
        "matrix": _matrix(grid.transform, low),
        "notes": np.array(notes, dtype=np.str_),
    }


def _matrix(transform: Any, low: NDArray[np.int64]) -> NDArray[np.float64]:
    """From numbers of voxels, the first at ``low``, to the world."""
    if not transform.isLinear:
        raise RefusedFileError("refused", "its voxels lie in a frustum: resample it to a box")
    origin, *ends = (
        np.array(transform.indexToWorld(tuple((low + step).tolist())), np.float64)
        for step in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
    )
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([end - origin for end in ends], axis=1)
    matrix[:3, 3] = origin
    return matrix
