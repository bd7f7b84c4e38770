"""OpenVDB's own Python module, which no package of PyPI brings: conda-forge, Debian and Blender do."""

from __future__ import annotations

import importlib.util

#: The module's names, the newer one first.
_NAMES = ("openvdb", "pyopenvdb")


def module_name() -> str | None:
    """Name of the module that is installed; None without one."""
    return next((name for name in _NAMES if importlib.util.find_spec(name) is not None), None)
