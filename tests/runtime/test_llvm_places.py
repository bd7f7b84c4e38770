"""Where package managers put LLVM, and the version in a library's name."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.runtime import llvm
from lippmann.runtime.llvm import VERSION_IN_NAME, Host

#: System, processor, Python's prefix, environment, where the library lies.
LAYOUTS = {
    "Debian": ("linux", "x86_64", "/venv", {}, "/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1"),
    "Debian on ARM": ("linux", "aarch64", "/venv", {}, "/usr/lib/aarch64-linux-gnu/libLLVM.so.19.1"),
    "apt.llvm.org": ("linux", "x86_64", "/venv", {}, "/usr/lib/llvm-20/lib/libLLVM.so.20.1"),
    "Fedora": ("linux", "x86_64", "/venv", {}, "/usr/lib64/libLLVM.so.21.1"),
    "conda on Linux": ("linux", "x86_64", "/conda/envs/a", {}, "/conda/envs/a/lib/libLLVM-19.so"),
    "a venv in conda": ("linux", "x86_64", "/venv", {"CONDA_PREFIX": "/conda"}, "/conda/lib/libLLVM.so.19.1"),
    "Homebrew on Linux": ("linux", "x86_64", "/venv", {"HOMEBREW_PREFIX": "/brew"}, "/brew/opt/llvm/lib/libLLVM.so"),
    "the loader's path": ("linux", "x86_64", "/venv", {"LD_LIBRARY_PATH": "/a:/mine"}, "/mine/libLLVM-18.so"),
    "Homebrew, Apple silicon": ("darwin", "arm64", "/venv", {}, "/opt/homebrew/opt/llvm/lib/libLLVM.dylib"),
    "Homebrew, Intel": ("darwin", "x86_64", "/venv", {}, "/usr/local/opt/llvm@18/lib/libLLVM.dylib"),
    "Homebrew elsewhere": ("darwin", "arm64", "/venv", {"HOMEBREW_PREFIX": "/b"}, "/b/opt/llvm/lib/libLLVM.dylib"),
    "MacPorts": ("darwin", "arm64", "/venv", {}, "/opt/local/libexec/llvm-19/lib/libLLVM.dylib"),
    "conda on macOS": ("darwin", "arm64", "/conda", {}, "/conda/lib/libLLVM.19.1.dylib"),
    "LLVM's installer": (
        "win32",
        "AMD64",
        "C:\\venv",
        {"ProgramFiles": "C:\\Program Files"},
        "/C/Program Files/LLVM/bin/LLVM-C.dll",
    ),
    "conda on Windows": ("win32", "AMD64", "C:\\conda", {}, "/C/conda/Library/bin/LLVM-C.dll"),
    "Scoop": ("win32", "AMD64", "C:\\venv", {"USERPROFILE": "C:\\me"}, "/C/me/scoop/apps/llvm/current/bin/LLVM-C.dll"),
    "Windows' path": ("win32", "AMD64", "C:\\venv", {"PATH": ".;lib;D:\\llvm\\bin"}, "/D/llvm/bin/LLVM-C.dll"),
}


def host_of(root: Path, layout: str) -> Host:
    system, processor, prefix, environment, _ = LAYOUTS[layout]
    return Host(system, processor, prefix, environment, root)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_the_library_of_each_package_manager_is_found(layout, tmp_path, monkeypatch):
    library = tmp_path / LAYOUTS[layout][-1].lstrip("/")
    library.parent.mkdir(parents=True)
    library.touch()
    (library.parent / "libLLVMCore.dylib").touch()
    (library.parent / "libclang.so.19").touch()
    host = host_of(tmp_path, layout)
    monkeypatch.setattr(llvm, "Host", lambda: host)
    assert list(llvm.files_in(llvm.search_folders())) == [library.resolve()]


def test_libraries_of_another_system_are_no_candidates():
    names = ["libLLVM.so.19.1", "libLLVM-19.so", "libLLVM.dylib", "libLLVM.19.1.dylib", "LLVM-C.dll"]
    own = {"linux": names[:2], "darwin": names[2:4], "win32": names[4:]}
    for system, expected in own.items():
        assert [name for name in names if Host(system).is_library(name)] == expected
    assert not Host("win32").is_library("libLLVM.dll")
    assert not Host("darwin").is_library("libLLVMCore.19.dylib")
    assert not Host("darwin").is_library("libLLVM-C.dylib")


def test_the_path_of_windows_offers_absolute_folders_only(tmp_path):
    host = Host("win32", "AMD64", "C:\\venv", {"PATH": ".;bin;\\\\server\\llvm;C:\\x"}, tmp_path)
    assert host.folders()[:2] == [tmp_path / "server/llvm", tmp_path / "C/x"]


@pytest.mark.parametrize(
    ("name", "version"),
    [("libLLVM.19.1.dylib", "19.1"), ("libLLVM-20.dylib", "20"), ("libLLVM.so.21.1", "21.1"), ("libLLVM.dylib", None)],
)
def test_version_in_a_name(name, version):
    match = VERSION_IN_NAME.match(name)
    assert (match and match[1]) == version
