"""Open Image Denoise on the GPU: by buffers, which the CPU's device knows too, and left to the CPU where that fails."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.rendering.denoise import oidn
from lippmann.rendering.denoise.oidn import denoise
from lippmann.runtime import open_image_denoise


def pictures():
    rng = np.random.default_rng(5)
    return tuple(rng.random((48, 80, 3), dtype=np.float32) for _ in range(3))


@pytest.fixture
def gpu(monkeypatch):
    """An engine on the GPU, and a device there; which one is told by its kind."""

    def be(kind):
        monkeypatch.setattr(oidn.engine, "runs_on_gpu", lambda: True)
        monkeypatch.setattr(open_image_denoise, "is_cuda_available", lambda: True)
        monkeypatch.setattr(open_image_denoise, "DEVICE_TYPE_CUDA", kind)
        monkeypatch.setattr(oidn, "_devices", {})

    return be


@pytest.mark.parametrize("effort", ["fast", "high"])
@pytest.mark.parametrize("rotated", [False, True])
def test_buffers_hold_what_arrays_hold(gpu, effort, rotated):
    color, albedo, normal = pictures()
    options = {"clean_guides": True, "effort": effort, "rotated": rotated, "threads": 1}
    by_arrays = denoise(color, albedo, normal, **options)
    gpu(open_image_denoise.DEVICE_TYPE_CPU)
    by_buffers = denoise(color, albedo, normal, **options)
    assert list(oidn._devices) == [None]
    assert np.array_equal(by_buffers, by_arrays)


def test_what_the_gpu_cannot_do_is_left_to_the_cpu(gpu):
    color, _, _ = pictures()
    expected = denoise(color, threads=1)
    gpu(4)  # OIDN_DEVICE_TYPE_HIP: such devices are in no package
    assert np.array_equal(denoise(color, threads=1), expected)
    assert list(oidn._devices) == [1]


def test_a_gpu_that_runs_out_of_memory_is_left_too(gpu, monkeypatch):
    color, _, _ = pictures()
    expected = denoise(color, threads=1)
    gpu(open_image_denoise.DEVICE_TYPE_CPU)
    released, real = [], open_image_denoise.Buffer

    class Full(real):
        def __init__(self, device, size):
            super().__init__(device, size if not released else 1 << 60)
            released.append(0)

        def close(self):
            released.pop()
            super().close()

    monkeypatch.setattr(open_image_denoise, "Buffer", Full)
    assert np.array_equal(denoise(color, threads=1), expected)
    assert not released
    assert set(oidn._devices) == {None, 1}
