"""Splats of ``.splat`` files, as viewers in browsers have them: 32 bytes each, without a header.

Place and standard deviations as floats, then bytes of red, green, blue and opacity, and of the rotation, w first
(github.com/antimatter15/splat).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lippmann.errors import SceneError
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.readers.splats.activation import SH_0, ask_memory, clean
from lippmann.scene.values.description import SceneDescription

_RECORD = np.dtype([("place", "<f4", 3), ("scale", "<f4", 3), ("color", "u1", 4), ("turn", "u1", 4)])


def read_splat(path: Path) -> SceneDescription:
    """Read a ``.splat`` file, whose colours do not depend on the direction. It names no other file.

    Raises
    ------
    SceneError, MemoryLimitError
        The file is missing, cut short, or takes more memory than is left.
    """
    where, data = path.name, read_bytes(path)
    if len(data) % _RECORD.itemsize:
        rule = f"a splat has {_RECORD.itemsize}"
        raise SceneError(f"holds {len(data)} bytes", where=where, rule=rule, fix="is it cut short?")
    table = np.frombuffer(data, _RECORD)
    ask_memory(len(table), 1, where=where)
    codes = table["color"].astype(np.float32) / np.float32(255.0)
    turns = (table["turn"].astype(np.float32) - 128.0)[:, [1, 2, 3, 0]]
    harmonics = ((codes[:, None, :3] - 0.5) / SH_0).astype(np.float32)
    splats, notes = clean(table["place"], table["scale"], turns, codes[:, 3], harmonics, where=where)
    return SceneDescription(path.stem, splats=splats, notes=notes)
