"""Import of libraries that only some layouts need, from the extra ``exchange``."""

from __future__ import annotations

import importlib
from types import ModuleType

from lippmann.errors import UsageError


def optional(name: str) -> ModuleType:
    """Import the library ``name``.

    Raises
    ------
    UsageError
        If the library is not installed; the message names the extra that installs it.
    """
    try:
        return importlib.import_module(name)
    except ImportError:
        fix = 'install it: pip install "lippmann[exchange]"'
        raise UsageError(f"{name} is not installed", rule="this layout needs it", fix=fix) from None
