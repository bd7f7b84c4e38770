"""A folder for all temporary files of Dask and of workers, which other accounts can neither read nor write."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from lippmann.errors import ClusterError
from lippmann.runtime.atomic_write import scratch_folder

#: Names the temporary folder to Python's ``tempfile``, before other variables, on all systems.
_VARIABLE = "TMPDIR"


@contextmanager
def private_scratch() -> Iterator[str]:
    """Path of a new folder of this account alone, removed at the end.

    By default Dask uses ``dask-scratch-space`` in the shared temporary folder, whoever created it, and imports modules
    from it, since it puts the folder first on ``sys.path``. The new folder is created in Dask's configured
    ``temporary-directory``, else in the system's temporary folder.

    Until the end it is the temporary folder of this process and of those that it starts: whatever workers have left
    that were killed, or Dask's threads, goes with it.

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
        own, inherited = tempfile.tempdir, os.environ.get(_VARIABLE)
        tempfile.tempdir = os.environ[_VARIABLE] = folder
        try:
            yield folder
        finally:
            tempfile.tempdir = own
            if inherited is None:
                del os.environ[_VARIABLE]
            else:
                os.environ[_VARIABLE] = inherited
            # Dask does not remove the entry if another one precedes it, and others could recreate the folder.
            sys.path[:] = [entry for entry in sys.path if not str(entry).startswith(folder)]
