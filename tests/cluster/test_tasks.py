"""What workers say of themselves."""

from pathlib import Path

from lippmann.cluster.tasks import own_versions
from lippmann.errors import EngineError
from lippmann.runtime import llvm


def test_all_that_the_bytes_depend_on_is_told(monkeypatch):
    found = own_versions()
    assert set(found) == {"Lippmann", "Mitsuba", "Dr.Jit", "LLVM", "Open Image Denoise"}
    assert all(version[0].isdigit() for version in found.values())

    def other():
        return llvm.Library(Path("libLLVM.so"), (99, 1))

    monkeypatch.setattr(llvm, "choose", other)
    assert own_versions() == {**found, "LLVM": "99.1"}


def test_a_machine_without_a_compiler_has_none(monkeypatch):
    def missing():
        raise EngineError("no usable LLVM library is installed")

    monkeypatch.setattr(llvm, "choose", missing)
    assert own_versions()["LLVM"] == "none"
