"""Import of libraries that only some files need, from an extra of the package."""

from __future__ import annotations

import importlib
import importlib.util
from types import ModuleType

from lippmann.errors import SceneError


def check_installed(name: str, extra: str, why: str, where: str) -> None:
    """Check that the library ``name`` is there, without loading it.

    Raises
    ------
    SceneError
        It is not; the message names the extra that installs it.
    """
    if importlib.util.find_spec(name) is None:
        raise SceneError(f"{name} is not installed", where=where, rule=why, fix=f"pip install 'lippmann[{extra}]'")


def optional(name: str, extra: str, why: str, where: str) -> ModuleType:
    """Import the library ``name``.

    Raises
    ------
    SceneError
        As :func:`check_installed`.
    """
    check_installed(name, extra, why, where)
    return importlib.import_module(name)
