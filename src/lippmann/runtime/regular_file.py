"""Files that are read are plain ones: a pipe would be waited for, a device may never end, a pointer holds nothing."""

from __future__ import annotations

import difflib
import os
import stat
from collections.abc import Collection
from pathlib import Path

from lippmann.errors import LippmannError, PictureError

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)

#: First bytes of a pointer that Git Large File Storage left in a file's place, and a pointer's largest size in bytes.
_LFS_POINTER, _LFS_MOST = b"version https://git-lfs.github.com/spec/", 1024


def other_kind(path: str | os.PathLike[str]) -> str | None:
    """The kind of ``path``, wherever links lead, if it is no plain file; None for a plain file, or for nothing at all.

    It is not opened: that alone would wait for whoever writes into a pipe.
    """
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):  # whoever opens it tells why
        return None
    return next((name for is_kind, name in _KINDS if is_kind(mode)), None)


def check_kind(path: Path, error: type[LippmannError]) -> None:
    """Raise ``error`` for a pipe, device, socket or pointer of Git LFS; others tell of folders and missing files."""
    kind = other_kind(path)
    if kind is not None and kind != "a folder":
        raise error(f"is {kind}, no file", where=str(path), fix="save it as a file first")
    if kind is None and _is_lfs_pointer(path):
        raise error("is only a pointer of Git LFS", where=str(path), fix="fetch the file itself: git lfs pull")


def unreadable(path: Path, reason: OSError, error: type[LippmannError], rule: str = "") -> LippmannError:
    """The ``error`` of a file that ``reason`` kept from being opened; of a missing one, with the likely one."""
    if path.parts[:1] in (("http:",), ("https:",)):  # one of the two slashes is gone
        address = "//".join(path.as_posix().split("/", 1))
        return error("is an address", where=address, rule=rule or "files are read", fix="download it first")
    if isinstance(reason, (FileNotFoundError, NotADirectoryError)):
        return error("no such file", where=str(path), rule=rule, fix=near_miss(path))
    if isinstance(reason, IsADirectoryError):
        folders = ": 'lippmann weave', 'quilt pack' and 'import' take folders of views" if error is PictureError else ""
        return error("is a folder, no file", where=str(path), rule=rule, fix=f"name a file in it{folders}")
    return error(f"cannot be read ({reason.strerror or reason})", where=str(path), rule=rule)


def near_miss(path: Path, foreign: Collection[str] = (), folder: str = "") -> str:
    """A hint at the file that was meant, in another case or with a slip of the pen; empty if there is none.

    Files with endings among ``foreign`` are not meant. ``folder`` is what a folder that does not exist is called.
    """
    try:
        entries = [Path(entry.name) for entry in path.parent.iterdir() if entry.is_file()]
        names = sorted(entry.name for entry in entries if entry.suffix.lower() not in foreign)
    except OSError:
        return f"there is no folder '{folder or path.parent}'"
    folded = {name.casefold(): name for name in names}
    stem, stems = path.stem.casefold(), {Path(name).stem: name for name in folded}
    # Another ending, or more behind, as in teapot_qs8x6a0.75.png, before a slip of the pen.
    longer = [name for name in folded if name.startswith(stem) and not name[len(stem) :][:1].isalnum()]
    close = difflib.get_close_matches(path.name.casefold(), longer, n=1, cutoff=0.0)
    close = close or [stems[each] for each in difflib.get_close_matches(stem, stems, n=1, cutoff=0.75)]
    return f"is '{folded[close[0]]}' meant?" if close else ""


def read_small_text(path: Path, most: int, error: type[LippmannError], rule: str) -> str:
    """The UTF-8 text of a file of at most ``most`` bytes; raises ``error`` with ``rule`` for any other."""
    check_kind(path, error)
    try:
        with path.open("rb") as file:
            content = file.read(most + 1)
        if len(content) > most:
            raise error("this file is too large", where=str(path), rule=rule)
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise error("this is not a text file", where=str(path), rule=rule) from None
    except OSError as reason:
        raise unreadable(path, reason, error, rule) from None


def _is_lfs_pointer(path: Path) -> bool:
    try:
        if path.stat().st_size > _LFS_MOST:
            return False
        with path.open("rb") as file:
            return file.read(len(_LFS_POINTER)) == _LFS_POINTER
    except (OSError, ValueError):
        return False
