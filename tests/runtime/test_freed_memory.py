"""Freed memory is kept for what is allocated next, and goes back to the system where that is asked for."""

import ctypes
import subprocess
import sys

import psutil
import pytest

from lippmann.runtime import machine

BLOCK, COUNT = 64 << 10, 2048


#: Prints the pages that the system cleared for blocks of 20 MiB that are allocated and freed again and again.
PROGRAM = """
import resource, sys
import numpy as np
from lippmann.runtime import machine
if sys.argv[1] == "keep":
    machine.keep_freed_memory()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    first, second, third, fourth = (np.ones(5 << 19) for _ in range(4))
    del first, second, third, fourth
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def resident():
    return psutil.Process().memory_info().rss


def test_blocks_freed_below_one_that_is_held_go_back():
    if machine._function("malloc_trim", ctypes.c_size_t) is None:
        pytest.skip("the C library keeps no freed memory that could be given back")
    library = ctypes.CDLL(None)
    library.malloc.argtypes, library.malloc.restype = [ctypes.c_size_t], ctypes.c_void_p
    library.free.argtypes, library.free.restype = [ctypes.c_void_p], None
    blocks = [library.malloc(BLOCK) for _ in range(COUNT)]
    for block in blocks:
        ctypes.memset(block, 1, BLOCK)
    *freed, held = blocks
    for block in freed:
        library.free(block)
    before = resident()
    machine.return_freed_memory()
    after = resident()
    library.free(held)
    assert before - after > BLOCK * COUNT // 2


def test_large_blocks_that_are_freed_are_kept_for_the_next():
    if machine._function("mallopt", ctypes.c_int, ctypes.c_int) is None:
        pytest.skip("the C library keeps no freed memory")
    pages = [
        int(subprocess.run([sys.executable, "-c", PROGRAM, word], capture_output=True, text=True, check=True).stdout)
        for word in ("keep", "not")
    ]
    assert pages[0] < pages[1] / 4


def test_memory_that_a_reader_frees_is_kept(monkeypatch):
    from lippmann.scene.readers import load

    scene, order = load.load_scene("teapot"), []
    monkeypatch.setattr(load, "keep_freed_memory", lambda: order.append("keep"))
    monkeypatch.setattr(load, "_from_name", lambda *_: order.append("read") or scene)
    load.load_scene("teapot")
    assert order == ["keep", "read"]


def test_other_c_libraries_are_left_alone(monkeypatch):
    machine._function.cache_clear()
    monkeypatch.setattr(ctypes, "CDLL", lambda name: object())
    try:
        machine.return_freed_memory()
        machine.keep_freed_memory.__wrapped__()
        assert machine._function("malloc_trim", ctypes.c_size_t) is None
    finally:
        machine._function.cache_clear()
