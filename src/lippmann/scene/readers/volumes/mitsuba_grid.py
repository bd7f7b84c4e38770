"""Grids of Mitsuba's ``gridvolume`` (``.vol``): x runs fastest, then y, then z; +y is up."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from lippmann.errors import SceneError
from lippmann.runtime.machine import check_input
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.volumes.description import describe_volume

#: Magic, version, encoding, voxels along x, y and z, channels, and the box: lowest corner, then highest.
_HEADER = struct.Struct("<3sB5i6f")
_FLOAT = 1


def read_mitsuba_grid(path: Path) -> SceneDescription:
    """Read a grid of single-precision numbers, one a voxel, in the box that the file names.

    Raises
    ------
    SceneError
        The file is missing or damaged, or holds several numbers a voxel.
    MemoryLimitError
        It holds more than the memory that is left.
    """
    where = path.name
    data = read_bytes(path)
    if len(data) < _HEADER.size or data[:3] != b"VOL":
        raise SceneError("is no grid of Mitsuba's", where=where, rule="it begins with VOL")
    _, version, encoding, width, height, depth, channels, *box = _HEADER.unpack_from(data)
    if version != 3 or encoding != _FLOAT:
        raise SceneError(f"is of version {version}, encoding {encoding}", where=where, rule="version 3, encoding 1")
    if channels != 1:
        raise SceneError(f"holds {channels} numbers a voxel", where=where, rule="one a voxel is shown")
    if min(width, height, depth) < 1:
        raise SceneError(f"has {width} x {height} x {depth} voxels", where=where, rule="1 or more along each axis")
    voxels = width * height * depth
    if len(data) < _HEADER.size + 4 * voxels:
        raise SceneError(f"holds {len(data) - _HEADER.size} of {4 * voxels} bytes of voxels", where=where)
    check_input(4 * voxels, "the grid", where=where)
    grid = np.frombuffer(data, "<f4", voxels, _HEADER.size).reshape(depth, height, width)
    low, high = np.array(box[:3], np.float64), np.array(box[3:], np.float64)
    if not np.isfinite(box).all() or (high <= low).any():
        raise SceneError("its box has no extent", where=where, rule="the lowest corner, then the highest")
    step = (high - low) / (width, height, depth)
    world_from_voxel = np.diag([*step, 1.0])
    # Mitsuba's grids reach from the outer side of the first voxel to that of the last.
    world_from_voxel[:3, 3] = low + step / 2.0
    return describe_volume(path.stem, grid, world_from_voxel)
