from types import SimpleNamespace

import pytest

from lippmann.runtime import gpu


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
    monkeypatch.setattr(gpu.ctypes, "CDLL", Loader(**libraries))
    assert gpu.find() == name


def drjit(backend=True, cuda=(12, 8)):
    return SimpleNamespace(
        JitBackend=SimpleNamespace(CUDA="cuda"),
        has_backend=lambda which: backend,
        detail=SimpleNamespace(cuda_version=lambda: cuda),
    )


OPTIX = {"libnvoptix": {"optixQueryFunctionTable": None}}


def test_usable_gpu_has_no_obstacle(monkeypatch):
    monkeypatch.setattr(gpu.ctypes, "CDLL", Loader(**OPTIX))
    assert gpu.obstacle(drjit()) == ""


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
    monkeypatch.setattr(gpu.ctypes, "CDLL", Loader(**libraries))
    assert reason in gpu.obstacle(dr)


def test_named_optix_library_is_the_one_looked_for(monkeypatch):
    monkeypatch.setattr(gpu.ctypes, "CDLL", Loader(**OPTIX))
    monkeypatch.setenv("DRJIT_LIBOPTIX_PATH", "/elsewhere/libother.so")
    assert "/elsewhere/libother.so" in gpu.obstacle(drjit())
