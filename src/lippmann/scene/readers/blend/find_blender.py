"""The Blender that is installed: a program, or the Python module ``bpy``."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from lippmann.errors import SceneError

#: Environment variable that names the program.
VARIABLE = "LIPPMANN_BLENDER"
#: The oldest version that is used, a release with long-term support.
OLDEST = (4, 2)

_VERSION = re.compile(r"^Blender (\d{1,3})\.(\d{1,3})", re.MULTILINE)
#: Seconds that a program has to tell its version; its first start may be slow.
_VERSION_SECONDS = 60.0

_FIX = "install Blender from blender.org, or export the scene in Blender by File > Export > glTF 2.0 (.glb)"


def find_blender(where: str) -> str | None:
    """The program's path; None where the module ``bpy`` is there in its place.

    :data:`VARIABLE` comes first, then the search path, then the usual places.

    Parameters
    ----------
    where:
        The file that it is for.

    Raises
    ------
    SceneError
        There is no Blender, or none of version :data:`OLDEST` or newer.
    """
    named = os.environ.get(VARIABLE)
    if named:
        version = blender_version(named)
        if version is None:
            raise SceneError(f"{VARIABLE} is '{named}', which is no Blender", where=where, fix="name its program there")
        if version < OLDEST:
            raise _too_old(version, where)
        return named
    newest = None
    for program in _candidates():
        version = blender_version(program)
        if version is not None and version >= OLDEST:
            return program
        newest = max(filter(None, (newest, version)), default=None)
    if _has_module():
        return None
    if newest is not None:
        raise _too_old(newest, where)
    raise SceneError("needs Blender, which is not found", where=where, rule=f"{VARIABLE} may name it", fix=_FIX)


def blender_version(program: str) -> tuple[int, int] | None:
    """Major and minor version that a program tells; None of what is no Blender."""
    try:
        status = Path(program).stat()
    except OSError:
        return None
    return _version_from_process(program, status.st_mtime_ns)


@lru_cache(maxsize=32)
def _version_from_process(program: str, _: int) -> tuple[int, int] | None:
    try:
        output = subprocess.run(
            [program, "--version"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=_VERSION_SECONDS,
        ).stdout
    except (OSError, subprocess.TimeoutExpired):
        return None
    match = _VERSION.search(output[:4096].decode(errors="replace"))
    return None if match is None else (int(match[1]), int(match[2]))


def _candidates() -> Iterator[str]:
    on_path = shutil.which("blender")
    if on_path is not None:
        yield on_path
    yield from _usual_places()


def _usual_places() -> Iterator[str]:
    if sys.platform == "darwin":
        for folder in (Path("/Applications"), Path.home() / "Applications"):
            yield str(folder / "Blender.app" / "Contents" / "MacOS" / "Blender")
    elif sys.platform == "win32":
        folders = Path(os.environ.get("PROGRAMFILES", r"C:\Program Files"), "Blender Foundation").glob("Blender *")
        for folder in sorted(folders, key=_number, reverse=True):
            yield str(folder / "blender.exe")
    else:
        yield "/snap/bin/blender"


def _has_module() -> bool:
    return importlib.util.find_spec("bpy") is not None


def _number(folder: Path) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", folder.name))


def _too_old(version: tuple[int, int], where: str) -> SceneError:
    rule = f"{OLDEST[0]}.{OLDEST[1]} or newer is needed"
    return SceneError(f"Blender {version[0]}.{version[1]} is too old", where=where, rule=rule, fix=_FIX)
