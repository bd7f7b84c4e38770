"""A folder for Dask's files that other accounts of the machine can neither read nor fill."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

from lippmann.errors import ClusterError


@contextmanager
def private_scratch() -> Iterator[str]:
    """A new folder of this account alone, removed at the end.

    By default Dask takes ``dask-scratch-space`` in the shared temporary folder, whoever made it, and imports modules
    from there: it puts the folder first on ``sys.path``. The new folder lies where Dask is configured to keep its
    temporary files (``temporary-directory``), else in the system's temporary folder.

    Raises
    ------
    ClusterError
        The folder cannot be made.
    """
    import dask

    above = dask.config.get("temporary-directory", None)
    try:
        if above is not None:
            os.makedirs(above, exist_ok=True)
        scratch = tempfile.TemporaryDirectory(prefix="lippmann-dask-", dir=above, ignore_cleanup_errors=True)
    except OSError as error:
        raise ClusterError(
            f"no folder for Dask's files can be made ({error})", fix="set DASK_TEMPORARY_DIRECTORY to a folder of yours"
        ) from None
    with scratch as folder:
        try:
            yield folder
        finally:
            # Dask leaves it there where something else has come first since. Others could make it anew.
            sys.path[:] = [entry for entry in sys.path if not str(entry).startswith(folder)]
