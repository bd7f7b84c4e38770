"""Tasks that run in a worker's process: its versions, the start of the engine, and a tile of a picture."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.cluster.job_pickle import unpack
from lippmann.errors import ClusterError
from lippmann.journal.tile_file import encode
from lippmann.runtime.atomic_write import scratch_folder

if TYPE_CHECKING:
    from lippmann.tiles.tile_render import Prepared

#: Environment variable with the number of the engine's threads in a worker.
THREADS_VARIABLE = "LIPPMANN_WORKER_THREADS"

# One kernel at a time fills all threads of a worker, and the engine's state belongs to the whole process.
_engine = threading.Lock()
_current: dict[str, Prepared] = {}


def own_versions() -> dict[str, str]:
    """Versions of this machine that must agree with those of a worker for equal bytes, by package."""
    return make_version_query()()


def make_version_query() -> Callable[[], dict[str, str]]:
    """A function that returns the versions of the machine on which it runs, even without Lippmann there."""
    packages = {"Lippmann": "lippmann", "Mitsuba": "mitsuba", "Dr.Jit": "drjit", "Open Image Denoise": "pyoidn"}

    # A nested function is pickled as code, not as a name in a module that another version may lack.
    def query_versions() -> dict[str, str]:
        from contextlib import suppress
        from importlib.metadata import PackageNotFoundError, version

        versions = {"LLVM": "none"}
        for label, package in packages.items():
            try:
                versions[label] = version(package)
            except PackageNotFoundError:
                versions[label] = "none"
        try:
            from lippmann._version import VERSION

            versions["Lippmann"] = VERSION
            from lippmann.errors import EngineError
            from lippmann.runtime import llvm
        except ImportError:
            return versions
        with suppress(EngineError):  # a GPU needs no LLVM
            versions["LLVM"] = llvm.choose().version_text
        return versions

    return query_versions


def render_part(
    key: str, index: int, outline: NDArray[np.uint8], names: Sequence[str], parts: Sequence[NDArray[np.generic]]
) -> bytes:
    """Render one tile of a serialized job.

    Parameters
    ----------
    key:
        SHA-256 of the job; the scene is built once for all tiles of one key.
    index:
        Number of the tile.
    outline, names, parts:
        The job, for :func:`lippmann.cluster.job_pickle.unpack`.

    Returns
    -------
    The tile as :func:`lippmann.journal.tile_file.encode` encodes it.

    Raises
    ------
    ClusterError
        With the text of any error: not every error can be pickled.
    """
    from lippmann.runtime import engine
    from lippmann.tiles.tile_render import pack, trace_tile

    try:
        with _engine:
            prepared = _prepared(key, outline, names, parts)
            request = prepared.job.request
            engine.start(request.device, request.threads)  # each thread of a worker chooses its variant
            traced = trace_tile(prepared, index)
        return encode(pack(prepared, traced))
    except Exception as error:  # noqa: BLE001 - every error has to reach the client
        raise ClusterError(f"{type(error).__name__}: {error}") from None


def start_engine() -> None:
    """Start the engine on the CPU before the first tile arrives."""
    from lippmann.runtime.engine import start

    start("cpu", engine_threads())


def engine_threads() -> int | None:
    """Number of the engine's threads in this worker: that of the variable, else the worker's; None for all cores."""
    text = os.environ.get(THREADS_VARIABLE, "")
    if text.isdigit() and int(text) > 0:
        return int(text)
    try:
        from distributed import get_worker

        return int(get_worker().state.nthreads)
    except (ImportError, ValueError):
        return None


def _prepared(
    key: str, outline: NDArray[np.uint8], names: Sequence[str], parts: Sequence[NDArray[np.generic]]
) -> Prepared:
    if key not in _current:
        from lippmann.tiles.tile_render import prepare

        _current.clear()  # one scene at a time
        with scratch_folder("lippmann-scene-") as folder:
            job = unpack(key, outline, names, parts, Path(folder))
            job = replace(job, request=replace(job.request, threads=engine_threads()))
            _current[key] = prepare(job)
    return _current[key]
