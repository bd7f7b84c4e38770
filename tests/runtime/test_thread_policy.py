"""Threads keep the scheduling policy that they had."""

import os
import threading
from contextlib import suppress

import pytest

from lippmann.runtime import thread_policy
from lippmann.runtime.thread_policy import kept_policy

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
        with kept_policy():
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
        with suppress(RuntimeError), kept_policy():
            go_real_time()
            raise RuntimeError
        assert os.sched_getscheduler(0) == before
    finally:
        os.sched_setscheduler(0, before, os.sched_param(0))


def test_systems_without_such_policies_are_left_alone(monkeypatch):
    monkeypatch.delattr(os, "sched_getscheduler", raising=False)
    with kept_policy():
        pass
    monkeypatch.undo()
    monkeypatch.setattr(thread_policy, "_THREADS", thread_policy._THREADS / "none")
    with kept_policy():
        pass
