"""Stages are opened in a process of their own: USD is native code, and trusts its files."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.runtime.helper_process import HelperEndedError, HelperProcess
from lippmann.runtime.machine import input_memory_left
from lippmann.scene.parsing.files import NamedFiles
from lippmann.scene.readers.usd.records import Record, unpack

#: Seconds that reading a stage may take.
MOST_SECONDS = 300.0

_process = HelperProcess("from lippmann.scene.readers.usd.stage_child import main; main()", MOST_SECONDS)


def ask_stage(
    path: Path, variants: Mapping[str, str], seconds: float | None, named: NamedFiles
) -> tuple[Record, list[NDArray[np.generic]]]:
    """The visible content of a stage: records, and the arrays to which they refer by number.

    Parameters
    ----------
    variants:
        ``{"set": "choice"}`` for all prims, ``{"/prim:set": "choice"}`` for one.
    seconds:
        Time since the stage's beginning; None for the stage at rest.
    named:
        The files that it may name.

    Raises
    ------
    SceneError
        ``usd-core`` is not installed; USD refuses the file, or ends over it; a layer lies outside the file's folder; no
        prim has such a variant.
    MemoryLimitError
        It takes more memory than is left.
    """
    if importlib.util.find_spec("pxr") is None:
        fix = "install it: pip install 'lippmann[usd]'"
        raise SceneError("USD files need the library usd-core", where=path.name, fix=fix)
    place = path.resolve()
    status = place.stat()
    request = {
        "path": str(place),
        "stamp": [status.st_mtime_ns, status.st_size, status.st_ino],
        "folder": None if named.anywhere else str(named.folder),
        "variants": dict(variants),
        "seconds": seconds,
        "memory": input_memory_left(),
    }
    try:
        answer = _process.ask(json.dumps(request).encode(), where=path.name)
    except HelperEndedError as error:
        raise SceneError(f"USD breaks down at the file ({error})", where=path.name, fix="is it whole?") from None
    tree, arrays = unpack(answer)
    if "error" in tree:
        fault = tree["error"]
        raise SceneError(fault["what"], where=path.name, rule=fault["rule"], fix=fault["fix"])
    return tree, arrays
