import itertools
import os
import subprocess
import sys
from pathlib import Path

import pytest

from lippmann.errors import EngineError
from lippmann.runtime import llvm
from lippmann.runtime.llvm import elf_head

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the libraries made here are Linux's")


def library_bytes(processor: bytes | None = None) -> bytes:
    """The head of a shared library."""
    kind, own = elf_head()
    return kind + bytes(10) + b"\x03\x00" + (processor or own)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A machine on which libraries lie in this folder alone."""
    monkeypatch.delenv(llvm.PATH_VARIABLE, raising=False)
    monkeypatch.setattr(llvm, "search_folders", lambda: [tmp_path])
    monkeypatch.setattr(llvm, "listed_files", lambda: iter(()))
    monkeypatch.setattr(llvm, "install_command", lambda: "install LLVM")  # the package manager takes long to ask
    return tmp_path


def put(folder: Path, file_name: str) -> Path:
    path = folder / file_name
    path.write_bytes(library_bytes())
    return path


@pytest.mark.parametrize(
    ("name", "version"),
    [
        ("libLLVM.so.19.1", (19, 1)),
        ("libLLVM-17.so.1", (17,)),
        ("libLLVM-17.so", (17,)),
        ("libLLVM.so.20.0git", (20, 0)),
        ("libLLVM-18.1.8.so", (18, 1, 8)),
    ],
)
def test_version_is_what_the_name_says(tmp_path, name, version):
    library = llvm.inspect(put(tmp_path, name))
    assert library.version == version
    assert library.problem == ""


@pytest.mark.parametrize("major", [9, 14, 15, 16])
def test_versions_that_end_the_process_are_refused(tmp_path, monkeypatch, major):
    assert str(major) in llvm.inspect(put(tmp_path, f"libLLVM-{major}.so.1")).problem
    monkeypatch.setattr(llvm, "_ask", lambda path: (major, 0, 6))
    assert str(major) in llvm.inspect(put(tmp_path, "any-name.so")).problem


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
    path.write_bytes(library_bytes(b"\xf3\x00"))
    assert "not a shared library" in llvm.inspect(path).problem


def test_newest_good_library_is_chosen_whatever_the_order(folder):
    for order in itertools.permutations(["libLLVM-14.so.1", "libLLVM.so.19.1", "libLLVM.so.9", "libLLVM-17.so.1"]):
        for path in folder.iterdir():
            path.unlink()
        for name in order:
            put(folder, name)
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
    put(folder, "libLLVM-C.so.19.1")
    assert list(llvm.files_in([folder])) == []


def test_none_found(folder):
    with pytest.raises(EngineError, match="no usable LLVM library is installed") as raised:
        llvm.choose()
    assert raised.value.fix.endswith(llvm.install_command())


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


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("libLLVM.so.19.1", None, "not found"),
        ("libLLVM.so.19.1", b"just text", "is not a shared library"),
        ("libLLVM-14.so.1", library_bytes(), "is LLVM 14, which is too old"),
        ("libLLVM-15.so.1", library_bytes(), "is LLVM 15, which is too old"),
    ],
    ids=["missing", "text", "14", "15"],
)
def test_wrong_named_library_is_an_error_even_beside_a_good_one(
    folder, tmp_path_factory, monkeypatch, name, content, problem
):
    put(folder, "libLLVM.so.19.1")
    path = tmp_path_factory.mktemp("other") / name
    if content is not None:
        path.write_bytes(content)
    monkeypatch.setenv(llvm.PATH_VARIABLE, str(path))
    with pytest.raises(EngineError, match=problem) as raised:
        llvm.choose()
    assert raised.value.where == llvm.PATH_VARIABLE
    assert str(path) in str(raised.value)
    assert llvm.install_command() in raised.value.fix


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
    path.write_bytes(library_bytes())
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
