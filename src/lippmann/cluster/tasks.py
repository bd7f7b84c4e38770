"""Tasks that run in a worker's process: its versions, the start of the engine, and a part of a job."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lippmann.cluster.job_pickle import unpack
from lippmann.errors import ClusterError, UsageError
from lippmann.journal.tile_file import encode
from lippmann.runtime.atomic_write import scratch_folder

if TYPE_CHECKING:
    from lippmann.tiles.job import TileJob

#: Environment variable with the number of the engine's threads in a worker.
THREADS_VARIABLE = "LIPPMANN_WORKER_THREADS"

#: Does the engine's share of a part, and returns a function that does the rest and gives the part.
Render = Callable[[int], Callable[[], Any]]

# One kernel at a time fills all threads of a worker, and the engine's state belongs to the whole process.
_engine = threading.Lock()
_current: dict[str, Render] = {}


class Job(Protocol):
    """Work that is done part by part, anywhere and in any order. It can be pickled."""

    def name(self, index: int) -> str:
        """A part's name for people."""

    def open(self, threads: int | None) -> Render:
        """Begin the work, with so many threads of the engine; files of the scene are there until this returns."""


class FrameJob(Job, Protocol):
    """Frames of a film, which follow others that their worker has to render before them."""

    @property
    def frames(self) -> Sequence[int]:
        """Their numbers."""

    def count_before(self, index: int) -> int:
        """How many frames a worker renders before a frame if it has rendered none."""


@dataclass(frozen=True)
class PictureJob:
    """The tiles of a picture."""

    job: TileJob

    def name(self, index: int) -> str:
        """A tile's row and column."""
        return self.job.grid.name(index)

    def open(self, threads: int | None) -> Render:
        """Build the scene; tiles come as :func:`lippmann.journal.tile_file.encode` encodes them."""
        from lippmann.tiles.tile_render import pack, prepare, trace_tile

        prepared = prepare(replace(self.job, request=replace(self.job.request, threads=threads)))

        def trace(index: int) -> Callable[[], bytes]:
            traced = trace_tile(prepared, index)
            return lambda: encode(pack(prepared, traced))

        return trace


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
) -> Any:
    """Render one part of a serialized job: a tile, or a frame.

    Parameters
    ----------
    key:
        SHA-256 of the job; the scene is built once for all parts of one key.
    index:
        Number of the part.
    outline, names, parts:
        The job, for :func:`lippmann.cluster.job_pickle.unpack`.

    Returns
    -------
    The part as the :class:`Job` gives it.

    Raises
    ------
    UsageError
        What was asked for cannot be rendered, here or elsewhere.
    ClusterError
        With the text of any other error: not every error can be pickled.
    """
    try:
        with _engine:
            finish = _opened(key, outline, names, parts)(index)
        return finish()
    except UsageError:
        raise
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


def _opened(key: str, outline: NDArray[np.uint8], names: Sequence[str], parts: Sequence[NDArray[np.generic]]) -> Render:
    if key not in _current:
        _current.clear()  # one scene at a time
        with scratch_folder("lippmann-scene-") as folder:
            _current[key] = unpack(key, outline, names, parts, Path(folder)).open(engine_threads())
    return _current[key]
