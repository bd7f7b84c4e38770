"""Scans by laser in LAS and LAZ files (ASPRS LAS 1.0 to 1.4), COPC among them, as clouds of points."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lippmann.errors import SceneError
from lippmann.runtime.helper_process import HelperEndedError, HelperProcess
from lippmann.runtime.optional_import import check_installed
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.parsing.ply_header import Element, Header, Property
from lippmann.scene.readers.ply import describe_polygons
from lippmann.scene.values.description import SceneDescription

_MOST_SECONDS = 600.0

_process = HelperProcess("from lippmann.scene.readers.lidar.child import main; main()", _MOST_SECONDS)


def read_las(path: Path) -> SceneDescription:
    """Read a scan with its colours (sRGB-coded, of 8 or 16 bits); points of noise and withheld ones are left out.

    Raises
    ------
    SceneError
        ``laspy`` is not installed; the file is missing, damaged or cut short, or holds no points.
    MemoryLimitError
        It holds more than the memory that is left.
    """
    where = path.name
    read_bytes(path, 64)
    check_installed("laspy", "lidar", "LAS and LAZ files need it", where)
    try:
        arrays = _process.ask_arrays(path)
    except HelperEndedError as error:
        raise SceneError(f"laspy breaks down at the file ({error})", where=where, fix="is it whole?") from None
    if "error" in arrays:
        raise SceneError(f"is no scan that is understood ({arrays['error']})", where=where, rule="LAS or LAZ")
    positions, colors = (arrays[name].astype(np.float64) for name in ("positions", "colors"))
    kinds = dict.fromkeys("xyz", "f8") | dict.fromkeys(("red", "green", "blue"), "u2")
    columns = dict(zip(kinds, (*positions.T, *colors.T) if len(colors) else positions.T, strict=False))
    properties = [Property(name, kinds[name], None) for name in columns]
    header = Header([Element("vertex", len(positions), properties)], notes=arrays["notes"].tolist())
    return describe_polygons(header, {"vertex": columns}, path)
