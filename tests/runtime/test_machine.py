import os
from pathlib import Path
from types import SimpleNamespace

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
    monkeypatch.setattr(machine, "_MEMORY_TABLE", Path("no table"))


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


def test_memory_as_linux_tells_it(control_group, tmp_path, monkeypatch):
    table = tmp_path / "meminfo"
    table.write_text(
        "MemTotal:       4194304 kB\nMemFree:         11 kB\nMemAvailable:    2097152 kB\nHugePages_Total: 0\n"
    )
    monkeypatch.setattr(machine, "_MEMORY_TABLE", table)
    assert machine.total_memory() == 4 * GIB
    assert machine.available_memory() == 2 * GIB


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


class Loader:
    """Stands in for the dynamic loader: libraries by name, each a set of functions."""

    def __init__(self, **libraries):
        self.libraries = libraries

    def __call__(self, name):
        key = name.partition(".")[0].rpartition("/")[2]
        if key not in self.libraries:
            raise OSError(f"{name}: cannot open shared object file")
        return SimpleNamespace(**self.libraries[key])


def set_count(count):
    def cuDeviceGetCount(pointer):  # noqa: N802 - the driver's own name
        pointer._obj.value = count
        return 0

    return cuDeviceGetCount


def set_name(buffer, size, device):
    buffer.value = b"Test GPU"[:size]
    return device


@pytest.fixture(autouse=True)
def usual_places(monkeypatch):
    for variable in ("DRJIT_LIBCUDA_PATH", "DRJIT_LIBOPTIX_PATH"):
        monkeypatch.delenv(variable, raising=False)


def driver(devices=1, start=0):
    return {"cuInit": lambda flags: start, "cuDeviceGetCount": set_count(devices), "cuDeviceGetName": set_name}


@pytest.mark.parametrize(
    ("libraries", "name"),
    [
        ({"libcuda": driver()}, "Test GPU"),
        ({"libcuda": driver(devices=0)}, None),
        ({"libcuda": driver(start=100)}, None),  # CUDA_ERROR_NO_DEVICE
        ({"libcuda": {}}, None),
        ({}, None),
    ],
    ids=["one", "no device", "driver without device", "foreign library", "no driver"],
)
def test_find(monkeypatch, libraries, name):
    monkeypatch.setattr(machine.ctypes, "CDLL", Loader(**libraries))
    assert machine.find_gpu() == name


def drjit(backend=True, cuda=(12, 8)):
    return SimpleNamespace(
        JitBackend=SimpleNamespace(CUDA="cuda"),
        has_backend=lambda which: backend,
        detail=SimpleNamespace(cuda_version=lambda: cuda),
    )


OPTIX = {"libnvoptix": {"optixQueryFunctionTable": None}}


def test_usable_gpu_has_no_obstacle(monkeypatch):
    monkeypatch.setattr(machine.ctypes, "CDLL", Loader(**OPTIX))
    assert machine.gpu_obstacle(drjit()) == ""


@pytest.mark.parametrize(
    ("dr", "libraries", "reason"),
    [
        (drjit(backend=False), OPTIX, "no NVIDIA GPU"),
        (drjit(cuda=(12, 7)), OPTIX, "570"),
        (drjit(), {}, "OptiX"),
        (drjit(), {"libnvoptix": {}}, "OptiX"),
    ],
    ids=["no backend", "miscompiling driver", "no OptiX", "foreign library"],
)
def test_obstacles(monkeypatch, dr, libraries, reason):
    monkeypatch.setattr(machine.ctypes, "CDLL", Loader(**libraries))
    assert reason in machine.gpu_obstacle(dr)


def test_named_optix_library_is_the_one_looked_for(monkeypatch):
    monkeypatch.setattr(machine.ctypes, "CDLL", Loader(**OPTIX))
    monkeypatch.setenv("DRJIT_LIBOPTIX_PATH", "/elsewhere/libother.so")
    assert "/elsewhere/libother.so" in machine.gpu_obstacle(drjit())
