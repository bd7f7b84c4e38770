"""Compilation of kernels by Numba, and their cache on disk.

Numba caches compiled code beside the source, or in the user's cache folder if that is read-only. It checks the file of
a kernel for changes. Kernels use functions of other modules, so here a cached kernel is invalid as soon as any module
of its package (``rendering/reprojection``, ``metrics``) has changed.

Numba itself is imported when a kernel is first called: it takes longer to load than some pictures to trace. So what
every render needs is no kernel of Numba's, but operations on whole arrays, of NumPy or of Dr.Jit.
"""

from __future__ import annotations

import functools
import hashlib
import os
import sys
import threading
import uuid
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar, cast

from lippmann.errors import UsageError

#: Numba reads settings from a file of this name in the working directory, among them the folder of compiled code that
#: it runs. A downloaded folder must not set them.
_SETTINGS_FILE = ".numba_config.yaml"

if "numba" not in sys.modules and os.path.exists(_SETTINGS_FILE):
    raise UsageError(
        "would set up Numba",
        where=_SETTINGS_FILE,
        rule="files of the working directory are not trusted",
        fix="start from another folder, or set variables NUMBA_... in the environment",
    )

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

#: Numba numbers the files of one function's variants, and enters a number into its index before it writes the file. Of
#: two processes that compile at once, or of an older version's files, one would then load and run code that is not what
#: the index says. Names that no other process gives exclude that.
_process = uuid.uuid4().hex[:12]

#: Held while dispatchers are made.
_making = threading.RLock()

#: Without the interpreter's lock, and divisions as the processor does them.
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}


class Deferred:
    """A kernel whose Numba dispatcher is made when it is first needed; it has the dispatcher's attributes."""

    def __init__(self, kernel: Callable[..., Any], options: Mapping[str, Any], *, kept: bool) -> None:
        functools.update_wrapper(self, kernel)
        self._kernel, self._options, self._kept = cast("FunctionType", kernel), options, kept
        self._dispatcher: Any = None

    def __call__(self, *arguments: Any) -> Any:
        return self.dispatcher()(*arguments)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.dispatcher(), name)

    def dispatcher(self) -> Any:
        """The dispatcher; kernels that this one may call have theirs then, under the names by which it calls them."""
        with _making:
            if self._dispatcher is None:
                names = dict(self._kernel.__globals__)
                kernel = FunctionType(self._kernel.__code__, names, self._kernel.__name__, self._kernel.__defaults__)
                kernel.__qualname__ = self._kernel.__qualname__
                self._dispatcher = _numba().njit(**_OPTIONS, **self._options)(kernel)
                if self._kept:
                    _keep(self._dispatcher, Path(kernel.__code__.co_filename).parent)
                for name, value in names.items():
                    if isinstance(value, Deferred):
                        names[name] = value.dispatcher()
        return self._dispatcher


def compiled(kernel: Kernel) -> Kernel:
    """Compile a kernel, cached on disk; it runs without the interpreter's lock."""
    return cast("Kernel", Deferred(kernel, {}, kept=True))


def uncounted(kernel: Kernel) -> Kernel:
    """Compile a kernel that allocates no memory, without reference counts of its arrays.

    The counts are shared by all threads and would dominate the run time.
    """
    return cast("Kernel", Deferred(kernel, {"_nrt": False}, kept=True))


def inlined(kernel: Kernel) -> Kernel:
    """Compile a function that is inlined into kernels."""
    return cast("Kernel", Deferred(kernel, {"inline": "always"}, kept=False))


@cache
def _numba() -> Any:
    import numba
    from numba.core import config
    from numba.core.compiler_lock import global_compiler_lock

    # Numba looks for its file of settings again whenever it compiles.
    config._config_fname = os.devnull
    lock = cast("Any", global_compiler_lock)

    def after_fork() -> None:
        """Set up the child: with a name of its own, and Numba's lock released."""
        global _process
        _process = uuid.uuid4().hex[:12]
        lock.release()

    if hasattr(os, "register_at_fork"):  # not on Windows, which has no fork
        # While a thread compiles, Numba and LLVM hold locks that nobody would release in the child: a fork waits.
        os.register_at_fork(before=lock.acquire, after_in_parent=lock.release, after_in_child=after_fork)
    return numba


def _keep(dispatcher: Any, folder: Path) -> None:
    """Cache what a dispatcher compiles on disk."""
    try:
        dispatcher.enable_caching()
        file = dispatcher._cache._cache_file
        file._source_stamp = source_stamp(folder)
        pattern = file._data_name_pattern.replace("{number", "{process}.{number")
        file._data_name = lambda number: pattern.format(process=_process, number=number)
    except RuntimeError:
        pass  # neither the package nor the user's folder is writable: each process compiles the kernel


@cache
def source_stamp(folder: Path) -> str:
    """SHA-256, in hexadecimal, of the sources of a folder's package and of this module."""
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for path in sorted(_package(folder).rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _package(folder: Path) -> Path:
    """The package, two levels below the root, to which a folder belongs: its kernels share functions across folders."""
    root = Path(__file__).parent.parent
    if not folder.is_relative_to(root):
        return folder
    return root.joinpath(*folder.relative_to(root).parts[:2])
