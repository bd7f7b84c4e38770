"""What libraries print on standard error is kept from the terminal, and the terminal is given back."""

from __future__ import annotations

import contextlib
import io
import os
import subprocess
import sys
import threading

import pytest

from lippmann.runtime.quiet_stderr import silence_libraries


def test_what_is_printed_inside_is_not_seen_and_what_follows_is(capfd):
    os.write(2, b"before ")
    with silence_libraries():
        os.write(2, b"inside ")
    os.write(2, b"after")
    assert capfd.readouterr().err == "before after"


def test_the_stream_of_a_notebook_is_silent_too():
    stream = io.StringIO()
    with contextlib.redirect_stderr(stream):
        with silence_libraries():
            print("inside", file=sys.stderr)
        print("after", file=sys.stderr)
    assert stream.getvalue() == "after\n"


def test_an_error_gives_the_terminal_back(capfd):
    with pytest.raises(KeyError), silence_libraries():
        raise KeyError
    os.write(2, b"seen")
    assert capfd.readouterr().err == "seen"


def test_it_is_silent_until_the_last_thread_is_done(capfd):
    begun, leave = threading.Event(), threading.Event()

    def first() -> None:
        with silence_libraries():
            begun.set()
            leave.wait(10)

    thread = threading.Thread(target=first)
    thread.start()
    begun.wait(10)
    with silence_libraries():
        os.write(2, b"two ")
    os.write(2, b"one ")
    leave.set()
    thread.join()
    os.write(2, b"none")
    assert capfd.readouterr().err == "none"


def test_descriptors_are_not_used_up():
    with silence_libraries():
        pass
    before = len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0
    for _ in range(50):
        with silence_libraries():
            pass
    assert (len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0) == before


def test_a_process_without_standard_error_can_read_pictures():
    code = """
import os
os.close(2)
from lippmann.runtime.quiet_stderr import silence_libraries
with silence_libraries():
    print("read")
print(os.path.exists("/dev/fd/2"))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["read", "False"]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_a_child_forked_while_another_thread_is_silent_can_speak():
    code = """
import os, sys, threading
from lippmann.runtime import quiet_stderr as silence
begun, leave = threading.Event(), threading.Event()

def first():
    with silence.silence_libraries(), silence._lock:
        begun.set()
        leave.wait(60)

thread = threading.Thread(target=first)
thread.start()
begun.wait()
child = os.fork()
if child == 0:
    print("says", file=sys.stderr, flush=True)
    with silence.silence_libraries():
        os.write(2, b"inside ")
    os.write(2, b"what is wrong")
    os._exit(0)
os.waitpid(child, 0)
leave.set()
thread.join()
"""
    command = [sys.executable, "-W", "ignore:This process:DeprecationWarning", "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    assert done.stderr == "says\nwhat is wrong"


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_a_silence_that_a_fork_divides_ends_in_the_child_too():
    code = """
import os
from lippmann.runtime.quiet_stderr import silence_libraries
with silence_libraries():
    child = os.fork()
    if child:
        os.waitpid(child, 0)
    else:
        os.write(2, b"child ")
with silence_libraries():
    os.write(2, b"inside ")
os.write(2, b"end ")
os._exit(0)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stderr == "child end end "
