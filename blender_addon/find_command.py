# SPDX-License-Identifier: GPL-3.0-or-later
"""The command ``lippmann`` that is installed."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path


def find_command(preferred: str = "") -> str | None:
    """The program's path; None if it is not found.

    Parameters
    ----------
    preferred:
        What the preferences of the add-on say: a program, or a folder of a virtual environment. Empty: the search path,
        then the usual places of pipx, pip and uv.
    """
    if preferred:
        given = Path(preferred).expanduser()
        if given.is_dir():
            return next((str(path) for path in _programs_of(given) if _is_program(path)), None)
        return str(given) if _is_program(given) else shutil.which(preferred)
    on_path = shutil.which("lippmann")
    if on_path is not None:
        return on_path
    return next((str(path) for path in _usual_places() if _is_program(path)), None)


def _usual_places() -> list[Path]:
    home = Path.home()
    places = [home / ".local" / "bin" / _NAME]
    if sys.platform == "darwin":
        places += [Path("/opt/homebrew/bin") / _NAME, Path("/usr/local/bin") / _NAME]
        places += sorted((home / "Library" / "Python").glob(f"3.*/bin/{_NAME}"), reverse=True)
    if sys.platform == "win32":
        data = Path(os.environ.get("APPDATA", home))
        places += sorted((data / "Python").glob(f"Python3*/Scripts/{_NAME}"), reverse=True)
    return places


def _programs_of(folder: Path) -> list[Path]:
    return [folder / _NAME, folder / "bin" / _NAME, folder / "Scripts" / _NAME]


def _is_program(path: Path) -> bool:
    return path.is_file() and os.access(path, os.X_OK)


_NAME = "lippmann.exe" if sys.platform == "win32" else "lippmann"
