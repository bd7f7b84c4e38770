"""Machine code of Numba's kernels, kept on disk and run without Numba.

Numba takes longer to start than a small picture to render. What it made of a kernel is loaded here by llvmlite, the
compiler below it, and called with the addresses and sizes of the arrays. This is known to work on Linux; elsewhere, and
for kernels that return something or take anything but numbers and arrays, Numba itself runs them.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib.util
import marshal
import os
import struct
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import astuple, dataclass
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

from lippmann.errors import OutputError
from lippmann.runtime.atomic_write import replacing

#: By NumPy's name of a number's kind and size: how it is handed over, and its type in LLVM.
_NUMBERS: dict[str, tuple[Any, str]] = {
    "b1": (ctypes.c_bool, "i8"),
    "i4": (ctypes.c_int32, "i32"),
    "i8": (ctypes.c_int64, "i64"),
    "u4": (ctypes.c_uint32, "i32"),
    "u8": (ctypes.c_uint64, "i64"),
    "f4": (ctypes.c_float, "float"),
    "f8": (ctypes.c_double, "double"),
}
_OF_PYTHON = {bool: "b1", int: "i8", float: "f8"}
#: What Numba's code returns where nothing went wrong.
_RETURNED = (0, -2)

#: The kind of section of an ELF file that lists symbols.
_SYMBOLS = 2

#: What of the arguments makes another variant of the code: a number's kind; an array's, its dimensions, its order, and
#: whether it may be written.
Variant = tuple[tuple[str, int, str, bool], ...]


@dataclass(frozen=True)
class MachineCode:
    """One variant of a kernel: its name, the types of its parameters, and the object file."""

    symbol: str
    parameters: tuple[str, ...]
    content: bytes


@cache
def is_usable() -> bool:
    """Whether kernels can be run without Numba here; settings of Numba's own are for Numba."""
    return sys.platform == "linux" and not any(name.startswith("NUMBA_") for name in os.environ)


def variant_of(arguments: Sequence[object]) -> Variant | None:
    """The variant of the code that arguments need; None if Numba has to run them."""
    found = []
    for one in arguments:
        if isinstance(one, np.ndarray):
            flags = one.flags
            if one.dtype.kind not in "biuf" or not one.dtype.isnative or not flags.aligned:
                return None
            order = "C" if flags.c_contiguous else "F" if flags.f_contiguous else "A"
            found.append((one.dtype.str[1:], one.ndim, order, flags.writeable))
        else:
            kind = one.dtype.str[1:] if isinstance(one, np.generic) else _OF_PYTHON.get(type(one), "")
            if kind not in _NUMBERS:
                return None
            found.append((kind, 0, "", False))
    return tuple(found)


def load(
    kernel: FunctionType, variant: Variant, stamp: str, make: Callable[[], MachineCode | None]
) -> Callable[..., None] | None:
    """A function that runs one variant of a kernel; None if Numba has to.

    Its code is kept beside the kernel's compiled module, or else in the user's cache folder, for this ``stamp``, this
    processor and these versions. Where none is kept, ``make`` compiles it.
    """
    key = hashlib.sha256(f"{stamp} {_machine()} {variant}".encode()).hexdigest()
    places = list(_places(kernel, variant))
    code = next((code for code in (_read(place, key) for place in places) if code is not None), None)
    if code is None:
        code = make()
        if code is None:
            return None
        if not sys.dont_write_bytecode:
            _write(places, key, code)
    return _link(code, variant)


def _places(kernel: FunctionType, variant: Variant) -> Iterator[Path]:
    module = Path(importlib.util.cache_from_source(kernel.__code__.co_filename))
    name = f"{module.stem}.{kernel.__qualname__}.{hashlib.sha256(repr(variant).encode()).hexdigest()[:12]}.kernel"
    yield module.with_name(name)
    folder = os.environ.get("XDG_CACHE_HOME")
    yield (Path(folder) if folder else Path.home() / ".cache") / "lippmann" / "kernels" / name


def _read(place: Path, key: str) -> MachineCode | None:
    try:
        kept, *fields = marshal.loads(place.read_bytes())
        return MachineCode(*fields) if kept == key else None
    except (OSError, ValueError, EOFError, TypeError):  # not there, or damaged
        return None


def _write(places: Sequence[Path], key: str, code: MachineCode) -> None:
    for place in places:
        with suppress(OutputError, OSError):
            place.parent.mkdir(parents=True, exist_ok=True)
            with replacing(place, private=True) as unfinished:
                unfinished.write_bytes(marshal.dumps((key, *astuple(code))))
            return


@cache
def _machine() -> str:
    """The processor, and the versions of all that makes code or says how it is called."""
    from llvmlite import __version__
    from llvmlite.binding import get_host_cpu_features, get_host_cpu_name

    numba = importlib.util.find_spec("numba")
    version = "" if numba is None else Path(str(numba.origin)).with_name("_version.py").read_text()
    own = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()
    return f"{get_host_cpu_name()} {get_host_cpu_features().flatten()} {__version__} {version} {sys.version} {own}"


@cache
def _llvm() -> Any:
    from llvmlite import binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    # Python itself need not have the functions of mathematics.
    with suppress(RuntimeError):
        binding.load_library_permanently("libm.so.6")
    return binding


#: Compilers hold the code that they have loaded.
_compilers: list[Any] = []


def _link(code: MachineCode, variant: Variant) -> Callable[..., None] | None:
    """The function itself, if it is called as expected and all that it calls is there."""
    llvm = _llvm()
    passed = [part for kind, dimensions, *_ in variant for part in _parts(kind, dimensions)]
    # First come the places of the result and of an exception.
    if code.parameters != ("ptr", "ptr", *(name for _, name in passed)):
        return None
    if not all(llvm.address_of_symbol(name) for name in _missing(code.content)):
        return None
    compiler = llvm.create_mcjit_compiler(
        llvm.parse_assembly(""), llvm.Target.from_default_triple().create_target_machine()
    )
    compiler.add_object_file(llvm.ObjectFileRef.from_data(code.content))
    compiler.finalize_object()
    _compilers.append(compiler)
    kinds = (ctypes.c_void_p, ctypes.c_void_p, *(kind for kind, _ in passed))
    # Calls release the interpreter's lock.
    function = ctypes.CFUNCTYPE(ctypes.c_int32, *kinds)(compiler.get_function_address(code.symbol))

    def run(*arguments: Any) -> None:
        result, error = ctypes.c_void_p(), ctypes.c_void_p()
        values: list[Any] = [ctypes.addressof(result), ctypes.addressof(error)]
        for one in arguments:
            if isinstance(one, np.ndarray):
                # Without counts of references, the first two are not looked at.
                values += (None, None, one.size, one.itemsize, one.ctypes.data, *one.shape, *one.strides)
            else:
                values.append(one.item() if isinstance(one, np.generic) else one)
        if function(*values) not in _RETURNED:
            raise RuntimeError(f"kernel {code.symbol} failed")

    return run


def _parts(kind: str, dimensions: int) -> list[tuple[Any, str]]:
    """The parameters that a number, or an array of ``dimensions``, takes."""
    if not dimensions:
        return [_NUMBERS[kind]]
    pointer, size = (ctypes.c_void_p, "ptr"), (ctypes.c_int64, "i64")
    return [pointer, pointer, size, size, pointer, *[size] * (2 * dimensions)]


def _missing(content: bytes) -> list[str]:
    """What an object file calls and does not hold: the undefined symbols of an ELF file of 64 bits."""
    offset, size, count = (
        struct.unpack_from(form, content, at)[0] for form, at in (("<Q", 40), ("<H", 58), ("<H", 60))
    )
    sections = [struct.unpack_from("<IIQQQQII", content, offset + size * number) for number in range(count)]
    names = []
    for _, kind, _, _, start, length, strings, _ in sections:
        if kind == _SYMBOLS:
            for name, _, _, section, _, _ in struct.iter_unpack("<IBBHQQ", content[start : start + length]):
                if name and not section:
                    text = sections[strings][4] + name
                    names.append(content[text : content.index(b"\0", text)].decode())
    return names
