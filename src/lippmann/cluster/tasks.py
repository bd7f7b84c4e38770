"""What runs inside a worker's process: who it is, and a tile of a picture."""

from __future__ import annotations

import os
import tempfile
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lippmann.cluster.job_pickle import unpack
from lippmann.errors import ClusterError
from lippmann.journal.tile_file import encode

if TYPE_CHECKING:
    from lippmann.tiles.tile_render import Prepared

#: How many threads the engine takes in a worker; without it as many as the worker itself has.
THREADS_VARIABLE = "LIPPMANN_WORKER_THREADS"

# One kernel at a time fills all threads of a worker, and the engine keeps its state for the whole process.
_engine = threading.Lock()
_current: dict[str, Prepared] = {}


def own_versions() -> dict[str, str]:
    """What two machines must have in common to give the same bytes."""
    return make_introduction()()


def make_introduction() -> Callable[[], dict[str, str]]:
    """A function that tells the versions of the machine that it runs on; it needs nothing of ours to be there."""
    packages = {"Lippmann": "lippmann", "Mitsuba": "mitsuba", "Dr.Jit": "drjit", "Open Image Denoise": "pyoidn"}

    # A function inside a function travels as code, not as the name of a module that another version may lack.
    def introduce() -> dict[str, str]:
        from contextlib import suppress
        from importlib.metadata import PackageNotFoundError, version

        found = {"LLVM": "none"}
        for label, package in packages.items():
            try:
                found[label] = version(package)
            except PackageNotFoundError:
                found[label] = "none"
        try:
            from lippmann._version import VERSION

            found["Lippmann"] = VERSION
            from lippmann.errors import EngineError
            from lippmann.runtime import llvm
        except ImportError:
            return found
        with suppress(EngineError):  # a machine that renders on its GPU needs none
            found["LLVM"] = llvm.choose().version_text
        return found

    return introduce


def render_part(
    key: str, index: int, outline: NDArray[np.uint8], names: Sequence[str], parts: Sequence[NDArray[Any]]
) -> bytes:
    """One tile of a parcel's job, as :func:`lippmann.journal.tile_file.encode` writes it.

    Parameters
    ----------
    key, outline, names, parts:
        As of :class:`lippmann.cluster.job_pickle.Parcel`; the scene is built once for all tiles of one key.
    index:
        The tile's number.

    Raises
    ------
    ClusterError
        Whatever went wrong, in words: not every error can travel.
    """
    from lippmann.runtime import engine
    from lippmann.tiles.tile_render import packed, trace_tile

    try:
        with _engine:
            prepared = _prepared(key, outline, names, parts)
            request = prepared.job.request
            engine.start(request.device, request.threads)  # each thread of a worker chooses its variant
            traced = trace_tile(prepared, index)
        return encode(packed(prepared, traced))
    except Exception as error:  # noqa: BLE001 - whatever it was, it has to travel
        raise ClusterError(f"{type(error).__name__}: {error}") from None


def warm() -> None:
    """Start the engine, so that the first tile need not wait for it."""
    from lippmann.runtime.engine import start

    start("cpu", engine_threads())


def engine_threads() -> int | None:
    """Threads that the engine takes in this worker; None for all cores where nothing says otherwise."""
    said = os.environ.get(THREADS_VARIABLE, "")
    if said.isdigit() and int(said) > 0:
        return int(said)
    try:
        from distributed import get_worker

        return int(get_worker().state.nthreads)
    except (ImportError, ValueError):
        return None


def _prepared(key: str, outline: NDArray[np.uint8], names: Sequence[str], parts: Sequence[NDArray[Any]]) -> Prepared:
    if key not in _current:
        from lippmann.tiles.tile_render import prepare

        _current.clear()  # one scene at a time: the last job's is not needed any more
        with tempfile.TemporaryDirectory(prefix="lippmann-scene-") as folder:
            job = unpack(outline, names, parts, Path(folder))
            job = replace(job, request=replace(job.request, threads=engine_threads()))
            _current[key] = prepare(job)
    return _current[key]
