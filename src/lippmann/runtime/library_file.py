"""Places where LLVM's libraries may lie, and the facts in the head and the name of such a file."""

from __future__ import annotations

import functools
import os
import platform
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path


@functools.cache
def elf_head(program: Path = Path(sys.executable)) -> tuple[bytes, bytes]:
    """Of a program of Linux, and of all libraries that go with it: kind of the ELF file, and code of the processor."""
    with program.open("rb") as file:
        return kind_of(file.read(20))


def kind_of(head: bytes) -> tuple[bytes, bytes]:
    """Kind and processor in the first 20 bytes of an ELF file."""
    return head[:6], head[18:20]


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
        folders = [self.at(entry) for entry in self._loader_path()]
        inside = "Library/bin" if self.system == "win32" else "lib"
        homes = [self.prefix, self.environment.get("CONDA_PREFIX", "")]
        folders += [self.at(home) / inside for home in homes if home]
        folders += {"darwin": self._mac, "win32": self._windows}.get(self.system, self._linux)()
        return list(dict.fromkeys(folders))

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
        folders = [self.at(name) for name in fixed]
        for folder, pattern in (
            ("/usr/lib", "llvm*/lib"),
            ("/usr/lib", "llvm/*/lib*"),
            ("/usr/lib64", "llvm*/lib*"),
            ("/usr/local", "llvm*/lib"),
            ("/opt", "llvm*/lib"),
        ):
            folders += self._glob(folder, pattern)
        brew = self.environment.get("HOMEBREW_PREFIX")
        return folders + (self._glob(f"{brew}/opt", "llvm*/lib") if brew else [])

    def _mac(self) -> list[Path]:
        own = self.environment.get("HOMEBREW_PREFIX")
        usual = ["/opt/homebrew", "/usr/local"]  # Apple silicon, Intel; a library of the other processor is refused
        folders = []
        for prefix in dict.fromkeys([own, *usual] if own else usual):
            folders += self._glob(f"{prefix}/opt", "llvm*/lib")
        folders += self._glob("/opt/local/libexec", "llvm-*/lib")
        return [*folders, self.at("/opt/local/lib"), self.at("/usr/local/lib")]

    def _windows(self) -> list[Path]:
        folders = []
        for variable, inside in (
            ("ProgramW6432", "LLVM/bin"),
            ("ProgramFiles", "LLVM/bin"),
            ("LOCALAPPDATA", "Programs/LLVM/bin"),
            ("USERPROFILE", "scoop/apps/llvm/current/bin"),
            ("ProgramData", "scoop/apps/llvm/current/bin"),
        ):
            if self.environment.get(variable):
                folders.append(self.at(self.environment[variable]) / inside)
        return folders
