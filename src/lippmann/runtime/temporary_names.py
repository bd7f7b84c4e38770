"""Names of files and folders that are being written, beside what they will replace, and what killed writers left.

``.STEM-NUMBER.part.SUFFIX`` of a file, ``.NAME-NUMBER.part`` of a folder and ``.NAME-NUMBER.old`` of the folder that it
replaces. The number begins with the machine and the process that writes, so that the next writer of the same output can
tell what nobody will finish. Long names are cut, so that these are never too long.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import secrets
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from lippmann.printable import one_line
from lippmann.runtime import private_files

#: Bytes of a name that are kept.
_KEPT = 64

#: What names of files cannot hold.
_NOT_ON_DISK = dict.fromkeys(map(ord, '/\\:*?"<>|' if os.name == "nt" else "/"), "_")

#: The number, for patterns: machine, process, random digits; or what older versions wrote.
NUMBER = r"(?:[0-9a-f]{20}|[0-9a-f]{8})"


def temporary_file(place: Path) -> Path:
    """The temporary name of a file."""
    return place.with_name(f".{_cut(place.stem)}-{_number()}.part{place.suffix}")


def temporary_folder(place: Path) -> Path:
    """The temporary name of a folder."""
    return place.with_name(f".{_cut(place.name)}-{_number()}.part")


def pattern_of(place: Path) -> re.Pattern[str]:
    """Matches all temporary names of an output, with the number as the group ``number`` of files or ``other``."""
    file, folder = (re.escape(_cut(text)) for text in (place.stem, place.name))
    suffix = re.escape(place.suffix)
    return re.compile(rf"\.(?:{file}-(?P<number>{NUMBER})\.part{suffix}|{folder}-(?P<other>{NUMBER})\.(?:part|old))")


def sweep(place: Path) -> None:
    """Remove what writers of ``place`` left that ran on this machine and are no more; what other users left stays."""
    pattern = pattern_of(place)
    with suppress(OSError):  # a folder that cannot be listed keeps them
        for name in os.listdir(place.parent):
            match = pattern.fullmatch(name)
            if match and _is_dead(match["number"] or match["other"]):
                private_files.remove(place.with_name(name))


@contextmanager
def scratch_folder(prefix: str, above: str | None = None) -> Iterator[str]:
    """A new folder of this account alone, removed at the end; those that killed processes left there go before.

    Parameters
    ----------
    prefix:
        Beginning of its name, such as ``lippmann-dask-``.
    above:
        Where it lies; None for the system's temporary folder.

    Raises
    ------
    OSError
        If it cannot be created.
    """
    above = above or tempfile.gettempdir()
    with suppress(OSError):
        for name in os.listdir(above):
            if name.startswith(prefix) and _is_dead(name.removeprefix(prefix)[:20]):
                private_files.remove(Path(above, name))
    with tempfile.TemporaryDirectory(prefix=f"{prefix}{_number()}-", dir=above, ignore_cleanup_errors=True) as folder:
        yield folder


def _is_dead(number: str) -> bool:
    if not re.fullmatch("[0-9a-f]{20}", number) or not number.startswith(_machine()):
        return False
    import psutil

    return not psutil.pid_exists(int(number[4:12], 16))


def _number() -> str:
    return f"{_machine()}{os.getpid():08x}{secrets.token_hex(4)}"


@cache
def _machine() -> str:
    """Four digits of the machine: processes of others cannot be asked whether they run."""
    return hashlib.sha256(platform.node().encode()).hexdigest()[:4]


def disk_name(name: str, most: int) -> str:
    """A name of any origin as that of a file: whole if it can be, else without what file systems or terminals do not
    take, and of at most so many bytes."""
    return _cut(one_line(name.translate(_NOT_ON_DISK)), most)


def _cut(text: str, most: int = _KEPT) -> str:
    """The beginning of a name, of at most so many bytes."""
    while len(os.fsencode(text)) > most:
        text = text[:-1]
    return text
