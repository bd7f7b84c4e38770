"""Files that are read are plain ones: a pipe would be waited for, and a device may never end."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from lippmann.errors import LippmannError

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def other_kind(path: str | os.PathLike[str]) -> str | None:
    """What ``path`` is, wherever links lead, in place of a plain file; None for such a file, or for nothing at all.

    It is not opened: that alone would wait for whoever writes into a pipe.
    """
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):  # whoever opens it tells why
        return None
    return next((name for is_kind, name in _KINDS if is_kind(mode)), None)


def check_kind(path: Path, error: type[LippmannError]) -> None:
    """Raise ``error`` if ``path`` is a pipe, a device or a socket; of folders and missing files others tell."""
    kind = other_kind(path)
    if kind is not None and kind != "a folder":
        raise error(f"is {kind}, no file", where=str(path), fix="save it as a file first")
