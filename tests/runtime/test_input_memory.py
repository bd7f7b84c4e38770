"""Memory for what files hold is asked for before it is taken."""

import pytest

from lippmann.errors import MemoryLimitError
from lippmann.runtime import machine as process
from lippmann.runtime.machine import check_input, input_memory_left, limit_inputs


@pytest.fixture(autouse=True)
def no_limit():
    with limit_inputs(None):
        yield


@pytest.fixture
def machine(monkeypatch):
    """Sets what the machine has free, and what the process has."""
    state = {"free": 10 << 30, "has": 1 << 30}
    monkeypatch.setattr(process, "available_memory", lambda: state["free"])
    monkeypatch.setattr(process, "resident_memory", lambda: state["has"])
    return state


def test_what_fits_is_granted_and_what_does_not_is_refused(machine):
    check_input(9 << 30, "the picture", where="p.exr")
    with pytest.raises(MemoryLimitError) as caught:
        check_input(11 << 30, "the picture", where="p.exr")
    assert str(caught.value) == (
        "p.exr: the picture takes 11.0 GiB of memory; 10.0 GiB are left; "
        "close other programs, or use a machine with more memory"
    )


def test_a_limit_counts_what_was_taken_since(machine):
    with limit_inputs(2 << 30):
        check_input(2 << 30, "a texture", where="m.glb")
        machine["has"] += 1 << 30
        assert input_memory_left() == 1 << 30
        with pytest.raises(MemoryLimitError, match=r"1.0 GiB are left; allow more with memory=\.\.\.$"):
            check_input((1 << 30) + 1, "a texture", where="m.glb")


def test_a_limit_ends_with_what_it_was_set_for(machine):
    with pytest.raises(MemoryLimitError), limit_inputs(1 << 20):
        check_input(32 << 20, "a texture", where="m.glb")
    check_input(9 << 30, "a texture", where="m.glb")


def test_libraries_do_not_count(machine):
    """The engine alone takes some hundred megabytes."""
    with limit_inputs(64 << 20):
        machine["has"] += 1 << 30
        check_input(32 << 20, "a texture", where="m.glb")
        with pytest.raises(MemoryLimitError, match="32 MiB are left"):
            check_input(33 << 20, "a texture", where="m.glb")


def test_what_is_free_again_does_not_count(machine):
    with limit_inputs(1 << 30):
        for _ in range(100):
            check_input(512 << 20, "a frame's texture", where="m.glb")
        assert input_memory_left() == 1 << 30


def test_many_small_things_are_as_much_as_a_large_one(machine):
    machine["free"] = 8 << 20
    for _ in range(15):
        check_input(1 << 20, "an accessor", where="m.glb")
    with pytest.raises(MemoryLimitError):
        check_input(9 << 20, "an accessor", where="m.glb")


def test_this_process_and_machine_have_memory():
    assert input_memory_left() > 1 << 20
    with limit_inputs(1 << 20):
        assert input_memory_left() <= 1 << 20
