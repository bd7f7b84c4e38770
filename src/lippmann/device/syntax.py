"""Dr.Jit's loops and branches in plain Python, transformed when a kernel is first called, and kept beside its module.

:func:`drjit.syntax` reads and recompiles a function's source, which takes as long as tracing a small picture. So the
code that it makes is kept as Python keeps compiled modules: in ``__pycache__``, one file a kernel, valid for the very
code, Dr.Jit and Python that it was made from.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.util
import marshal
import sys
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, TypeVar, cast

import drjit as dr
from drjit.ast import syntax as transform_syntax

from lippmann.errors import OutputError
from lippmann.runtime.atomic_write import replacing

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def syntax(kernel: Kernel) -> Kernel:
    """Decorate a kernel as :func:`drjit.syntax` does, at its first call."""
    transformed: Callable[..., Any] | None = None

    @functools.wraps(kernel)
    def call(*arguments: Any, **keywords: Any) -> Any:
        nonlocal transformed
        if transformed is None:
            transformed = _transform(cast("FunctionType", kernel))
        return transformed(*arguments, **keywords)

    return cast("Kernel", call)


def _transform(kernel: FunctionType) -> Callable[..., Any]:
    # Version 2: later ones write references, which differ with how often an object happens to be used.
    digest = hashlib.sha256(marshal.dumps(kernel.__code__, 2))
    digest.update(f"{dr.__version__} {sys.version}".encode())
    key = digest.hexdigest()
    module = Path(importlib.util.cache_from_source(kernel.__code__.co_filename))
    kept = module.with_name(f"{module.stem}.{kernel.__qualname__}.syntax")
    code = _read(kept, key)
    if code is None:
        made = cast("FunctionType", transform_syntax(kernel))
        # Each process transforms the kernel anew if no file can be written.
        with contextlib.suppress(OutputError):
            if not sys.dont_write_bytecode:
                with replacing(kept) as unfinished:
                    unfinished.write_bytes(marshal.dumps((key, made.__code__)))
        return made
    function = FunctionType(code, kernel.__globals__, kernel.__name__, kernel.__defaults__)
    function.__kwdefaults__ = kernel.__kwdefaults__
    return function


def _read(path: Path, key: str) -> CodeType | None:
    try:
        stored_key, code = marshal.loads(path.read_bytes())
    except (OSError, ValueError, EOFError, TypeError):  # not there, or damaged
        return None
    return code if stored_key == key and isinstance(code, CodeType) else None
