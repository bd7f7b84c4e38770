"""The list of the files of a folder that was written whole: what a later write may remove, and nothing else.

A list that anybody could write would let a downloaded folder say that the user's files may go. So each line carries an
authentication code, by a key that only this user's programs know, of the file's name and content: a file that was put
there, or changed since, is the user's.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import secrets
import sys
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from lippmann.runtime.private_files import FILE_MODE, ForeignFileError, open_to_read, without_following

#: Name of the list.
CONTENTS_FILE = ".lippmann-files"

_KEY_BYTES = 32
#: Bytes of a file that are read at a time.
_PART = 1 << 20


def write_list(folder: Path, names: Iterable[str]) -> None:
    """Write the list of files ``names``, by their paths in ``folder``; without a key nothing will count as listed."""
    key = _key()
    lines = [] if key is None else [f"{code} {name}\n" for name in names if (code := _code(key, folder, name))]
    (folder / CONTENTS_FILE).write_text("".join(lines), encoding="utf-8", errors="surrogateescape")


def listed(folder: Path) -> set[str]:
    """Files of ``folder`` that were written by this user's Lippmann and are as they were.

    None are if the list is a link or not the folder owner's.
    """
    key = _key()
    if key is None:
        return set()
    try:
        with open_to_read(folder / CONTENTS_FILE, owner=folder.stat().st_uid) as file:
            text = file.read().decode("utf-8", "surrogateescape")
    except (OSError, ForeignFileError):
        return set()
    entries = (line.partition(" ") for line in text.split("\n"))
    return {name for code, _, name in entries if name and hmac.compare_digest(_code(key, folder, name), code)}


def _code(key: bytes, folder: Path, name: str) -> str:
    """The authentication code of a file as it is; empty if there is none, or it is a link."""
    code = hashlib.blake2b(name.encode("utf-8", "surrogateescape") + b"\0", key=key, digest_size=32)
    try:
        with open(os.open(folder / name, os.O_RDONLY | without_following()), "rb") as file:
            while part := file.read(_PART):
                code.update(part)
    except (OSError, ValueError):
        return ""
    return code.hexdigest()


def _key() -> bytes | None:
    """The user's key, made where there is none; None where none can be kept."""
    try:
        path = _state_folder() / "key"
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists():
            _make_key(path)
        with open_to_read(path) as file:
            key: bytes = file.read()
    except (OSError, RuntimeError, ForeignFileError):
        return None
    return key if len(key) == _KEY_BYTES else None


def _make_key(path: Path) -> None:
    """Another process may do the same: whoever is first makes it, and whole."""
    whole = path.with_name(secrets.token_hex(8))
    flags = os.O_CREAT | os.O_EXCL | os.O_WRONLY | without_following()
    try:
        with open(os.open(whole, flags, FILE_MODE), "wb") as file:
            file.write(secrets.token_bytes(_KEY_BYTES))
        with suppress(FileExistsError):
            os.link(whole, path)
    finally:
        whole.unlink()


def _state_folder() -> Path:
    """Where the user's programs keep what is not for the user: as the system has it."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "lippmann"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support" / "lippmann"
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "lippmann"
