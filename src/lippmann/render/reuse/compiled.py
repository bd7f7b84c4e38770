"""How kernels are compiled, and kept on disk.

Numba keeps compiled code beside the source, or in the user's cache folder where that cannot be written. It looks for
changes in the file of a kernel only; here a kernel also grows old when any module in the folder of its own changes,
since parts of kernels come from other modules.
"""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import njit

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

#: Numba numbers the files of one function's variants, and enters a number into its index before it writes the file. Of
#: two processes that compile at once, or of an older version's files, one would then load and run code that is not what
#: the index says. Names that no other process gives exclude that.
_PROCESS = uuid.uuid4().hex[:12]

#: Without the interpreter's lock, and divisions as the processor does them.
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}


def compiled(kernel: Kernel) -> Kernel:
    """A compiled function."""
    return _kept(kernel, {})


def uncounted(kernel: Kernel) -> Kernel:
    """A compiled function that allocates nothing.

    No references to arrays are counted in it: the counters, shared by all threads, would take longer than all else.
    """
    return _kept(kernel, {"_nrt": False})


def inlined(kernel: Kernel) -> Kernel:
    """A part of compiled functions."""
    return cast("Kernel", cast("Any", njit)(**_OPTIONS, inline="always")(kernel))


def _kept(kernel: Kernel, options: dict[str, Any]) -> Kernel:
    dispatcher = cast("Any", njit)(**_OPTIONS, **options)(kernel)
    try:
        dispatcher.enable_caching()
        file = dispatcher._cache._cache_file
        file._source_stamp = source_stamp(Path(kernel.__code__.co_filename).parent)
        file._data_name_pattern = file._data_name_pattern.replace("{number", f"{_PROCESS}.{{number")
    except RuntimeError:
        pass  # neither the package nor the user's folder can be written: compiled anew by each process
    return cast("Kernel", dispatcher)


@cache
def source_stamp(folder: Path) -> str:
    """Stands for the sources of all modules in a folder, and for how they are compiled."""
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for path in sorted(folder.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()
