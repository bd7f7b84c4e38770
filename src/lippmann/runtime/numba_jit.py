"""Compilation of kernels by Numba, and their cache on disk.

Numba caches compiled code beside the source, or in the user's cache folder if that is read-only. It checks the file of
a kernel for changes. Kernels use functions of other modules, so here a cached kernel is invalid as soon as any module
of its package (``rendering/reprojection``, ``metrics``) has changed.
"""

from __future__ import annotations

import hashlib
import os
import sys
import uuid
from collections.abc import Callable
from functools import cache
from pathlib import Path
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

from numba import njit  # noqa: E402
from numba.core import config  # noqa: E402
from numba.core.compiler_lock import global_compiler_lock  # noqa: E402

# Numba looks for the file again whenever it compiles.
config._config_fname = os.devnull

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

#: Numba numbers the files of one function's variants, and enters a number into its index before it writes the file. Of
#: two processes that compile at once, or of an older version's files, one would then load and run code that is not what
#: the index says. Names that no other process gives exclude that.
_process = uuid.uuid4().hex[:12]

#: Held by the thread that compiles.
_lock = cast("Any", global_compiler_lock)


def _after_fork() -> None:
    """Set up the child: with a name of its own, and Numba's lock released."""
    global _process
    _process = uuid.uuid4().hex[:12]
    _lock.release()


if hasattr(os, "register_at_fork"):  # not on Windows, which has no fork
    # While a thread compiles, Numba and LLVM hold locks that nobody would release in the child: a fork waits for it.
    os.register_at_fork(before=_lock.acquire, after_in_parent=_lock.release, after_in_child=_after_fork)

#: Without the interpreter's lock, and divisions as the processor does them.
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}


def compiled(kernel: Kernel) -> Kernel:
    """Compile a kernel, cached on disk; it runs without the interpreter's lock."""
    return _cached(kernel, {})


def uncounted(kernel: Kernel) -> Kernel:
    """Compile a kernel that allocates no memory, without reference counts of its arrays.

    The counts are shared by all threads and would dominate the run time.
    """
    return _cached(kernel, {"_nrt": False})


def inlined(kernel: Kernel) -> Kernel:
    """Compile a function that is inlined into kernels."""
    return cast("Kernel", cast("Any", njit)(**_OPTIONS, inline="always")(kernel))


def _cached(kernel: Kernel, options: dict[str, Any]) -> Kernel:
    dispatcher = cast("Any", njit)(**_OPTIONS, **options)(kernel)
    try:
        dispatcher.enable_caching()
        file = dispatcher._cache._cache_file
        file._source_stamp = source_stamp(Path(kernel.__code__.co_filename).parent)
        pattern = file._data_name_pattern.replace("{number", "{process}.{number")
        file._data_name = lambda number: pattern.format(process=_process, number=number)
    except RuntimeError:
        pass  # neither the package nor the user's folder is writable: each process compiles the kernel
    return cast("Kernel", dispatcher)


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
