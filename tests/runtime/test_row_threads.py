"""Kernels run over all of a range, once each, whoever helps."""

from __future__ import annotations

import os
import threading

import numpy as np
import pytest

from lippmann.runtime.row_threads import SMALLEST_BAND_OF_ROWS, Bands

ROWS = 40 * SMALLEST_BAND_OF_ROWS


@pytest.mark.parametrize("threads", [1, 2, 3, 7])
@pytest.mark.parametrize("rows", [0, 1, SMALLEST_BAND_OF_ROWS, ROWS - 3])
def test_every_row_is_met_once(threads, rows):
    met = np.zeros(rows, int)

    def kernel(first, last, step):
        met[first:last] += step

    Bands(threads).lines(kernel, rows, 5)
    assert (met == 5).all()


def test_several_threads_take_part():
    both = threading.Barrier(2, timeout=30)

    def kernel(first, last):
        if first in (0, ROWS // 8):
            both.wait()

    Bands(2).lines(kernel, ROWS)


@pytest.mark.parametrize("threads", [1, 2])
def test_a_kernel_that_fails_is_heard_of(threads):
    def kernel(first, last):
        if last == ROWS:
            raise ValueError("the last band")

    with pytest.raises(ValueError, match="last band"):
        Bands(threads).lines(kernel, ROWS)


def test_kernels_may_run_kernels():
    """A helper that waits for a helper has nobody left to wait for."""
    met = np.zeros((ROWS, ROWS), int)

    def inner(first, last, row):
        met[row, first:last] += 1

    def outer(first, last):
        for row in range(first, last):
            Bands(2).lines(inner, ROWS, row)

    Bands(2).lines(outer, ROWS)
    assert (met == 1).all()


def test_callers_on_several_threads_do_not_wait_for_each_other():
    met = np.zeros((6, ROWS), int)

    def kernel(first, last, caller):
        met[caller, first:last] += 1

    callers = [threading.Thread(target=Bands(2).lines, args=(kernel, ROWS, caller)) for caller in range(6)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join(30)
    assert (met == 1).all()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_child_has_helpers_of_its_own():
    def kernel(first, last):
        pass

    Bands(2).lines(kernel, ROWS)
    child = os.fork()
    if child == 0:
        both = threading.Barrier(2, timeout=30)

        def meets(first, last):
            if first in (0, ROWS // 8):
                both.wait()

        code = 1
        try:
            Bands(2).lines(meets, ROWS)
            code = 0
        finally:
            os._exit(code)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
