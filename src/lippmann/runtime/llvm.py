"""Selection of an LLVM library for Dr.Jit, without loading any.

Dr.Jit compiles its CPU kernels with the first libLLVM that it finds. It refuses versions up to 14, and versions 15 and
16 crash the process during compilation (``Cannot select: fminimum``). This module selects a library by the version in
its file and passes its path to Dr.Jit.
"""

from __future__ import annotations

import functools
import os
import platform
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from lippmann.errors import EngineError
from lippmann.runtime.child_python import python_command

#: Environment variable with the path of Dr.Jit's library; users may set it to force one.
PATH_VARIABLE = "DRJIT_LIBLLVM_PATH"
#: The oldest major version that compiles all kernels.
OLDEST = 17
#: The newest major version that was tested; a newer one is used only if there is no other.
NEWEST_TRIED = 22

#: Version in the name of a library: libLLVM-19.so, libLLVM.so.19.1, libLLVM.19.1.dylib.
VERSION_IN_NAME = re.compile(r"libLLVM(?:-|\.so\.|\.)(\d+(?:\.\d+)*)")

_FILE_NAMES = {
    "darwin": re.compile(r"libLLVM([-.]\d[\w.]*)?\.dylib"),
    # The C interface alone: Windows' builds export nothing else by name.
    "win32": re.compile(r"LLVM-C\.dll", re.IGNORECASE),
}
_FILE_NAME = re.compile(r"libLLVM(-\d[\w.]*)?\.so(\.\d[\w.]*)?")


@dataclass(frozen=True)
class Library:
    """An LLVM library of the machine.

    Attributes
    ----------
    path:
        The file.
    version:
        Its version; empty if unknown.
    problem:
        Why it cannot be used; empty if it can.
    """

    path: Path
    version: tuple[int, ...] = ()
    problem: str = ""

    @property
    def version_text(self) -> str:
        return ".".join(str(part) for part in self.version) or "of unknown version"


def install_command() -> str:
    """Command that installs a suitable LLVM library on this system, or a sentence where none is known."""
    from lippmann.runtime.llvm_install import remedy

    return remedy(OLDEST, NEWEST_TRIED).text


def choose() -> Library:
    """Select the LLVM library: that of ``DRJIT_LIBLLVM_PATH``, else the newest usable one of the machine.

    The call takes a few milliseconds and loads no library.

    Raises
    ------
    EngineError
        If the library of the variable cannot be used, or there is no usable one.
    """
    named = os.environ.get(PATH_VARIABLE)
    if named:
        return _find_named(named)
    libraries: list[Library] = []
    # The system's list of libraries comes last: it takes a child process, and the folders usually suffice.
    for files in (files_in(search_folders()), listed_files()):
        libraries += [inspect(path) for path in files]
        usable = [library for library in libraries if not library.problem]
        if usable:
            return max(usable, key=_rank)
    raise EngineError(
        f"no usable LLVM library is installed{_unusable(libraries)}",
        rule=f"rendering on the CPU needs LLVM {OLDEST} or newer",
        fix=f"install it: {install_command()}",
    )


def installed() -> list[Library]:
    """All LLVM libraries of the machine, the best first; those that cannot be used state their ``problem``."""
    paths = dict.fromkeys((*files_in(search_folders()), *listed_files()))
    libraries = [inspect(path) for path in paths]
    return sorted(libraries, key=lambda library: (not library.problem, _rank(library)), reverse=True)


@functools.cache
def inspect(path: Path) -> Library:
    """Version and usability of a library file, without loading it into this process."""
    if path.is_dir():
        return Library(path, problem="is a folder, not a library")
    try:
        with path.open("rb") as file:
            kind = kind_of(file.read(20))
    except FileNotFoundError:
        return Library(path, problem="not found")
    except OSError as error:
        return Library(path, problem=f"cannot be read ({error.strerror})")
    if sys.platform.startswith("linux") and kind != elf_head():
        return Library(path, problem="is not a shared library for this processor")
    # The library is asked for the version that its name does not give.
    match = VERSION_IN_NAME.match(path.name)
    version = tuple(int(part) for part in match[1].split(".")) if match else _ask(path)
    if not version:
        return Library(path, problem="is not an LLVM library, or cannot be loaded")
    if version[0] < OLDEST:
        return Library(path, version, f"is LLVM {version[0]}, which is too old")
    return Library(path, version)


def search_folders() -> list[Path]:
    """Folders in which LLVM libraries are usually installed, each once."""
    return Host().folders()


def files_in(folders: Iterable[Path]) -> Iterator[Path]:
    """Files in ``folders`` with the name of an LLVM library, each once after resolving links."""
    resolved, host = set(), Host()
    for folder in folders:
        try:
            names = sorted(name for name in os.listdir(folder) if host.is_library(name))
        except OSError:
            continue
        for name in names:
            real = (folder / name).resolve()
            if real not in resolved and real.is_file():
                resolved.add(real)
                yield real


def listed_files() -> Iterator[Path]:
    """LLVM libraries of the system's list (``ldconfig``), which includes configured folders."""
    if not sys.platform.startswith("linux"):
        return
    for command in ("/sbin/ldconfig", "ldconfig"):
        try:
            run = subprocess.run([command, "-p"], capture_output=True, text=True, timeout=10, check=False)
        except (OSError, subprocess.SubprocessError):
            continue
        places = (line.partition("=>")[2].strip() for line in run.stdout.splitlines())
        host = Host()
        yield from {Path(p).resolve(): None for p in places if host.is_library(os.path.basename(p))}
        return


def _find_named(name: str) -> Library:
    path: Path | None = Path(name).absolute()
    if not {os.sep, os.altsep} & set(name):
        # The dynamic loader looks such a name up in its folders, never in the current one.
        path = next((folder / name for folder in search_folders() if (folder / name).is_file()), None)
    library = inspect(path) if path else Library(Path(name), problem="not found")
    if library.problem:
        raise EngineError(
            f"'{name}' {library.problem}",
            where=PATH_VARIABLE,
            rule=f"it has to name an LLVM library of version {OLDEST} or newer",
            fix=f"unset it, or correct it; to install a library: {install_command()}",
        )
    return library


def _rank(library: Library) -> tuple[bool, tuple[int, ...]]:
    """Sort key: the newest tested version is highest; of untested ones the oldest."""
    if library.version and library.version[0] > NEWEST_TRIED:
        return False, tuple(-part for part in library.version)
    return True, library.version


def _unusable(libraries: list[Library]) -> str:
    if not libraries:
        return ""
    versions = sorted({library.version_text for library in libraries if library.version})
    return f" (found only {', '.join(versions)})" if versions else f" ('{libraries[0].path}' {libraries[0].problem})"


def _ask(path: Path) -> tuple[int, ...]:
    """The version that the library reports, in a child process, which it may crash; empty if it fails."""
    code = (
        "import ctypes, sys; n = [ctypes.c_uint() for _ in range(3)];"
        "ctypes.CDLL(sys.argv[1]).LLVMGetVersion(*map(ctypes.byref, n)); print(*(v.value for v in n))"
    )
    command, environment = python_command(code, str(path))
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False, env=environment)
    except (OSError, subprocess.SubprocessError):
        return ()
    parts = run.stdout.split()
    return tuple(int(part) for part in parts) if run.returncode == 0 and len(parts) == 3 else ()


@functools.cache
def elf_head() -> tuple[bytes, bytes]:
    """Kind of the ELF file and code of the processor, of the running Python and all libraries that go with it."""
    with Path(sys.executable).open("rb") as file:
        return kind_of(file.read(20))


def kind_of(head: bytes) -> tuple[bytes, bytes]:
    """Kind and processor in the first 20 bytes of an ELF file."""
    return head[:6], head[18:20]


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
