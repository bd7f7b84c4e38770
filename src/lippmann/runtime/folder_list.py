"""The list of the files of a folder that was written whole: what a later write may remove, and nothing else.

Each line carries a check sum of a file's name and content: what was put there, or changed since, is the user's.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path

#: Name of the list.
CONTENTS_FILE = ".lippmann-files"

#: Bytes of a file that are read at a time.
_PART = 1 << 20


def write_list(folder: Path, names: Iterable[str]) -> None:
    """Write the list of files ``names``, by their paths in ``folder``."""
    lines = [f"{total} {name}\n" for name in names if (total := _sum(folder, name))]
    (folder / CONTENTS_FILE).write_text("".join(lines), encoding="utf-8", errors="surrogateescape")


def read_list(folder: Path) -> set[str]:
    """Files of ``folder`` that are listed there and as they were."""
    path = folder / CONTENTS_FILE
    try:
        text = path.read_bytes().decode("utf-8", "surrogateescape") if path.is_file() else ""
    except OSError:
        return set()
    entries = (line.partition(" ") for line in text.split("\n"))
    return {name for total, _, name in entries if name and _sum(folder, name) == total}


def _sum(folder: Path, name: str) -> str:
    """The check sum of a file as it is; empty if there is none, or it is a link."""
    path = folder / name
    total = hashlib.blake2b(name.encode("utf-8", "surrogateescape") + b"\0", digest_size=32)
    try:
        if path.is_symlink() or not path.is_file():
            return ""
        with path.open("rb") as file:
            while part := file.read(_PART):
                total.update(part)
    except (OSError, ValueError):
        return ""
    return total.hexdigest()
