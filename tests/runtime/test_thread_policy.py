"""Threads keep the scheduling policy that they had, or stand behind all others."""

import os
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import pytest

from lippmann.runtime import thread_policy
from lippmann.runtime.thread_policy import keep_policy, run_behind

REAL_TIME = getattr(os, "SCHED_FIFO", None)


def go_real_time():
    try:
        os.sched_setscheduler(0, REAL_TIME, os.sched_param(1))
    except (AttributeError, PermissionError):
        pytest.skip("this user, or this system, has no threads in real time")


def test_a_thread_and_its_new_ones_leave_real_time_again():
    before, done, seen = os.sched_getscheduler(0), threading.Event(), []

    def wait():
        seen.append(os.sched_getscheduler(0))
        done.wait()
        seen.append(os.sched_getscheduler(0))

    child = threading.Thread(target=wait)
    try:
        with keep_policy():
            go_real_time()
            child.start()
            while not seen:
                os.sched_yield()
        assert os.sched_getscheduler(0) == before
    finally:
        done.set()
        if child.ident:
            child.join()
        os.sched_setscheduler(0, before, os.sched_param(0))
    assert seen == [REAL_TIME, before]


def test_it_holds_after_an_error():
    before = os.sched_getscheduler(0)
    try:
        with suppress(RuntimeError), keep_policy():
            go_real_time()
            raise RuntimeError
        assert os.sched_getscheduler(0) == before
    finally:
        os.sched_setscheduler(0, before, os.sched_param(0))


def test_systems_without_such_policies_are_left_alone(monkeypatch):
    monkeypatch.delattr(os, "sched_getscheduler", raising=False)
    with keep_policy():
        pass
    monkeypatch.undo()
    monkeypatch.setattr(thread_policy, "_THREADS", thread_policy._THREADS / "none")
    with keep_policy():
        pass


@pytest.mark.skipif(sys.platform != "linux", reason="niceness is of whole processes")
def test_a_thread_and_those_that_it_starts_run_behind_the_others():
    def niceness():
        return os.getpriority(os.PRIO_PROCESS, 0)

    def of_thread():
        with ThreadPoolExecutor(1) as pool:
            return pool.submit(niceness).result()

    before = niceness()
    with ThreadPoolExecutor(1, initializer=run_behind) as pool:
        assert pool.submit(niceness).result() == min(before + 10, 19)
        assert pool.submit(of_thread).result() == min(before + 10, 19)
    assert niceness() == before == of_thread()
