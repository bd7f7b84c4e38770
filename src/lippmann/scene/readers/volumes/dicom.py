"""Volumes of DICOM files: all slices of a series, in the order in which they lie in the patient."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError, UsageError
from lippmann.runtime.helper_process import HelperEndedError, HelperProcess
from lippmann.runtime.machine import check_input, input_memory_left
from lippmann.runtime.optional_import import check_installed
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.volumes.description import WORLD_FROM_LPS, describe_volume
from lippmann.scene.volumes.presets import Kind

_MOST_SECONDS = 900.0
_LENGTH = struct.Struct("<Q")
_KINDS: dict[str, Kind] = {"CT": "ct", "MR": "mr"}

_process = HelperProcess("from lippmann.scene.readers.volumes.dicom_child import main; main()", _MOST_SECONDS)


def read_dicom(path: Path, *, series: str | None = None) -> SceneDescription:
    """Read a series of a folder and those below it, or the series of one file with what lies beside it.

    World units are millimetres; the patient is seen from the front, head up. Slices are placed by their positions;
    missing and unevenly spaced ones are interpolated. Names and other data of patients are not read.

    Parameters
    ----------
    series:
        Number (from 1), description or UID of a series; None for that with the most slices.

    Raises
    ------
    SceneError
        ``pydicom`` is not installed; the files are missing, damaged, compressed as nothing here decodes, or hold no
        pictures of one number a pixel.
    MemoryLimitError
        They hold more than the memory that is left.
    UsageError
        There is no such series.
    """
    where = path.name or str(path)
    if not path.is_dir():
        read_bytes(path, 132)
    check_installed("pydicom", "volumes", "DICOM files need it", where)
    left = input_memory_left()
    request = json.dumps({"path": str(path.resolve()), "series": series, "memory": left}).encode()
    try:
        answer = _process.ask(request, where=where)
    except HelperEndedError as error:
        raise SceneError(f"pydicom breaks down at the files ({error})", where=where, fix="are they whole?") from None
    head, grid = _unpack(answer)
    if "usage" in head:
        raise UsageError(f"'{series}'", where=where, parameter="series", rule=head["usage"])
    if "error" in head:
        raise SceneError(head["error"], where=where, rule=head.get("rule", ""), fix=head.get("fix", ""))
    check_input(2 * grid.nbytes, "the series", where=where)
    return describe_volume(
        path.stem if not path.is_dir() else where,
        grid,
        WORLD_FROM_LPS @ np.array(head["patient_from_voxel"]),
        slope=head["slope"],
        intercept=head["intercept"],
        kind=_KINDS.get(head["modality"]),
        notes=head["notes"],
    )


def _unpack(answer: bytes) -> tuple[dict[str, Any], NDArray[np.generic]]:
    (length,) = _LENGTH.unpack_from(answer)
    head = json.loads(answer[_LENGTH.size : _LENGTH.size + length])
    if "shape" not in head:
        return head, np.zeros((0, 0, 0), np.int16)
    grid = np.frombuffer(answer, head["dtype"], offset=_LENGTH.size + length).reshape(head["shape"])
    return head, grid
