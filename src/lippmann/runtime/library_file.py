"""What a shared library of Linux calls itself, read from its ELF file without loading it; and where LLVM may lie.

Source of the format: System V ABI, "Object Files" and "Dynamic Linking".
"""

from __future__ import annotations

import functools
import os
import platform
import re
import struct
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

# ELF: kinds of segments (PT_LOAD, PT_DYNAMIC) and of entries of the dynamic section (DT_STRTAB, DT_SONAME).
_LOADED_SEGMENT, _DYNAMIC_SEGMENT = 1, 2
_STRINGS_ENTRY, _NAME_ENTRY = 5, 14

_Read = Callable[[int, int], bytes]


def elf_name(path: Path, python: Path | None = None) -> str:
    """The name that the linker gave a library (``SONAME``), else that of its file.

    Parameters
    ----------
    path:
        The file.
    python:
        The program that is to load the library; by default the running one.

    Raises
    ------
    ValueError, struct.error
        If the file is no 64-bit shared library for this processor, or a damaged one.
    OSError
        If a file cannot be read.
    """
    python = Path(sys.executable) if python is None else python
    with path.open("rb") as file:
        length = os.fstat(file.fileno()).st_size

        def read(offset: int, size: int) -> bytes:
            if offset + size > length:
                raise ValueError("the file is cut off")
            file.seek(offset)
            return file.read(size)

        return _elf_name(read, path, length, python)


def _elf_name(read: _Read, path: Path, length: int, python: Path) -> str:
    head = read(0, 64)
    if head[:6] != b"\x7fELF\x02\x01" or head[18:20] != elf_machine(python):
        raise ValueError("not a 64-bit little-endian library for this processor")
    table, size, count = *struct.unpack_from("<Q", head, 32), *struct.unpack_from("<HH", head, 54)
    segments = [struct.unpack("<IIQQQQQQ", read(table + size * i, 56)) for i in range(count)]
    dynamic = next((s for s in segments if s[0] == _DYNAMIC_SEGMENT), None)
    if dynamic is None:
        raise ValueError("not a shared library")
    entries = dict(reversed(list(struct.iter_unpack("<QQ", read(dynamic[2], dynamic[5])))))  # the first one counts
    if _NAME_ENTRY not in entries:
        return path.name
    address = entries.get(_STRINGS_ENTRY, 0) + entries[_NAME_ENTRY]
    load = next((s for s in segments if s[0] == _LOADED_SEGMENT and s[3] <= address < s[3] + s[5]), None)
    if load is None:
        raise ValueError("the name lies outside the file")
    start = address - load[3] + load[2]
    return _text(read(start, min(256, length - start)))


def _text(data: bytes) -> str:
    name, end, _ = data.partition(b"\0")
    if not end:
        raise ValueError("the name is cut off")
    return name.decode("ascii")


@functools.cache
def elf_machine(python: Path) -> bytes:
    """Two bytes: the machine code of a program's processor in ELF files."""
    with python.open("rb") as file:
        return file.read(20)[18:]


#: Version in the name of a library: libLLVM-19.so, libLLVM.so.19.1, libLLVM.19.1.dylib.
VERSION_IN_NAME = re.compile(r"libLLVM(?:-|\.so\.|\.)(\d+(?:\.\d+)*)")

_FILE_NAMES = {
    "darwin": re.compile(r"libLLVM([-.]\d[\w.]*)?\.dylib"),
    # The C interface alone: Windows' builds export nothing else by name.
    "win32": re.compile(r"LLVM-C\.dll", re.IGNORECASE),
}
_FILE_NAME = re.compile(r"libLLVM(-\d[\w.]*)?\.so(\.\d[\w.]*)?")


@dataclass(frozen=True)
class Host:
    """The machine that libraries are looked for on.

    Attributes
    ----------
    system, processor:
        ``sys.platform`` and ``platform.machine()``.
    prefix:
        Root of the running Python's environment.
    environment:
        Environment variables.
    root:
        Where absolute paths begin; another folder than ``/`` in tests.
    """

    system: str = sys.platform
    processor: str = field(default_factory=platform.machine)
    prefix: str = sys.prefix
    environment: Mapping[str, str] = field(default_factory=lambda: os.environ)
    root: Path = Path("/")

    def is_library(self, name: str) -> bool:
        """Whether a file's name is that of an LLVM library with the C interface."""
        return _FILE_NAMES.get(self.system, _FILE_NAME).fullmatch(name) is not None

    def folders(self) -> list[Path]:
        """Folders in which LLVM libraries are usually installed, each once, the nearest to the user first."""
        found = [self.at(entry) for entry in self._loader_path()]
        inside = "Library/bin" if self.system == "win32" else "lib"
        homes = [self.prefix, self.environment.get("CONDA_PREFIX", "")]
        found += [self.at(home) / inside for home in homes if home]
        found += {"darwin": self._mac, "win32": self._windows}.get(self.system, self._linux)()
        return list(dict.fromkeys(found))

    def at(self, path: str) -> Path:
        """``path`` below :attr:`root`."""
        return (
            Path(path) if self.root == Path("/") else self.root / path.replace("\\", "/").lstrip("/").replace(":", "")
        )

    def _glob(self, folder: str, pattern: str) -> list[Path]:
        return sorted(self.at(folder).glob(pattern))

    def _loader_path(self) -> list[str]:
        variable = {"darwin": "DYLD_LIBRARY_PATH", "win32": "PATH"}.get(self.system, "LD_LIBRARY_PATH")
        separator = ";" if self.system == "win32" else ":"
        entries = [entry for entry in self.environment.get(variable, "").split(separator) if entry]
        # PATH has entries relative to the working directory where the user did not mean a library.
        return [entry for entry in entries if self.system != "win32" or re.match(r"[A-Za-z]:[\\/]|[\\/]{2}", entry)]

    def _linux(self) -> list[Path]:
        fixed = [f"/usr/lib/{self.processor}-linux-gnu", "/usr/lib64", "/usr/lib", "/usr/local/lib", "/usr/local/lib64"]
        found = [self.at(name) for name in fixed]
        for folder, pattern in (
            ("/usr/lib", "llvm*/lib"),
            ("/usr/lib", "llvm/*/lib*"),
            ("/usr/lib64", "llvm*/lib*"),
            ("/usr/local", "llvm*/lib"),
            ("/opt", "llvm*/lib"),
        ):
            found += self._glob(folder, pattern)
        brew = self.environment.get("HOMEBREW_PREFIX")
        return found + (self._glob(f"{brew}/opt", "llvm*/lib") if brew else [])

    def _mac(self) -> list[Path]:
        own = self.environment.get("HOMEBREW_PREFIX")
        usual = ["/opt/homebrew", "/usr/local"]  # Apple silicon, Intel; a library of the other processor is refused
        found = []
        for prefix in dict.fromkeys([own, *usual] if own else usual):
            found += self._glob(f"{prefix}/opt", "llvm*/lib")
        found += self._glob("/opt/local/libexec", "llvm-*/lib")
        return [*found, self.at("/opt/local/lib"), self.at("/usr/local/lib")]

    def _windows(self) -> list[Path]:
        found = []
        for variable, inside in (
            ("ProgramW6432", "LLVM/bin"),
            ("ProgramFiles", "LLVM/bin"),
            ("LOCALAPPDATA", "Programs/LLVM/bin"),
            ("USERPROFILE", "scoop/apps/llvm/current/bin"),
            ("ProgramData", "scoop/apps/llvm/current/bin"),
        ):
            if self.environment.get(variable):
                found.append(self.at(self.environment[variable]) / inside)
        return found
