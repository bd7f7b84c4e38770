"""Libraries of macOS and Windows, made byte by byte; those of Linux are in ``test_llvm.py``."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from lippmann.runtime import llvm
from lippmann.runtime.library_file import VERSION_IN_NAME, Host, LibraryName, name_of

X86, ARM = 0x01000007, 0x0100000C
AMD64, ARM64 = 0x8664, 0xAA64


def mach_o(name: str, version: tuple[int, int, int] = (19, 1, 7), *, processor: int = ARM, kind: int = 6) -> bytes:
    """A library with two load commands: a segment, then its own name."""
    text = name.encode() + b"\0"
    text += bytes(-len(text) % 8)
    packed = version[0] << 16 | version[1] << 8 | version[2]
    own = struct.pack("<6I", 0xD, 24 + len(text), 24, 2, packed, 0x10000) + text
    segment = struct.pack("<II", 0x19, 72) + bytes(64)
    head = struct.pack("<8I", 0xFEEDFACF, processor, 0, kind, 2, len(segment) + len(own), 0, 0)
    return head + segment + own


def fat(*parts: bytes) -> bytes:
    """Libraries of several processors in one file."""
    at, table, body = 4096, b"", b""
    for part in parts:
        table += struct.pack(">5I", struct.unpack_from("<I", part, 4)[0], 0, at + len(body), len(part), 12)
        body += part.ljust(4096, b"\0")
    return (struct.pack(">II", 0xCAFEBABE, len(parts)) + table).ljust(at, b"\0") + body


def pe(machine: int = AMD64, flags: int = 0x2022, magic: int = 0x20B) -> bytes:
    head = b"MZ".ljust(60, b"\0") + struct.pack("<I", 128)
    return (
        head.ljust(128, b"\0")
        + b"PE\0\0"
        + struct.pack("<HHIIIHH", machine, 1, 0, 0, 0, 240, flags)
        + struct.pack("<H", magic)
    )


@pytest.fixture
def write(tmp_path):
    def written(data: bytes, name: str = "libLLVM.dylib") -> Path:
        path = tmp_path / name
        path.write_bytes(data)
        return path

    return written


def test_a_mac_library_states_its_name_and_version(write):
    path = write(mach_o("/opt/homebrew/opt/llvm/lib/libLLVM.dylib"))
    assert name_of(path, "darwin", processor="arm64") == LibraryName("libLLVM.dylib", (19, 1, 7))
    path = write(mach_o("@rpath/libLLVM.20.1.dylib", (1, 0, 0)))
    assert name_of(path, "darwin", processor="arm64") == LibraryName("libLLVM.20.1.dylib", ())


def test_of_several_processors_the_own_one_counts(write):
    both = fat(mach_o("a/libLLVM-17.dylib", processor=X86), mach_o("a/libLLVM-18.dylib", processor=ARM))
    assert name_of(write(both), "darwin", processor="x86_64").name == "libLLVM-17.dylib"
    assert name_of(write(both), "darwin", processor="arm64").name == "libLLVM-18.dylib"


@pytest.mark.parametrize(
    "data",
    [
        mach_o("libLLVM.dylib", processor=X86),
        fat(mach_o("libLLVM.dylib", processor=X86)),
        mach_o("libLLVM.dylib", kind=2),
        pe(),
        b"\x7fELF\x02\x01" + bytes(200),
        b"",
    ],
    ids=["other processor", "other processors", "a program", "Windows", "Linux", "empty"],
)
def test_what_is_no_mac_library(write, data):
    with pytest.raises((ValueError, struct.error)):
        name_of(write(data), "darwin", processor="arm64")


def test_a_windows_library_has_the_name_of_its_file(write):
    python = write(pe(flags=0x22), "python.exe")
    assert name_of(write(pe(), "LLVM-C.dll"), "win32", python=python) == LibraryName("LLVM-C.dll")


@pytest.mark.parametrize(
    "data",
    [pe(ARM64), pe(flags=0x22), pe(magic=0x10B), mach_o("libLLVM.dylib"), b"MZ", b""],
    ids=["other processor", "a program", "32 bits", "Mac", "cut off", "empty"],
)
def test_what_is_no_windows_library(write, data):
    python = write(pe(flags=0x22), "python.exe")
    with pytest.raises((ValueError, struct.error)):
        name_of(write(data, "LLVM-C.dll"), "win32", python=python)


@pytest.mark.parametrize("system", ["darwin", "win32"])
def test_a_damaged_library_is_judged_without_any_other_error(write, system):
    whole = mach_o("/a/libLLVM.19.1.dylib") if system == "darwin" else pe()
    python = write(pe(flags=0x22), "python.exe")
    for length in range(len(whole)):
        with pytest.raises((ValueError, struct.error)):
            name_of(write(whole[:length], "LLVM"), system, python=python, processor="arm64")
    for position in range(len(whole)):
        for bits in (0x01, 0x80, 0xFF):
            damaged = bytearray(whole)
            damaged[position] ^= bits
            try:
                name_of(write(bytes(damaged), "LLVM"), system, python=python, processor="arm64")
            except (ValueError, struct.error):
                continue


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
