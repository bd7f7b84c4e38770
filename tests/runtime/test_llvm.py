import itertools
import os
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from lippmann.errors import EngineError
from lippmann.runtime import llvm
from lippmann.runtime.library_file import elf_machine

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the libraries made here are Linux's")


def library_bytes(own_name: str | None, *, machine: bytes | None = None) -> bytes:
    """The least shared library: a header, two segments, a dynamic section and its strings."""
    strings = b"\0" + (own_name or "").encode() + b"\0"
    dynamic_at, base = 64 + 2 * 56, 0x1000  # mapped away from its place in the file, as real ones are
    entries = [(5, base + dynamic_at + 48)] + ([(14, 1)] if own_name else []) + [(0, 0)]
    dynamic = b"".join(struct.pack("<QQ", *entry) for entry in entries).ljust(48, b"\0")
    size = dynamic_at + 48 + len(strings)
    head = b"\x7fELF\x02\x01\x01" + bytes(9) + struct.pack("<H", 3) + (machine or elf_machine(Path(sys.executable)))
    head += struct.pack("<IQQQIHHHHHH", 1, 0, 64, 0, 0, 64, 56, 2, 0, 0, 0)
    load = struct.pack("<IIQQQQQQ", 1, 4, 0, base, base, size, size, 4096)
    section = struct.pack("<IIQQQQQQ", 2, 4, dynamic_at, base + dynamic_at, base + dynamic_at, 48, 48, 8)
    return head + load + section + dynamic + strings


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A machine on which libraries lie in this folder alone."""
    monkeypatch.delenv(llvm.PATH_VARIABLE, raising=False)
    monkeypatch.setattr(llvm, "search_folders", lambda: [tmp_path])
    monkeypatch.setattr(llvm, "listed_files", lambda: iter(()))
    return tmp_path


def put(folder: Path, file_name: str, own_name: str | None = None) -> Path:
    path = folder / file_name
    path.write_bytes(library_bytes(own_name or file_name))
    return path


@pytest.mark.parametrize(
    ("own_name", "version"),
    [
        ("libLLVM.so.19.1", (19, 1)),
        ("libLLVM-17.so.1", (17,)),
        ("libLLVM-17.so", (17,)),
        ("libLLVM.so.20.0git", (20, 0)),
        ("libLLVM-18.1.8.so", (18, 1, 8)),
    ],
)
def test_version_is_what_the_library_was_built_under(tmp_path, own_name, version):
    library = llvm.inspect(put(tmp_path, "any-name.so", own_name))
    assert library.version == version
    assert library.problem == ""


@pytest.mark.parametrize("major", [9, 14, 15, 16])
def test_versions_that_end_the_process_are_refused_under_any_file_name(tmp_path, major):
    library = llvm.inspect(put(tmp_path, "libLLVM.so.19.1", f"libLLVM-{major}.so.1"))
    assert str(major) in library.problem


def test_what_is_no_library(tmp_path):
    text = tmp_path / "libLLVM.so.19.1"
    text.write_text("INPUT(libLLVM.so.19.1)\n")
    assert "not a shared library" in llvm.inspect(text).problem
    empty = tmp_path / "libLLVM.so.20"
    empty.touch()
    assert "not a shared library" in llvm.inspect(empty).problem
    assert "folder" in llvm.inspect(tmp_path).problem
    assert "not found" in llvm.inspect(tmp_path / "none").problem
    assert "not an LLVM library" in llvm.inspect(put(tmp_path, "libz.so.1")).problem


def test_library_of_another_processor(tmp_path):
    path = tmp_path / "libLLVM.so.19.1"
    path.write_bytes(library_bytes("libLLVM.so.19.1", machine=b"\xf3\x00"))
    assert "not a shared library" in llvm.inspect(path).problem


def test_library_cut_off_anywhere(tmp_path):
    whole = library_bytes("libLLVM.so.19.1")
    for length in range(len(whole)):
        path = tmp_path / f"{length}.so"
        path.write_bytes(whole[:length])
        assert llvm.inspect(path).problem, length


def test_garbled_library_is_judged_without_failing(tmp_path, monkeypatch):
    monkeypatch.setattr(llvm, "_ask", lambda path: ())
    whole = library_bytes("libLLVM.so.19.1")
    for position, bits in itertools.product(range(len(whole)), (0x01, 0x80, 0xFF)):
        damaged = bytearray(whole)
        damaged[position] ^= bits
        path = tmp_path / f"{position}-{bits}.so"
        path.write_bytes(damaged)
        library = llvm.inspect(path)
        assert library.problem or library.version[0] >= llvm.OLDEST


def test_newest_good_library_is_chosen_whatever_the_order(folder):
    kept = [
        ("libLLVM-14.so.1", None),
        ("libLLVM.so.19.1", None),
        ("libLLVM.so.9", "libLLVM.so.9"),
        ("libLLVM-17.so.1", None),
    ]
    for order in itertools.permutations(kept):
        for path in folder.iterdir():
            path.unlink()
        for name, own_name in order:
            put(folder, name, own_name)
        assert llvm.choose().path.name == "libLLVM.so.19.1"


def test_untried_version_only_where_nothing_else_is_found(folder):
    newest = llvm.NEWEST_TRIED
    for major in (newest + 2, newest + 1):
        put(folder, f"libLLVM.so.{major}.1")
    assert llvm.choose().version == (newest + 1, 1)
    put(folder, "libLLVM.so.17.0")
    assert llvm.choose().version == (17, 0)


def test_links_to_one_library_count_once(folder):
    real = put(folder, "libLLVM.so.19.1")
    (folder / "libLLVM-19.so").symlink_to(real)
    (folder / "libLLVM-20.so").symlink_to(folder / "gone")
    assert [library.path for library in llvm.installed()] == [real]


def test_component_libraries_are_not_taken(folder):
    put(folder, "libLLVMCore.so.19.1")
    put(folder, "libLLVM-C.so.19.1", "libLLVM-C.so.19.1")
    assert list(llvm.files_in([folder])) == []


@pytest.mark.slow
def test_none_found(folder):
    with pytest.raises(EngineError, match="no usable LLVM library is installed") as raised:
        llvm.choose()
    assert raised.value.fix.endswith(llvm.install_command())


@pytest.mark.slow
def test_only_old_ones_found_are_named(folder):
    put(folder, "libLLVM-15.so.1")
    put(folder, "libLLVM-14.so.1")
    with pytest.raises(EngineError, match="found only 14, 15"):
        llvm.choose()


def test_systems_list_is_asked_where_the_folders_hold_nothing_good(folder, tmp_path_factory, monkeypatch):
    put(folder, "libLLVM-15.so.1")
    elsewhere = put(tmp_path_factory.mktemp("elsewhere"), "libLLVM.so.18.1")
    monkeypatch.setattr(llvm, "listed_files", lambda: iter([elsewhere]))
    assert llvm.choose().path == elsewhere


def test_systems_list_is_read(monkeypatch):
    output = (
        "2 libs found in cache\n"
        "\tlibLLVM.so.19.1 (libc6,x86-64) => /odd/place/libLLVM.so.19.1\n"
        "\tlibLLVM-C.so.19 (libc6,x86-64) => /odd/place/libLLVM-C.so.19\n"
        "\tlibz.so.1 (libc6,x86-64) => /odd/place/libz.so.1\n"
    )
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: subprocess.CompletedProcess([], 0, output, ""))
    assert list(llvm.listed_files()) == [Path("/odd/place/libLLVM.so.19.1")]


def test_named_library_is_the_only_one_considered(folder, tmp_path_factory, monkeypatch):
    put(folder, "libLLVM.so.19.1")
    other = put(tmp_path_factory.mktemp("other"), "libLLVM.so.18.1")
    monkeypatch.setenv(llvm.PATH_VARIABLE, str(other))
    assert llvm.choose().path == other
    monkeypatch.setenv(llvm.PATH_VARIABLE, "")
    assert llvm.choose().version == (19, 1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("content", "problem"),
    [
        pytest.param(None, "not found", marks=pytest.mark.long),
        pytest.param(b"just text", "is not a shared library", marks=pytest.mark.long),
        pytest.param(library_bytes("libLLVM-14.so.1"), "is LLVM 14, which is too old", marks=pytest.mark.long),
        (library_bytes("libLLVM-15.so.1"), "is LLVM 15, which is too old"),
    ],
    ids=["missing", "text", "14", "15"],
)
def test_wrong_named_library_is_an_error_even_beside_a_good_one(
    folder, tmp_path_factory, monkeypatch, content, problem
):
    put(folder, "libLLVM.so.19.1")
    path = tmp_path_factory.mktemp("other") / "libLLVM.so.19.1"
    if content is not None:
        path.write_bytes(content)
    monkeypatch.setenv(llvm.PATH_VARIABLE, str(path))
    with pytest.raises(EngineError, match=problem) as raised:
        llvm.choose()
    assert raised.value.where == llvm.PATH_VARIABLE
    assert str(path) in str(raised.value)
    assert llvm.install_command() in raised.value.fix


@pytest.mark.slow
def test_bare_name_is_looked_up_where_the_loader_looks(folder, monkeypatch, tmp_path_factory):
    put(folder, "libLLVM.so.19.1")
    monkeypatch.chdir(tmp_path_factory.mktemp("current"))
    put(Path.cwd(), "libLLVM.so.18.1")
    monkeypatch.setenv(llvm.PATH_VARIABLE, "libLLVM.so.19.1")
    assert llvm.choose().path == folder / "libLLVM.so.19.1"
    monkeypatch.setenv(llvm.PATH_VARIABLE, "libLLVM.so.18.1")
    with pytest.raises(EngineError, match="not found"):
        llvm.choose()


def test_library_without_a_name_that_cannot_be_loaded(tmp_path):
    path = tmp_path / "libLLVM.so"
    path.write_bytes(library_bytes(None))
    assert "cannot be loaded" in llvm.inspect(path).problem


def test_library_without_a_version_in_its_name_is_asked_in_another_process(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(llvm, "_ask", lambda path: asked.append(path) or (15, 0, 7))
    path = put(tmp_path, "libLLVM.so")
    assert "LLVM 15" in llvm.inspect(path).problem
    assert asked == [path]


@pytest.fixture(scope="module")
def good_libraries():
    found = [library for library in llvm.installed() if not library.problem]
    if not found:
        pytest.skip("no LLVM library that would do is installed")
    return found


def test_real_libraries_report_the_version_their_files_state(good_libraries):
    for library in good_libraries:
        assert llvm._ask(library.path)[: len(library.version)] == library.version


def test_choosing_loads_no_library(good_libraries):
    code = (
        "from lippmann.runtime import llvm; llvm.choose();"
        "maps = open('/proc/self/maps').read(); assert 'libLLVM' not in maps and 'libcuda' not in maps"
    )
    environment = {key: value for key, value in os.environ.items() if key != llvm.PATH_VARIABLE}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)
