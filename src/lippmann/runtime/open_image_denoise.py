"""Open Image Denoise's C interface, as far as it is used, of the library that the package ``pyoidn`` brings.

The package's own Python interface parses C declarations when it is imported, which takes as long as to denoise a small
picture. Names are those of the C interface (https://github.com/RenderKit/oidn#readme, "API").
"""

from __future__ import annotations

import ctypes
import functools
import importlib.util
import sys
from contextlib import closing, contextmanager
from contextvars import ContextVar
from ctypes import POINTER, c_bool, c_char_p, c_float, c_int, c_size_t, c_void_p
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    import numpy as np
    from numpy.typing import NDArray

#: Kinds of devices, a format of images, and the qualities of the network.
DEVICE_TYPE_CPU, DEVICE_TYPE_CUDA = 1, 3
_FORMAT_FLOAT3 = 3
QUALITIES = {"fast": 4, "high": 6}

#: Result and arguments of each function.
_FUNCTIONS: dict[str, tuple[Any, ...]] = {
    "NewDevice": (c_void_p, c_int),
    "IsCUDADeviceSupported": (c_bool, c_int),
    "SetDeviceBool": (None, c_void_p, c_char_p, c_bool),
    "SetDeviceInt": (None, c_void_p, c_char_p, c_int),
    "GetDeviceInt": (c_int, c_void_p, c_char_p),
    "CommitDevice": (None, c_void_p),
    "GetDeviceError": (c_int, c_void_p, POINTER(c_char_p)),
    "ReleaseDevice": (None, c_void_p),
    "NewBuffer": (c_void_p, c_void_p, c_size_t),
    "WriteBuffer": (None, c_void_p, c_size_t, c_size_t, c_void_p),
    "ReadBuffer": (None, c_void_p, c_size_t, c_size_t, c_void_p),
    "ReleaseBuffer": (None, c_void_p),
    "NewFilter": (c_void_p, c_void_p, c_char_p),
    "SetSharedFilterImage": (None, c_void_p, c_char_p, c_void_p, c_int, *[c_size_t] * 5),
    "SetFilterImage": (None, c_void_p, c_char_p, c_void_p, c_int, *[c_size_t] * 5),
    "SetFilterBool": (None, c_void_p, c_char_p, c_bool),
    "SetFilterInt": (None, c_void_p, c_char_p, c_int),
    "SetFilterFloat": (None, c_void_p, c_char_p, c_float),
    "CommitFilter": (None, c_void_p),
    "ExecuteFilter": (None, c_void_p),
    "ReleaseFilter": (None, c_void_p),
}


@functools.cache
def load() -> ctypes.CDLL:
    """The library.

    Raises
    ------
    OSError
        The package is not installed, or its library does not load.
    """
    package = importlib.util.find_spec("pyoidn")
    if package is None or package.origin is None:
        raise OSError("pyoidn is not installed")
    folder = Path(package.origin).parent / "oidn" / ("bin" if sys.platform == "win32" else "lib")
    if sys.platform == "win32":
        ctypes.CDLL(str(folder / "OpenImageDenoise_device_cpu.dll"))  # the library finds it where it is loaded already
    name = {"win32": "OpenImageDenoise.dll", "darwin": "libOpenImageDenoise.dylib"}.get(sys.platform)
    library = ctypes.CDLL(str(folder / (name or "libOpenImageDenoise.so")))
    for name, (result, *arguments) in _FUNCTIONS.items():
        function = getattr(library, f"oidn{name}")
        function.restype, function.argtypes = result, arguments
    return library


def is_loaded() -> bool:
    """Whether the library was loaded, and may have started threads of its own."""
    return load.cache_info().currsize > 0


class Device:
    """A processor that runs filters, one at a time.

    Parameters
    ----------
    kind:
        One of ``DEVICE_TYPE_...``.
    options:
        Of the device, by the C interface's names: numbers, or on and off.
    """

    def __init__(self, kind: int, **options: int) -> None:
        self._library = load()
        self.handle = self._library.oidnNewDevice(kind)
        for name, value in options.items():
            put = self._library.oidnSetDeviceBool if isinstance(value, bool) else self._library.oidnSetDeviceInt
            put(self.handle, name.encode(), value)
        self._library.oidnCommitDevice(self.handle)

    def number(self, name: str) -> int:
        """One of the device's numbers, such as ``versionMajor``."""
        return int(self._library.oidnGetDeviceInt(self.handle, name.encode()))

    def error(self) -> str:
        """Message of the first error since the last call; empty without one."""
        message = c_char_p()
        code = self._library.oidnGetDeviceError(self.handle, ctypes.byref(message))
        return (message.value or b"unknown error").decode(errors="replace") if code else ""

    def close(self) -> None:
        """Free the device; nothing of it may be used after that."""
        self._library.oidnReleaseDevice(self.handle)


def is_cuda_available() -> bool:
    """Whether the library can use the first NVIDIA GPU."""
    return bool(load().oidnIsCUDADeviceSupported(0))


class Buffer:
    """``size`` bytes in the memory of a device."""

    def __init__(self, device: Device, size: int) -> None:
        self._library = load()
        self.handle = self._library.oidnNewBuffer(device.handle, size)

    def write(self, values: NDArray[np.float32]) -> None:
        """Copy a C-contiguous array to the buffer."""
        self._library.oidnWriteBuffer(self.handle, 0, values.nbytes, values.ctypes.data)

    def read(self, values: NDArray[np.float32]) -> None:
        """Copy the buffer to a C-contiguous array."""
        self._library.oidnReadBuffer(self.handle, 0, values.nbytes, values.ctypes.data)

    def close(self) -> None:
        """Free the buffer."""
        self._library.oidnReleaseBuffer(self.handle)


class Filter:
    """The network for path-traced pictures, on a device."""

    def __init__(self, device: Device) -> None:
        self._library = load()
        self._handle = self._library.oidnNewFilter(device.handle, b"RT")

    def set_image(self, name: str, image: NDArray[np.float32], buffer: Buffer | None = None) -> None:
        """Let the filter read or write a C-contiguous ``(H, W, 3)`` image where it lies, or its copy in a buffer."""
        height, width = image.shape[:2]
        packed = _FORMAT_FLOAT3, width, height, 0, 0, 0
        if buffer is None:
            self._library.oidnSetSharedFilterImage(self._handle, name.encode(), image.ctypes.data, *packed)
        else:
            self._library.oidnSetFilterImage(self._handle, name.encode(), buffer.handle, *packed)

    def set_options(self, options: Mapping[str, float]) -> None:
        """Set options by their types: on or off, a whole number, or another number."""
        for name, value in options.items():
            kind = "Bool" if isinstance(value, bool) else "Int" if isinstance(value, int) else "Float"
            getattr(self._library, f"oidnSetFilter{kind}")(self._handle, name.encode(), value)

    def run(self) -> None:
        """Run the filter and wait for its end."""
        self._library.oidnCommitFilter(self._handle)
        self._library.oidnExecuteFilter(self._handle)

    def close(self) -> None:
        """Free the filter."""
        self._library.oidnReleaseFilter(self._handle)


#: The filters that :func:`keep_filters` closes; None outside of it.
_kept: ContextVar[dict[tuple[object, ...], Filter] | None] = ContextVar("filters", default=None)


@contextmanager
def keep_filters() -> Iterator[None]:
    """Keep filters and the memory in which they work from one run to the next, within the block.

    Building the network and clearing its memory take a quarter of a run on a picture of 512 x 512 pixels.
    """
    filters: dict[tuple[object, ...], Filter] = {}
    before = _kept.set(filters)
    try:
        yield
    finally:
        _kept.reset(before)
        for work in filters.values():
            work.close()


@contextmanager
def open_filter(device: Device, images: Collection[str], options: Mapping[str, float]) -> Iterator[Filter]:
    """A filter on a device for the images of these names (all must be set before each run).

    It is closed after the block. Within :func:`keep_filters` it is closed with that, and given again for the same
    names and options: setting an option anew would build the network anew.
    """
    kept = _kept.get()
    if kept is None:
        with closing(Filter(device)) as work:
            work.set_options(options)
            yield work
        return
    key = device, *sorted(images), *sorted(options.items())
    if key not in kept:
        kept[key] = Filter(device)
        kept[key].set_options(options)
    yield kept[key]
