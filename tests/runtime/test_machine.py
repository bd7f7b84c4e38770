import os

import psutil
import pytest

from lippmann.runtime import machine

GIB = 1 << 30


@pytest.fixture
def memory_of_machine(monkeypatch):
    class Memory:
        total = 16 * GIB
        available = 8 * GIB

    monkeypatch.setattr(psutil, "virtual_memory", Memory)


@pytest.fixture
def control_group(tmp_path, monkeypatch, memory_of_machine):
    monkeypatch.setattr(machine, "_CONTROL_GROUP", tmp_path)

    def write(**files):
        for name, content in files.items():
            path = tmp_path / name.replace("__", "/").replace("_dot_", ".")
            path.parent.mkdir(exist_ok=True)
            path.write_text(content)

    return write


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system cannot tie a process to cores")
def test_cores_are_those_the_process_may_use():
    allowed = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(allowed)})
        assert machine.usable_cores() == 1
    finally:
        os.sched_setaffinity(0, allowed)
    assert machine.usable_cores() == len(allowed)


def test_memory_without_a_container(control_group):
    assert machine.total_memory() == 16 * GIB
    assert machine.available_memory() == 8 * GIB


def test_memory_of_an_unlimited_container(control_group):
    control_group(memory_dot_max="max\n", memory_dot_current=str(2 * GIB))
    assert machine.total_memory() == 16 * GIB
    assert machine.available_memory() == 8 * GIB


def test_memory_of_a_limited_container(control_group):
    control_group(
        memory_dot_max=f"{4 * GIB}\n",
        memory_dot_current=f"{3 * GIB}\n",
        memory_dot_stat=f"anon 5\ninactive_file {GIB}\nactive_file 7\n",
    )
    assert machine.total_memory() == 4 * GIB
    assert machine.available_memory() == 2 * GIB  # 4 less the 2 of 3 that are no cache


def test_memory_of_a_container_of_the_older_kind(control_group):
    control_group(
        memory__memory_dot_limit_in_bytes=str(4 * GIB),
        memory__memory_dot_usage_in_bytes=str(3 * GIB),
        memory__memory_dot_stat=f"total_inactive_file {GIB}\n",
    )
    assert machine.available_memory() == 2 * GIB


def test_the_older_kind_writes_no_limit_as_a_huge_number(control_group):
    control_group(memory__memory_dot_limit_in_bytes="9223372036854771712")
    assert machine.total_memory() == 16 * GIB


def test_no_more_than_the_machine_has(control_group):
    control_group(memory_dot_max=str(64 * GIB), memory_dot_current="0", memory_dot_stat="inactive_file 0\n")
    assert machine.total_memory() == 16 * GIB
    assert machine.available_memory() == 8 * GIB
