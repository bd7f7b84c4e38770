"""Libraries that only some layouts need: they come with the extra ``exchange``."""

from __future__ import annotations

import importlib
from typing import Any

from lippmann.errors import UsageError


def optional(name: str) -> Any:
    """The library of that name.

    Raises
    ------
    UsageError
        If it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError:
        fix = 'install it: pip install "lippmann[exchange]"'
        raise UsageError(f"this layout needs {name}, which is not installed", fix=fix) from None
