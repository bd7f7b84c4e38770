"""A folder for Dask's files that other accounts of the machine can neither read nor write."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from lippmann.errors import ClusterError
from lippmann.runtime.atomic_write import scratch_folder


@contextmanager
def private_scratch() -> Iterator[str]:
    """Path of a new folder of this account alone, removed at the end.

    By default Dask uses ``dask-scratch-space`` in the shared temporary folder, whoever created it, and imports modules
    from it, since it puts the folder first on ``sys.path``. The new folder is created in Dask's configured
    ``temporary-directory``, else in the system's temporary folder.

    Raises
    ------
    ClusterError
        If the folder cannot be created.
    """
    import dask

    above = dask.config.get("temporary-directory", None)
    stack = ExitStack()
    try:
        if above is not None:
            os.makedirs(above, exist_ok=True)
        folder = stack.enter_context(scratch_folder("lippmann-dask-", above))
    except OSError as error:
        raise ClusterError(
            f"no folder for Dask's files can be made ({error})", fix="set DASK_TEMPORARY_DIRECTORY to a folder of yours"
        ) from None
    with stack:
        try:
            yield folder
        finally:
            # Dask does not remove the entry if another one precedes it, and others could recreate the folder.
            sys.path[:] = [entry for entry in sys.path if not str(entry).startswith(folder)]
