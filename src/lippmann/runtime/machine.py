"""Resources of this process: cores, memory, freed or for input files, and an NVIDIA GPU."""

from __future__ import annotations

import ctypes
import functools
import importlib.util
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Literal, cast

from lippmann.errors import MemoryLimitError

_CONTROL_GROUP = Path("/sys/fs/cgroup")
_MEMORY_TABLE = Path("/proc/meminfo")


def usable_cores() -> int:
    """Number of logical cores that this process may use, at least 1."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def total_memory() -> int:
    """Memory in bytes: that of the machine, or the container's limit if that is lower."""
    limit, total = _limit(), _memory_of_machine("total")
    return total if limit is None else min(total, limit)


def available_memory() -> int:
    """Memory in bytes that is available now without swapping, within the container's limit."""
    limit, available = _limit(), _memory_of_machine("available")
    if limit is None:
        return available
    return max(0, min(available, limit - _measure_used()))


def _memory_of_machine(part: Literal["total", "available"]) -> int:
    """Memory in bytes, from Linux itself where it tells it: psutil takes 20 ms to load."""
    with suppress(OSError, KeyError):
        table = dict(line.split(":") for line in _MEMORY_TABLE.read_text().splitlines())
        return int(table[f"Mem{part.capitalize()}"].removesuffix("kB")) << 10
    import psutil

    return int(getattr(psutil.virtual_memory(), part))


def _limit() -> int | None:
    """Memory limit of the container in bytes (control groups, version 2 or 1); None without one."""
    for name in ("memory.max", "memory/memory.limit_in_bytes"):
        try:
            text = (_CONTROL_GROUP / name).read_text().strip()
        except OSError:
            continue
        # "max" in version 2, a number near 2^63 in version 1: no limit.
        return int(text) if text.isdigit() and int(text) < 1 << 60 else None
    return None


def _measure_used() -> int:
    """Memory in bytes that counts against the container's limit and cannot be reclaimed."""
    for usage, statistics, key in (
        ("memory.current", "memory.stat", "inactive_file"),
        ("memory/memory.usage_in_bytes", "memory/memory.stat", "total_inactive_file"),
    ):
        try:
            used = int((_CONTROL_GROUP / usage).read_text())
            fields = dict(line.split() for line in (_CONTROL_GROUP / statistics).read_text().splitlines())
        except OSError:
            continue
        return max(0, used - int(fields.get(key, 0)))
    return 0


_WINDOWS = sys.platform == "win32"
_DRIVER, _OPTIX = ("nvcuda.dll", "nvoptix.dll") if _WINDOWS else ("libcuda.so.1", "libnvoptix.so.1")


#: Why nothing is denoised.
NO_DENOISER = "no denoiser is installed (Linux on ARM has no package of it), so noise stays: more samples lower it"


def has_denoiser() -> bool:
    """Whether Open Image Denoise is installed, which has no package for Linux on ARM; it is not loaded."""
    return importlib.util.find_spec("pyoidn") is not None


def find_gpu() -> str | None:
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


def gpu_obstacle(dr: ModuleType) -> str:
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


# ---- Memory that the process has freed ----

#: Numbers of the parameters of ``mallopt`` in ``malloc.h``.
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3


@functools.cache  # once: no other thread may ask for memory meanwhile
def keep_freed_memory() -> None:
    """Keep what is freed for what is allocated next, up to 128 MiB, where the C library lets it be told (glibc).

    By itself glibc gives large blocks back at once. The next ones come page by page, each cleared by the system: a
    quarter of all the pages that a render of a small picture touches. Blocks of more than 32 MiB still go back.
    """
    tune = _function("mallopt", ctypes.c_int, ctypes.c_int)
    if tune is not None:
        tune(_MMAP_THRESHOLD, 32 << 20)
        tune(_TRIM_THRESHOLD, 128 << 20)


def return_freed_memory() -> None:
    """Give freed memory back to the system, where the C library keeps it (glibc); elsewhere nothing is done.

    glibc keeps a heap for each of several threads. Large blocks that many threads allocate and free, as those of Open
    Image Denoise do, leave holes in all of them, and a process that goes on for hours grows. It takes milliseconds.
    """
    trim = _function("malloc_trim", ctypes.c_size_t)
    if trim is not None:
        trim(0)


@functools.cache
def _function(name: str, *arguments: type) -> Callable[..., int] | None:
    try:
        function = getattr(ctypes.CDLL(None), name)
    except (AttributeError, OSError, TypeError):  # another C library, or Windows, which has no library of that name
        return None
    function.argtypes, function.restype = arguments, ctypes.c_int
    return cast("Callable[..., int]", function)


# ---- Memory for what input files hold ----

#: Bytes that are granted without a look at the machine, until as many were granted so.
_UNSEEN = 16 << 20


@dataclass
class _Limit:
    """``most`` bytes, of which ``granted`` were asked for in all, since the process had ``start``.

    What was granted may be free again, and what the process took besides may be libraries: the lesser of the two
    counts. ``unseen`` bytes were granted without a look.
    """

    most: int | None = None
    start: int = 0
    granted: int = 0
    unseen: int = 0

    @property
    def taken(self) -> int:
        """Bytes that are certainly taken for what files hold."""
        return min(self.granted, max(0, resident_memory() - self.start))


_input_limit: ContextVar[_Limit] = ContextVar("input memory")


@contextmanager
def limit_inputs(most: int | None) -> Iterator[None]:
    """Let what is read from files meanwhile take ``most`` bytes in all; None for all that is free."""
    before = _input_limit.set(_Limit(most, resident_memory() if most is not None else 0))
    try:
        yield
    finally:
        _input_limit.reset(before)


def check_input(size: int, what: str, *, where: str) -> None:
    """Ask for ``size`` bytes for something that a file holds.

    Parameters
    ----------
    what:
        What takes them, such as "texture 'wood.png'".
    where:
        The file.

    Raises
    ------
    MemoryLimitError
        There are not as many: neither free on the machine nor left of the limit of :func:`limit_inputs`.
    """
    limit = _current()
    limit.unseen += size
    if limit.unseen < _UNSEEN:
        limit.granted += size
        return
    limit.unseen = 0
    free, fix = _left(limit)
    limit.granted += size
    if size > free:
        took = f"{what} takes {amount_in_words(size)} of memory"
        raise MemoryLimitError(took, where=where, rule=f"{amount_in_words(free)} are left", fix=fix)


def input_memory_left() -> int:
    """Bytes that may still be taken for what files hold."""
    return _left(_current())[0]


def _current() -> _Limit:
    limit = _input_limit.get(None)
    if limit is None:
        limit = _Limit()
        _input_limit.set(limit)
    return limit


def _left(limit: _Limit) -> tuple[int, str]:
    """Bytes, and what gives more."""
    free = available_memory()
    if limit.most is not None:
        left = max(0, limit.most - limit.taken)
        if left < free:
            return left, "allow more with memory=..."
    return free, "close other programs, or use a machine with more memory"


def resident_memory() -> int:
    """Bytes of memory that this process holds now."""
    import psutil

    return int(psutil.Process().memory_info().rss)


def amount_in_words(size: int) -> str:
    """Bytes of memory, such as ``1.5 GiB``, ``1.2 MiB``, ``12 MiB`` or ``1 KiB``."""
    if size >= 1 << 30:
        return f"{size / 2**30:.1f} GiB"
    if size >= 1 << 20:
        return f"{size / 2**20:.{1 if size < 10 << 20 else 0}f} MiB"
    return f"{max(1, size >> 10)} KiB"


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach a server on this address."""
    import ipaddress

    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
