"""Which of Mitsuba's plugins and tables scenes may name.

Mitsuba loads a plugin as a shared library, by a name that a scene gives, from the first of several folders that holds
it, the working directory among them. A library runs code as it is loaded: only those of the installed package may be.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from importlib.machinery import PathFinder
from pathlib import Path

from lippmann.errors import EngineError, SceneError

_PLAIN = re.compile(r"\w+", re.ASCII)
#: A conductor without a table: a perfect mirror.
_NO_MATERIAL = "none"


def is_plugin(name: str) -> bool:
    """Whether the installed Mitsuba has a plugin ``name``."""
    return name in _plugins()


def check_plugin(name: str, where: str) -> None:
    """Raise :class:`SceneError` if the installed Mitsuba has no plugin ``name``."""
    known = _plugins()
    if name not in known:
        rule = "scene files name plugins of the installed Mitsuba"
        raise SceneError.unknown("plugin", name, known, where=where, rule=rule)


def check_plugins_of(values: Mapping[str, object], where: str) -> None:
    """Raise :class:`SceneError` if a dictionary for ``mitsuba.load_dict`` names a plugin that lies elsewhere.

    Plugins that the caller has registered in this process have no library, and may be named.
    """
    stack: list[Mapping[str, object]] = [values]
    while stack:
        for key, value in stack.pop().items():
            if isinstance(value, Mapping):
                stack.append(value)
            elif key == "type" and isinstance(value, str) and value not in _plugins():
                _check_registered(value, where)


def check_material(name: str, where: str) -> None:
    """Raise :class:`SceneError` if Mitsuba has no table of refractive indices called ``name``."""
    known = _materials()
    if name != _NO_MATERIAL and name not in known:
        rule = "Mitsuba's own tables and 'none' are known"
        raise SceneError.unknown("material", name, known, where=where, rule=rule)


def _check_registered(name: str, where: str) -> None:
    places = [Path("plugins", name + ending) for ending in (".so", ".dylib", ".dll")]
    if not _PLAIN.fullmatch(name) or any(place.exists() for place in places):
        raise SceneError(
            f"plugin '{name[:80]}' would be loaded from outside the installed Mitsuba",
            where=where,
            rule="plugins come from the installed package, or are registered by the program",
        )


@cache
def _plugins() -> frozenset[str]:
    """Names of the package's plugins: shared libraries, and integrators written in Python."""
    libraries = (path.stem for path in (package_folder() / "plugins").iterdir())
    integrators = (path.stem for path in (package_folder() / "python" / "ad" / "integrators").glob("[a-z]*.py"))
    return frozenset((*libraries, *integrators, "scene"))


@cache
def _materials() -> frozenset[str]:
    tables = (package_folder() / "data" / "ior").glob("*.eta.spd")
    return frozenset(path.name.removesuffix(".eta.spd") for path in tables)


@cache
def package_folder() -> Path:
    """Folder of the installed Mitsuba, which is not loaded for this.

    Raises
    ------
    EngineError
        It is not installed.
    """
    spec = PathFinder.find_spec("mitsuba")  # Mitsuba's own entry in sys.modules has no spec once it is loaded
    if spec is None or not spec.origin:
        raise EngineError("Mitsuba is not installed", fix="install it: pip install --force-reinstall lippmann")
    return Path(spec.origin).parent
