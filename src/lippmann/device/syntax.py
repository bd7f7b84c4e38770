"""Dr.Jit's loops and branches in plain Python, transformed when a kernel is first called.

:func:`drjit.syntax` reads and recompiles a function's source, some milliseconds each; of all kernels a render calls
few.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar, cast

import drjit as dr

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def syntax(kernel: Kernel) -> Kernel:
    """Decorate a kernel as :func:`drjit.syntax` does, at its first call."""
    transformed: Kernel | None = None

    @functools.wraps(kernel)
    def call(*arguments: Any, **keywords: Any) -> Any:
        nonlocal transformed
        if transformed is None:
            transformed = dr.syntax(kernel)
        return transformed(*arguments, **keywords)

    return cast("Kernel", call)
