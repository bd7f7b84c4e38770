"""Detection of an NVIDIA GPU that can trace rays, through the driver's libraries."""

from __future__ import annotations

import ctypes
import os
import sys
from pathlib import Path
from types import ModuleType

_WINDOWS = sys.platform == "win32"
_DRIVER, _OPTIX = ("nvcuda.dll", "nvoptix.dll") if _WINDOWS else ("libcuda.so.1", "libnvoptix.so.1")


def find() -> str | None:
    """Name of the first GPU; None without a GPU or its driver."""
    try:
        driver = ctypes.CDLL(os.environ.get("DRJIT_LIBCUDA_PATH") or _DRIVER)
        count = ctypes.c_int(0)
        if driver.cuInit(0) != 0 or driver.cuDeviceGetCount(ctypes.byref(count)) != 0 or count.value < 1:
            return None
        name = ctypes.create_string_buffer(256)
        if driver.cuDeviceGetName(name, len(name), 0) != 0:
            return None
    except (OSError, AttributeError):
        return None
    return name.value.decode(errors="replace")


def obstacle(dr: ModuleType) -> str:
    """Reason why Mitsuba cannot use the GPU; empty if it can.

    It needs a CUDA driver and OptiX, which containers often lack. ``dr`` is the module ``drjit``.
    """
    if not dr.has_backend(dr.JitBackend.CUDA):
        return "no NVIDIA GPU with a driver of version 535 or newer was found"
    if tuple(dr.detail.cuda_version())[:2] == (12, 7):
        return "NVIDIA drivers of versions 560 to 569 miscompile kernels; install 570 or newer"
    optix = os.environ.get("DRJIT_LIBOPTIX_PATH") or _optix_path()
    try:
        ctypes.CDLL(optix).optixQueryFunctionTable  # noqa: B018 - the look-up raises if the function is missing
    except (OSError, AttributeError):
        return f"the GPU's driver cannot trace rays: '{optix}' (OptiX) cannot be loaded"
    return ""


def _optix_path() -> str:
    """OptiX of the driver: by name, or on Windows in the driver's own folder, which no search path holds."""
    if not _WINDOWS:
        return _OPTIX
    drivers = Path(os.environ.get("SYSTEMROOT", r"C:\Windows"), "System32", "DriverStore", "FileRepository")
    return next((str(path) for path in sorted(drivers.glob(f"nv*/{_OPTIX}"))), _OPTIX)
