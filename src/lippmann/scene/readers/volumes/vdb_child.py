"""The process that reads OpenVDB files by ``tinyvdb``: native code, with nothing else in it."""

from __future__ import annotations

import io
import json
import os
from typing import Any

import numpy as np
import tinyvdb
from numpy.typing import NDArray

from lippmann.runtime.helper_process import limit_memory, serve

#: Kinds of grids that hold one number a voxel, by the beginning of their type's name.
_SCALAR = ("Tree_float", "Tree_double", "Tree_half")
#: The grid that is shown of several, where nothing is chosen: what programs call smoke.
_USUAL = "density"
_LEVEL_SET = "level set"
#: Bytes of a voxel: the library's, and those that are handed over.
_BYTES_PER_VOXEL = 8


class RefusedError(Exception):
    """The file is sound, and is not shown."""


def main() -> None:
    """Answer requests, JSON with ``path``, ``series`` and ``memory``, by ``.npz``: a grid, or an ``error``."""
    serve(_answer)


def _answer(data: bytes) -> bytes:
    request = json.loads(data)
    limit_memory(request["memory"])
    try:
        found = _read(request["path"], request["series"], request["memory"])
    except MemoryError:
        found = {"error": np.array("it takes more memory than is left")}
    except KeyError as error:
        found = {"usage": np.array(f"the file has {error.args[0]}")}
    except RefusedError as error:
        found = {"refused": np.array(str(error))}
    except Exception as error:  # noqa: BLE001  # it raises errors of many kinds
        said = " ".join(str(error).split()).replace(os.path.join(os.path.dirname(request["path"]), ""), "")
        found = {"error": np.array(said[:200] or type(error).__name__)}
    written = io.BytesIO()
    np.savez(written, **found)  # type: ignore[arg-type]  # names are free
    return written.getvalue()


def _read(path: str, series: str | None, memory: int) -> dict[str, NDArray[np.generic]]:
    file = tinyvdb.open(path)
    file.read_grids()
    names = [str(file.grid_name(number)) for number in range(file.grid_count)]
    scalar = [n for n in range(len(names)) if str(file.grid_type_name(n)).startswith(_SCALAR)]
    listed = ", ".join(names[:20])
    if series is not None and series not in (names[number] for number in scalar):
        raise KeyError(", ".join(names[number] for number in scalar[:20]) or "no grid of one number a voxel")
    if not scalar:
        raise RefusedError(f"its grids ({listed or 'none'}) hold no single numbers")
    wanted = series if series is not None else _USUAL
    number = next((n for n in scalar if names[n] == wanted), scalar[0])
    grid = file.grid(number)
    metadata = dict(grid.metadata)
    if metadata.get("class") == _LEVEL_SET:
        raise RefusedError(f"the grid '{names[number]}' is a level set, a surface: make it a mesh or a fog volume")
    low, high = _box(grid, metadata)
    counted = metadata.get("file_voxel_count")
    if isinstance(counted, int) and counted != grid.active_voxel_count():
        share = 1.0 - grid.active_voxel_count() / max(counted, 1)
        raise RefusedError(
            f"{share:.0%} of the voxels of '{names[number]}' are stored as tiles, which tinyvdb does not hand out: "
            "densify it (openvdb's voxelizeActiveTiles)"
        )
    if _BYTES_PER_VOXEL * int(np.prod(high - low, dtype=object)) > memory:
        raise MemoryError
    dense = grid.materialize_dense(tuple(low.tolist()), tuple(high.tolist()))
    values = np.frombuffer(dense.to_bytes(), np.float32).reshape((high - low)[::-1])
    notes = [f"the grid '{names[number]}' of {listed}"] if len(names) > 1 else []
    return {"grid": values, "matrix": _matrix(grid.transform, low), "notes": np.array(notes, dtype=np.str_)}


def _box(grid: Any, metadata: dict[str, Any]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The lowest voxel that holds something, and the one beyond the highest."""
    leaves = grid.active_bbox()
    if leaves is None:
        raise RefusedError(f"the grid '{grid.name}' is empty")
    low, high = (np.array(corner, np.int64) for corner in leaves)
    told = metadata.get("file_bbox_min"), metadata.get("file_bbox_max")
    if all(isinstance(corner, tuple) and len(corner) == 3 for corner in told):
        # It is narrower than the leaves, which are blocks of eight voxels a side.
        first, last = (np.clip(np.array(corner, np.int64), -(1 << 31), 1 << 31) for corner in told)
        inner = np.maximum(low, first), np.minimum(high, last + 1)
        if (inner[1] > inner[0]).all():
            return inner
    return low, high


def _matrix(transform: dict[str, Any], low: NDArray[np.int64]) -> NDArray[np.float64]:
    """From numbers of voxels, the first at ``low``, to the world. OpenVDB multiplies rows by its matrices."""
    if transform["type"] == "affine":
        matrix = np.array(transform["matrix"], np.float64).T
    else:
        matrix = np.diag([*transform["scale"], 1.0])
        matrix[:3, 3] = transform["translation"]
    origin = np.eye(4)
    origin[:3, 3] = low
    return np.asarray(matrix @ origin, np.float64)
