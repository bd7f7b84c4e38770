"""Folders as one input: each file behind a line with its name.

A file that begins with :data:`LINK` becomes a link to what follows, one that is :data:`PIPE` a pipe that nobody writes
into.
"""

from __future__ import annotations

import os
import re
from itertools import zip_longest
from pathlib import Path

LINK, PIPE = b"<link>", b"<pipe>"
_HEAD = re.compile(rb"^=== ([A-Za-z0-9_.-]{1,60}(?:/[A-Za-z0-9_.-]{1,60}){0,5})\n", re.M)


def packed(folder: Path) -> bytes:
    """All files of a folder, by name."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return b"".join(b"=== %s\n%s\n" % (str(path.relative_to(folder)).encode(), path.read_bytes()) for path in files)


def unpack(data: bytes, folder: Path) -> None:
    """Write the files into ``folder``; what a file system cannot hold, and what would lie outside, is left out."""
    heads = list(_HEAD.finditer(data))
    made = {folder}
    for head, after in zip_longest(heads, heads[1:]):
        path = folder / head[1].decode("ascii")
        if ".." in path.parts:
            continue
        end = len(data) if after is None else after.start()
        try:
            if path.parent not in made:
                path.parent.mkdir(parents=True, exist_ok=True)
                made.add(path.parent)
            _make(path, data[head.end() : end].removesuffix(b"\n"))
        except (OSError, ValueError):  # a file where a folder should be, or the other way round
            continue


def _make(path: Path, content: bytes) -> None:
    if content.startswith(LINK):
        # Inside the folder, or to nothing at all: what an input leads to must not depend on the machine.
        os.symlink(content.removeprefix(LINK).lstrip(b"/").replace(b"..", b"")[:80] or b"nothing", path)
    elif content == PIPE:
        os.mkfifo(path)
    else:
        path.write_bytes(content)
