"""OpenVDB's own Python module, which is no package of PyPI; conda-forge, Debian and Blender's wheel have it."""

from __future__ import annotations

import importlib.util
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path

#: The module's names, the newer one first.
_NAMES = ("openvdb", "pyopenvdb")

#: Folders in which Blender's Python module ``bpy`` keeps other libraries' modules: on Windows, and elsewhere.
_BUNDLED = ("*/python/lib/site-packages", "*/python/lib/python3.*/site-packages")


def find_module() -> ModuleSpec | None:
    """The module that is installed, else that inside ``bpy``, which is not imported for it; None without one."""
    for name in _NAMES:
        spec = importlib.util.find_spec(name)
        if spec is not None:
            return spec
    blender = importlib.util.find_spec("bpy")
    if blender is None or blender.origin is None:
        return None
    root = Path(blender.origin).parent
    folders = [str(folder) for pattern in _BUNDLED for folder in root.glob(pattern)]
    return next((spec for name in _NAMES if (spec := PathFinder.find_spec(name, folders)) is not None), None)
