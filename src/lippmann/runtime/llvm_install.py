"""How an LLVM library is installed on this system: the command, and whether it may be run without asking.

A package manager that writes into the user's own folders (conda, Homebrew) is run. One that needs more rights (apt,
dnf, winget) is run only by a process that has them; else the user gets the command.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

#: LLVM version that is asked for by number.
VERSION = 19

#: Package managers of Linux that name their LLVM runtime without a choice, and their arguments.
_LINUX: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("dnf", ("install", "--assumeyes", "llvm-libs")),
    ("pacman", ("-S", "--noconfirm", "llvm-libs")),
    ("zypper", ("--non-interactive", "install", f"libLLVM{VERSION}")),
    ("apk", ("add", f"llvm{VERSION}-libs")),
)


@dataclass(frozen=True)
class Remedy:
    """A way to install an LLVM library.

    Attributes
    ----------
    command:
        The words of the command; empty if no package manager is known.
    text:
        The command as the user types it, or a sentence.
    obstacle:
        Why this process may not run it; empty if it may.
    """

    command: tuple[str, ...]
    text: str
    obstacle: str = ""


@dataclass(frozen=True)
class Machine:
    """The facts of a machine on which a remedy depends.

    Attributes
    ----------
    system:
        ``sys.platform``.
    prefix:
        Root of the running Python's environment.
    environment:
        Environment variables.
    find:
        The path of a program by its name; None if it is not installed.
    is_root:
        Whether this process may change the system.
    apt_packages:
        The names of apt's packages that begin with ``libllvm``.
    """

    system: str = sys.platform
    prefix: Path = Path(sys.prefix)
    environment: Mapping[str, str] = field(default_factory=lambda: os.environ)
    find: Callable[[str], str | None] = lambda name: _which(name)
    is_root: bool = field(default_factory=lambda: _is_root())
    apt_packages: Callable[[], list[str]] = lambda: _apt_packages()


def remedy(oldest: int, newest: int, machine: Machine | None = None) -> Remedy:
    """The command that installs a library on this system.

    Parameters
    ----------
    oldest, newest:
        The major versions that serve.
    machine:
        By default this one.
    """
    machine = machine or Machine()
    conda = _conda(machine)
    if conda is not None:
        return conda
    if machine.system == "darwin":
        brew = machine.find("brew")
        where = "" if brew else "Homebrew is not installed; https://brew.sh tells how"
        return Remedy((brew or "brew", "install", "llvm"), "brew install llvm", where)
    if machine.system == "win32":
        winget = ("install", "--exact", "--id", "LLVM.LLVM")
        return _of_system("winget", winget, machine, as_root="", missing="winget is not installed")
    if machine.find("apt-get"):
        package = _newest_apt_package(machine.apt_packages(), oldest, newest) or f"libllvm{VERSION}"
        return _of_system("apt-get", ("install", package), machine, run=("install", "--yes", package))
    for name, arguments in _LINUX:
        if machine.find(name):
            return _of_system(name, arguments, machine)
    sentence = f"install the LLVM runtime library, version {oldest} or newer"
    return Remedy((), sentence, "no package manager is known here")


def run(remedy: Remedy) -> str:
    """Run a remedy's command, its output on standard error; the reason why it failed, empty if it did not."""
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive", "HOMEBREW_NO_ASK": "1"}
    try:
        done = subprocess.run(remedy.command, stdin=subprocess.DEVNULL, stdout=2, check=False, env=environment)
    except OSError as error:
        return f"{remedy.command[0]} cannot be started ({error.strerror or error})"
    return f"{Path(remedy.command[0]).name} ended with exit code {done.returncode}" if done.returncode else ""


def _apt_packages() -> list[str]:
    try:
        answer = subprocess.run(
            ["apt-cache", "pkgnames", "libllvm"], capture_output=True, text=True, timeout=60, check=False
        )
    except (OSError, subprocess.SubprocessError):
        return []
    return answer.stdout.split()


def _newest_apt_package(names: list[str], oldest: int, newest: int) -> str | None:
    matches = [match for name in names if (match := re.fullmatch(r"libllvm(\d+)(t64)?", name))]
    usable = [(int(match[1]), match[0]) for match in matches if oldest <= int(match[1]) <= newest]
    return max(usable)[1] if usable else None


def _of_system(
    name: str,
    words: tuple[str, ...],
    machine: Machine,
    *,
    run: tuple[str, ...] | None = None,
    as_root: str = "sudo ",
    missing: str = "",
) -> Remedy:
    path = machine.find(name)
    obstacle = missing if path is None else "" if machine.is_root else "it needs the rights of an administrator"
    plain_words = [word for word in words if word not in ("--assumeyes", "--noconfirm", "--non-interactive")]
    return Remedy((path or name, *(run or words)), f"{as_root}{name} {' '.join(plain_words)}", obstacle)


def _conda(machine: Machine) -> Remedy | None:
    """conda-forge's package, where the running Python lies in a conda environment."""
    if not (machine.prefix / "conda-meta").is_dir():
        return None
    package = f"libllvm-c{VERSION}" if machine.system == "win32" else f"libllvm{VERSION}"
    words = ("install", "--yes", "--prefix", str(machine.prefix), "--channel", "conda-forge", package)
    named = machine.environment.get("CONDA_EXE") or machine.environment.get("MAMBA_EXE")
    tool = next((path for path in (named, *map(machine.find, ("mamba", "conda", "micromamba"))) if path), None)
    text = f"{Path(tool).stem if tool else 'conda'} install --channel conda-forge {package}"
    if machine.environment.get("PIXI_PROJECT_MANIFEST"):
        pixi = machine.find("pixi")
        obstacle = "" if pixi else "pixi is not on the path"
        return Remedy((pixi or "pixi", "add", package), f"pixi add {package}", obstacle)
    return Remedy((tool or "conda", *words), text, "" if tool else "conda is not on the path")


def _which(name: str) -> str | None:
    """A program on the path; never one of the working directory, which Windows searches first."""
    path = shutil.which(name)
    return path if path and Path(path).is_absolute() else None


def _is_root() -> bool:
    if sys.platform == "win32":
        import ctypes

        return bool(ctypes.windll.shell32.IsUserAnAdmin())
    return os.geteuid() == 0
