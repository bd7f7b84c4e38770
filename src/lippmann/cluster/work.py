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

from lippmann._version import VERSION
from lippmann.cluster.parcel import unpack
from lippmann.errors import ClusterError
from lippmann.store.tile_file import encode

if TYPE_CHECKING:
    from lippmann.render.tile_tracer import Prepared

#: How many threads the engine takes in a worker; without it as many as the worker itself has.
THREADS_VARIABLE = "LIPPMANN_WORKER_THREADS"

# One kernel at a time fills all threads of a worker, and the engine keeps its state for the whole process.
_engine = threading.Lock()
_current: dict[str, Prepared] = {}


def own_versions() -> dict[str, str]:
    """What two machines must have in common to give the same bytes."""
    from importlib.metadata import version

    return {"Lippmann": VERSION, "Mitsuba": version("mitsuba"), "Dr.Jit": version("drjit")}


def make_introduction() -> Callable[..., dict[str, str]]:
    """A function that tells the versions of the worker that it runs on; it needs nothing of ours to be there."""

    # A function inside a function travels as code, not as the name of a module that another version may lack.
    def introduce() -> dict[str, str]:
        from importlib.metadata import PackageNotFoundError, version

        found = {}
        for label, package in (("Lippmann", "lippmann"), ("Mitsuba", "mitsuba"), ("Dr.Jit", "drjit")):
            try:
                found[label] = version(package)
            except PackageNotFoundError:
                found[label] = "none"
        try:
            from lippmann._version import VERSION
        except ImportError:
            return found
        return {**found, "Lippmann": VERSION}

    return introduce


def render_part(
    key: str, index: int, outline: NDArray[np.uint8], names: Sequence[str], parts: Sequence[NDArray[Any]]
) -> bytes:
    """One tile of a parcel's job, as :func:`lippmann.store.tile_file.encode` writes it.

    Parameters
    ----------
    key, outline, names, parts:
        As of :class:`lippmann.cluster.parcel.Parcel`; the scene is built once for all tiles of one key.
    index:
        The tile's number.

    Raises
    ------
    ClusterError
        Whatever went wrong, in words: not every error can travel.
    """
    from lippmann import engine
    from lippmann.render.tile_tracer import packed, trace_tile

    try:
        with _engine:
            prepared = _prepared(key, outline, names, parts)
            settings = prepared.job.settings
            engine.start(settings.device, settings.threads)  # each thread of a worker chooses its variant
            traced = trace_tile(prepared, index)
        return encode(packed(prepared, traced))
    except Exception as error:  # noqa: BLE001 - whatever it was, it has to travel
        raise ClusterError(f"{type(error).__name__}: {error}") from None


def warm() -> None:
    """Start the engine, so that the first tile need not wait for it."""
    from lippmann.engine import start

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
        from lippmann.render.tile_tracer import prepare

        _current.clear()  # one scene at a time: the last job's is not needed any more
        with tempfile.TemporaryDirectory(prefix="lippmann-scene-") as folder:
            job = unpack(outline, names, parts, Path(folder))
            job = replace(job, settings=replace(job.settings, threads=engine_threads()))
            _current[key] = prepare(job)
    return _current[key]
