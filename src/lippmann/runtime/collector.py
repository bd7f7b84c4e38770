"""Python's cyclic collector, held off while the engine is told what to compute."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def no_collection() -> Iterator[None]:
    """Free nothing that only the cyclic collector finds, such as an earlier scene, within the block.

    The collector runs at any moment. Where it frees an emitter or a surface between two calls that one kernel makes to
    all of them, Dr.Jit 1.5 writes the code of those that are left down twice (its key of a function tells single ones
    from one of many) and aborts the process; a frozen kernel cannot record that either.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()
