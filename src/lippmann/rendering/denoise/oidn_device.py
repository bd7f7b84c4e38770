"""Where Open Image Denoise runs: on the GPU if the engine does, else on the CPU."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import EngineError
from lippmann.runtime import engine

if TYPE_CHECKING:
    from pyoidn import Device as OidnDevice
    from pyoidn import Filter as OidnFilter

FloatArray = NDArray[np.float32]
SetUp = Callable[["OidnFilter"], None]

#: Devices by their CPU threads, made once: that takes longer than a small picture. No threads: the GPU's.
_devices: dict[int | None, OidnDevice] = {}


def filtered(pyoidn: ModuleType, images: dict[str, FloatArray], set_up: SetUp, threads: int) -> FloatArray:
    """What a filter makes of ``images``, packed ``(H, W, 3)`` by the filter's names for them.

    A GPU that cannot do it, for want of memory say, leaves it to the CPU.

    Raises
    ------
    EngineError
        Open Image Denoise fails on the CPU.
    """
    if engine.runs_on_gpu() and pyoidn.Device.is_cuda_available(0):
        try:
            return _on_gpu(pyoidn, images, set_up)
        except EngineError:
            pass
    return _on_cpu(pyoidn, images, set_up, threads)


def _on_cpu(pyoidn: ModuleType, images: dict[str, FloatArray], set_up: SetUp, threads: int) -> FloatArray:
    output = np.empty_like(next(iter(images.values())))
    device = _cpu(pyoidn, threads)
    with _filter(pyoidn, device) as work:
        for name, image in (*images.items(), ("output", output)):
            work.set_image(name, image, pyoidn.OIDN_FORMAT_FLOAT3)
        _run(device, work, set_up)
    return output


def _on_gpu(pyoidn: ModuleType, images: dict[str, FloatArray], set_up: SetUp) -> FloatArray:
    """The same by copies in the GPU's memory, which does not see the processor's."""
    output = np.empty_like(next(iter(images.values())))
    height, width = output.shape[:2]
    device = _gpu(pyoidn)
    buffers = []
    try:
        with _filter(pyoidn, device) as work:
            for name, image in (*images.items(), ("output", output)):
                buffer = pyoidn.Buffer(device, image.nbytes)
                buffers.append(buffer)
                _check(device)
                if image is not output:
                    buffer.write(0, image.nbytes, _bytes(image))
                work.set_image(name, buffer, pyoidn.OIDN_FORMAT_FLOAT3, width, height)
            _run(device, work, set_up)
            buffers[-1].read(0, output.nbytes, _bytes(output))
            _check(device)
    finally:
        for buffer in buffers:
            buffer.release()
    return output


def _bytes(image: FloatArray) -> NDArray[np.uint8]:
    return image.reshape(-1).view(np.uint8)


@contextmanager
def _filter(pyoidn: ModuleType, device: OidnDevice) -> Iterator[OidnFilter]:
    work = pyoidn.Filter(device, pyoidn.OIDN_FILTER_TYPE_RT)
    try:
        yield work
    finally:
        work.release()


def _run(device: OidnDevice, work: OidnFilter, set_up: SetUp) -> None:
    set_up(work)
    work.commit()
    work.execute()
    _check(device)


def _cpu(pyoidn: ModuleType, threads: int) -> OidnDevice:
    if threads not in _devices:
        device = pyoidn.Device(pyoidn.OIDN_DEVICE_TYPE_CPU)
        device.set_int("numThreads", threads)
        # Dr.Jit's threads share the cores: pinned ones would wait for each other.
        device.set_bool("setAffinity", False)
        _devices[threads] = _ready(device)
    return _devices[threads]


def _gpu(pyoidn: ModuleType) -> OidnDevice:
    if None not in _devices:
        _devices[None] = _ready(pyoidn.Device(pyoidn.OIDN_DEVICE_TYPE_CUDA))
    return _devices[None]


def _ready(device: OidnDevice) -> OidnDevice:
    device.commit()
    _check(device)
    return device


def _check(device: OidnDevice) -> None:
    message = device.get_error()
    if message:
        raise EngineError(f"Open Image Denoise fails: {message}", parameter="denoise", fix='render with denoise="none"')
