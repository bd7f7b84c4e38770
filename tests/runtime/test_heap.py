"""Freed memory goes back to the system."""

import ctypes

import psutil
import pytest

from lippmann.runtime import heap

BLOCK, COUNT = 64 << 10, 2048


def resident():
    return psutil.Process().memory_info().rss


def test_blocks_freed_below_one_that_is_held_go_back():
    if heap._trim() is None:
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
    heap.return_freed_memory()
    after = resident()
    library.free(held)
    assert before - after > BLOCK * COUNT // 2


def test_other_c_libraries_are_left_alone(monkeypatch):
    heap._trim.cache_clear()
    monkeypatch.setattr(ctypes, "CDLL", lambda name: object())
    try:
        heap.return_freed_memory()
        assert heap._trim() is None
    finally:
        heap._trim.cache_clear()
