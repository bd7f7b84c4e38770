"""Folders as one input: each file behind a line with its name."""

from __future__ import annotations

import re
from itertools import zip_longest
from pathlib import Path

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
            path.write_bytes(data[head.end() : end].removesuffix(b"\n"))
        except OSError:  # a file where a folder should be, or the other way round
            continue
